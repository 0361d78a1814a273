# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of equal geometry uses the meshes of the previous one; every other change builds them anew."""

from __future__ import annotations

import gc
from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    Color,
    Computed,
    Diffuse,
    Emission,
    Film,
    Glass,
    Glossy,
    Instance,
    Material,
    PointLight,
    Principled,
    ScatteringMedium,
    World,
    gray,
)
from spectral_core.scene.shading import Builder
from tests.render.scenes import lit_plane, looking_down, matrix, sphere_mesh
from tests.render.surfaces.test_programs import noise_program

pytest.importorskip("mitsuba")


@pytest.fixture
def built(monkeypatch):
    """Names of the meshes that were built."""
    from spectral_core.render.mitsuba_scene import geometry, kept

    made, make = [], geometry.mesh_shape
    monkeypatch.setattr(geometry, "mesh_shape", lambda *given: made.append(given[1].name) or make(*given))
    monkeypatch.setattr(kept, "_kept", kept._Kept())
    return made


def _scene(transport="rgb"):
    lamp = PointLight(name="lamp", world_from_light=matrix((0.4, 0.2, 3)), power_w=80, radius=0.2)
    scene = lit_plane(
        lamp, transport=transport, film=Film(12, 12, samples=2), camera=looking_down(4, 0.6), world=World(gray(0.2))
    )
    balls = [Instance(f"ball {k}", "sphere", matrix((0.7 * k - 0.7, 0, 0.4), 0.3), (f"paint {k}",)) for k in range(3)]
    build = Builder()
    own_color = Computed(build.program(build.add("vector_input", (), "object_color", 0)))
    paints = (Principled(Color([0.7, 0.2, 0.1])), Diffuse(own_color), Glossy(gray(0.8), 0.2))
    named = [Material(f"paint {k}", paint) for k, paint in enumerate(paints)]
    return replace(
        scene,
        meshes=(*scene.meshes, sphere_mesh(8)),
        materials=(*scene.materials, *named),
        instances=(*scene.instances, *balls),
    )


def _with_material(scene, number, **what):
    materials = list(scene.materials)
    materials[number] = replace(materials[number], **what)
    return replace(scene, materials=tuple(materials))


def _with_instance(scene, number, **what):
    instances = list(scene.instances)
    instances[number] = replace(instances[number], **what)
    return replace(scene, instances=tuple(instances))


SAME_GEOMETRY = {
    "number": lambda scene: _with_material(scene, 1, surface=Principled(Color([0.1, 0.6, 0.3]), roughness=0.9)),
    "closure": lambda scene: _with_material(scene, 2, surface=Glass(roughness=0.3)),
    "program": lambda scene: _with_material(scene, 2, surface=Diffuse(Computed(noise_program(3.0)))),
    "emission": lambda scene: _with_material(scene, 2, surface=Emission(gray(1.0), 2.0)),
    "medium": lambda scene: _with_material(scene, 2, surface=None, medium=ScatteringMedium(2.0, gray(0.8))),
    "lamp": lambda scene: replace(scene, lights=(replace(scene.lights[0], power_w=20.0, radius=0.5),)),
    "visibility": lambda scene: _with_instance(scene, 1, is_holdout=True),
    "object color": lambda scene: _with_instance(scene, 2, color=(0.9, 0.2, 0.1, 1.0)),
    "camera": lambda scene: replace(scene, camera=looking_down(5, 0.5)),
}
OTHER_GEOMETRY = {
    "place": lambda scene: _with_instance(scene, 1, world_from_object=matrix((0.1, 0.3, 0.4), 0.3)),
    "materials": lambda scene: _with_instance(scene, 1, materials=("paint 2",)),
    "mesh": lambda scene: replace(scene, meshes=(scene.meshes[0], sphere_mesh(6))),
    "world": lambda scene: replace(scene, world=World(Color([0.1, 0.4, 0.9]))),
    "varying emission": lambda scene: _with_material(
        scene, 2, surface=Emission(Computed(noise_program(2.0)), 2.0)
    ),
    "fewer objects": lambda scene: replace(scene, instances=scene.instances[:2]),
}  # fmt: skip


BY_WAVELENGTH = ("program", "emission", "medium", "lamp", "place")
"""Changes that are also made in spectral transport, whose tables of materials, media and lights are its own."""


@pytest.mark.parametrize(
    ("change", "transport"),
    [(change, "rgb") for change in (*SAME_GEOMETRY, *OTHER_GEOMETRY)]
    + [(change, "spectral") for change in BY_WAVELENGTH],
)
def test_a_changed_scene_is_the_picture_of_a_new_one(built, change, transport, monkeypatch):
    from spectral_core.render.mitsuba_scene import kept

    scene = _scene(transport)
    changed = {**SAME_GEOMETRY, **OTHER_GEOMETRY}[change](scene)
    first = render_scene(scene).pixels
    gc.collect()
    built.clear()
    picture = render_scene(changed).pixels
    assert bool(built) == (change in OTHER_GEOMETRY)
    assert np.abs(picture - first).max() > 1e-3
    monkeypatch.setattr(kept, "_kept", kept._Kept())
    gc.collect()
    np.testing.assert_allclose(picture, render_scene(changed).pixels, rtol=1e-5, atol=1e-6)


def test_copies_of_a_group_are_kept(built, monkeypatch):
    from spectral_core.render.mitsuba_scene import shapes

    monkeypatch.setattr(shapes, "SHARED_TRIANGLES", 10)
    scene = _scene()
    scene = replace(
        scene, instances=tuple(replace(item, materials=("paint 0",)) for item in scene.instances)
    )  # fmt: skip
    first = render_scene(scene).pixels
    gc.collect()
    built.clear()
    again = render_scene(_with_material(scene, 1, surface=Diffuse(Color([0.1, 0.5, 0.9])))).pixels
    assert not built
    gc.collect()
    assert np.abs(again - first).max() > 0.01
    np.testing.assert_allclose(render_scene(scene).pixels, first, rtol=1e-5)
    assert not built


def test_a_scene_in_use_keeps_its_own_materials(built):
    """Two scenes at a time, as for a plan's pilot: the second one builds its own meshes."""
    from spectral_core.render.job import RenderJob
    from spectral_core.render.plan.effects import plan_from_data

    scene = _scene()
    other = _with_material(scene, 1, surface=Diffuse(gray(0.05)))
    job = RenderJob(scene, plan_from_data(scene))
    job.trace(2)
    before = job.picture()
    built.clear()
    render_scene(other)
    assert built
    again = RenderJob(scene, plan_from_data(scene))
    again.trace(2)
    np.testing.assert_allclose(again.picture(), before, rtol=1e-5)
    job.trace(2)
    assert np.isfinite(job.picture()).all()


def test_large_geometry_ends_with_its_scene(built, monkeypatch):
    from spectral_core.render.mitsuba_scene import kept

    monkeypatch.setattr(kept, "MOST_KEPT", 10)
    render_scene(_scene())
    gc.collect()
    assert kept._kept.geometry is None


def test_the_data_of_a_scene_end_with_it(built):
    """Textures of a scene that has ended take no memory."""
    from spectral_core.render.mitsuba_scene import kept

    render_scene(_scene())
    gc.collect()
    assert kept._kept.geometry is not None
    assert kept._kept.geometry.bsdf.surfaces is None
    assert kept._kept.geometry.meshes.scene is None


def test_a_kept_bsdf_answers_a_scene_of_mitsuba_itself(built):
    """Dr.Jit asks all BSDFs that exist; the one that waits for the next scene has no surfaces."""
    import mitsuba as mi

    from spectral_core.render.mitsuba_scene import kept

    render_scene(_scene())
    gc.collect()
    assert kept._kept.geometry is not None
    assert kept._kept.geometry.bsdf.surfaces is None
    ball = {"type": "sphere", "material": {"type": "diffuse"}}
    plate = {"type": "rectangle", "material": {"type": "conductor"}}
    eye = mi.ScalarTransform4f().look_at(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": 8, "height": 8}
    light, sensor = {"type": "constant"}, {"type": "perspective", "to_world": eye, "film": film}
    scene = mi.load_dict({"type": "scene", "a": ball, "b": plate, "light": light, "sensor": sensor})
    pixels = np.array(mi.render(scene, integrator=mi.load_dict({"type": "path"}), spp=4))
    assert np.isfinite(pixels).all()
    assert pixels.mean() > 0.1
