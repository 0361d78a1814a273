# SPDX-License-Identifier: GPL-3.0-or-later
"""Hits from tables of triangles equal those of Mitsuba's shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import Color, Computed, Diffuse, Emission, Film, Instance, Material, PointLight, Principled
from spectral_core.scene.shading import Builder
from tests.render.scenes import lit_plane, matrix

pytest.importorskip("mitsuba")

FIELDS = ("t", "p", "n", "uv", "dp_du", "dp_dv", "wi", "prim_index")


def _scene():
    """Meshes with and without normals and UV maps, one map without area, and instances with shear and reflection."""
    rng = np.random.default_rng(2)
    plain = lit_plane(PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), radius=0.4))
    flat = plain.meshes[0]
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5)), -1).reshape(-1, 2)
    bent = np.column_stack([grid, 0.3 * np.cos(2 * grid[:, 0]) + 0.1 * grid[:, 1]]).astype(np.float32)
    faces = [(k, k + 1, k + 6) for k in range(19) if k % 5 < 4] + [(k, k + 6, k + 5) for k in range(19) if k % 5 < 4]
    normals = bent * [0.3, 0.2, 0.0] + [0, 0, 1]
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    base = replace(flat, name="bare", positions=bent, triangles=np.array(faces, np.uint32), normals=None, uvs=None)
    uvs = rng.random((25, 2)).astype(np.float32)
    meshes = (
        base,
        replace(base, name="smooth", normals=normals),
        replace(base, name="mapped", normals=normals, uvs=uvs),
        replace(base, name="no area", uvs=np.zeros((25, 2), np.float32)),
    )
    sheared = np.eye(4)
    sheared[:3, :3] = [[1, 0.4, 0], [0, -1.5, 0.2], [0.1, 0, 0.7]]
    placed = []
    for k, mesh in enumerate(meshes):
        for side in (0, 1):
            place = (sheared if side else np.eye(4)).copy()
            place[:3, 3] = (2.5 * k - 4, 4.0 * side - 2, 0)
            placed.append(Instance(f"{mesh.name} {side}", mesh.name, place, ("matt",)))
    return replace(plain, meshes=meshes, instances=tuple(placed), materials=(Material("matt", Diffuse()),))


@pytest.mark.parametrize("movable", [False, True])
def test_hits_equal_those_of_mitsuba(movable):
    import drjit as dr

    from spectral_core.render.job import Measure, RenderJob
    from spectral_core.render.plan.effects import plan_from_data

    scene = _scene()
    job = RenderJob(scene, plan_from_data(scene, 0.0), Measure(movable=movable))
    loaded = job.loaded
    mi, rules = loaded.mitsuba, loaded.first_hit.rules
    rng = np.random.default_rng(1)
    origin, target = np.array([[0.0], [0], [5]]), rng.uniform(-5, 5, (3, 20000)) * [[1.2], [0.9], [0]]
    toward = (target - origin) / np.linalg.norm(target - origin, axis=0)
    start = np.broadcast_to(origin, toward.shape).astype(np.float32)
    ray = mi.Ray3f(mi.Point3f(start), mi.Vector3f(toward.astype(np.float32)))
    theirs = loaded.scene.scene.ray_intersect(ray, mi.RayFlags.All, False, True)
    ours = rules.intersect(loaded.scene.scene, ray, mi.Bool(True))
    hit = np.array(theirs.is_valid())
    assert 0.3 < hit.mean() < 1 and np.array_equal(hit, np.array(ours.is_valid()))

    def number(pointer):
        return np.broadcast_to(np.array(dr.reinterpret_array(mi.UInt32, pointer)), hit.shape)

    np.testing.assert_array_equal(number(ours.shape)[hit], number(theirs.shape)[hit])
    np.testing.assert_array_equal(number(ours.instance), number(theirs.instance))
    assert len(np.unique(np.where(number(ours.instance) > 0, number(ours.instance), number(ours.shape))[hit])) >= 8
    on_mesh = hit & np.isin(number(ours.shape), list(rules.meshes._meshes))  # the UV map of a lamp's body is not used
    pairs = [(name, getattr(ours, name), getattr(theirs, name)) for name in FIELDS]
    pairs += [(f"frame {name}", getattr(ours.sh_frame, name), getattr(theirs.sh_frame, name)) for name in "nst"]
    for name, mine, given in pairs:
        a, b = (np.array(value, dtype=np.float64)[..., on_mesh] for value in (mine, given))
        np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-4, err_msg=name)


def test_objects_and_materials_add_nothing_to_the_kernel():
    """The same operations trace 2 and 30 objects, instances and materials of one type."""
    import drjit

    from spectral_core.render.job import Measure, RenderJob
    from spectral_core.render.plan.effects import plan_from_data

    plain = lit_plane(PointLight(name="lamp", world_from_light=matrix((0, 0, 3))), film=Film(8, 8, samples=1))

    def operations(count, movable):
        rng = np.random.default_rng(count)
        materials = tuple(Material(f"m{k}", Principled(roughness=float(rng.uniform(0.1, 1)))) for k in range(count))
        placed = tuple(
            Instance(f"o{k}", plain.meshes[0].name, matrix((0, 0, -0.1 * k)), (f"m{k}",)) for k in range(count)
        )
        scene = replace(plain, materials=materials, instances=placed)
        job = RenderJob(scene, plan_from_data(scene, 0.0), Measure(movable=movable))
        with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
            drjit.kernel_history_clear()
            job.trace(1)
            return max(kernel.get("operation_count", 0) for kernel in drjit.kernel_history())

    for movable in (False, True):
        few, many = operations(2, movable), operations(30, movable)
        assert few > 1000
        assert many == few


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_light_that_is_sampled_on_a_mesh_reads_its_smooth_normals(transport):
    """A panel over a table that shines as bright as they are long: they are the same all over it."""
    plain = lit_plane(transport=transport, film=Film(8, 8, samples=256))
    base = plain.meshes[0]
    slant = np.array([0.6, 0.0, -0.8], np.float32)
    panel = replace(
        base,
        name="panel",
        positions=base.positions / 50,
        triangles=base.triangles[:, ::-1],
        normals=np.tile(slant, (4, 1)),
    )

    def seen(color):
        scene = replace(
            plain,
            meshes=(base, panel),
            materials=(*plain.materials, Material("glow", Emission(color))),
            instances=(*plain.instances, Instance("panel", "panel", matrix((0, 0, 2.5)), ("glow",))),
        )
        return render_scene(scene).pixels[..., :3].mean((0, 1))

    build = Builder()
    read = build.add("vector_input", (), "normal", 0)
    known = seen(Color(np.abs(slant)))
    np.testing.assert_allclose(seen(Computed(build.program(read))) * np.sign(slant), known, atol=0.01 * known.max())
