# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits in place that change what a loaded scene has computed from them: pictures equal those of scenes loaded anew."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.palette.paint.fluorescence import led
from spectral_core.render.live.passes import Launcher
from spectral_core.render.live.server import Server
from spectral_core.render.live.stage import Stage
from spectral_core.scene import (
    Color,
    Emission,
    Fluorescent,
    PointLight,
    RenderSettings,
    Scene,
    SpotLight,
    SunLight,
    World,
    gray,
)
from spectral_core.scene.lights import Light
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum
from tests.live import test_live_session as session
from tests.live.changes.test_live_programs import _pictured
from tests.live.test_live_session import at, with_place, with_stretch

scene = session.scene


def lit_by(scene: Scene, *lights: Light) -> Scene:
    return replace(scene, lights=lights, world=World())


def in_spectra(scene: Scene) -> Scene:
    return replace(scene, settings=RenderSettings(transport="spectral"))


def test_a_lamp_with_a_radius_is_moved_and_resized(scene: Scene) -> None:
    """Its ball stayed where it was in the tables of hits: a larger one was a hundred times too bright."""
    lamp = PointLight(name="lamp", world_from_light=at(0, -2, 3), power_w=500.0, radius=0.3, camera_visible=True)
    unseen = replace(lamp, name="unseen", camera_visible=False)
    spot = SpotLight(name="spot", world_from_light=at(2, -2, 4), power_w=500.0, radius=0.2, cone_angle_rad=1.2)
    stage = Stage()
    for radius, place in ((0.3, (0, -2, 3)), (1.0, (0, -2, 3)), (0.05, (1, -2, 2)), (0.3, (-3, -2, 2))):
        ball, cone = replace(lamp, radius=radius, world_from_light=at(*place)), replace(spot, radius=radius / 2)
        other = replace(unseen, radius=1.1 * radius, world_from_light=at(*place) @ at(1, 0, 0.5))
        now = lit_by(scene, ball, other, cone)
        np.testing.assert_allclose(_pictured(stage, now), _pictured(Stage(), now), rtol=1e-5, atol=1e-6)
    assert stage.loads == 1


@pytest.mark.parametrize("collapsed", [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
def test_a_mesh_without_area_gains_one(scene: Scene, collapsed: tuple[float, float, float]) -> None:
    """As by a shape key that unfolds it: it stayed invisible."""
    stage, gone = Stage(), with_stretch(scene, "two", collapsed)
    for now in (gone, scene, gone):
        np.testing.assert_array_equal(_pictured(stage, now, 1), _pictured(Stage(), now, 1))


def test_the_triangles_of_one_material_gain_an_area(scene: Scene) -> None:
    (mesh,) = (each for each in scene.meshes if each.name == "two")
    assert mesh.normals is not None
    corners, half = mesh.triangles.ravel(), len(mesh.triangles) // 2
    apart = replace(
        mesh,
        positions=mesh.positions[corners],
        normals=mesh.normals[corners],
        triangles=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        material_indices=(np.arange(2 * half) < half).astype(np.uint16),
    )
    folded = apart.positions.copy()
    folded[: 3 * half] = 0
    items = tuple(replace(each, materials=("shiny", "red")) if each.mesh == "two" else each for each in scene.instances)

    def shown(positions: np.ndarray) -> Scene:
        others = tuple(each for each in scene.meshes if each is not mesh)
        return replace(scene, meshes=(*others, replace(apart, positions=positions)), instances=items)

    stage = Stage()
    for now in (shown(folded), shown(apart.positions), shown(folded)):
        np.testing.assert_array_equal(_pictured(stage, now, 1), _pictured(Stage(), now, 1))


@pytest.mark.parametrize("kind", ["grows", "leaves"])
def test_a_scene_that_outgrows_the_disk_of_its_sun_is_lit_from_one_direction(scene: Scene, kind: str) -> None:
    """A floor scaled to a landscape was lit from a disk that was not far away any more."""
    tilt = np.eye(4)
    tilt[1:3, 1:3] = [[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]]
    sun = SunLight(name="sun", world_from_light=tilt, irradiance=3.0, angle_rad=0.009)
    small = lit_by(scene, sun)
    if kind == "grows":
        large, high = with_place(small, "floor", np.diag([300.0, 300.0, 1.0, 1.0])), 700.0
        camera = replace(scene.camera, world_from_camera=at(0, 0, high), far=1e5)
    else:
        away = np.eye(4)
        away[:3, 3] = 3e4, 0, 0
        moved = tuple(replace(x, world_from_object=away @ x.world_from_object) for x in small.instances)
        large, camera = (
            replace(small, instances=moved),
            replace(scene.camera, world_from_camera=at(3e4, 0, 12), far=1e5),
        )
    large = replace(large, camera=camera)
    stage = Stage()
    _pictured(stage, small)
    found, true = _pictured(stage, large), _pictured(Stage(), large)
    assert stage.loads == 1
    assert true[..., :3].mean() > 0.1
    np.testing.assert_allclose(found, true, rtol=2e-3, atol=1e-4)


def test_a_sun_stays_while_the_scene_does(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    from spectral_core.render.live.in_place.edits import Edit

    sun, edited = SunLight(name="sun", world_from_light=np.eye(4), irradiance=3.0, angle_rad=0.009), []
    stage, still = Stage(), lit_by(scene, sun)
    stage.show(still)
    monkeypatch.setattr(Edit, "light", lambda *_: edited.append("sun") or True)
    stage.show(with_place(still, "left", at(-1, -2, 1.5)))
    assert edited == []


def peaked(middle_nm: float, is_regular: bool) -> Illuminant:
    """Its knots move with the peak."""
    knots = np.array([-20.0, 0.0, 20.0 if is_regular else 33.0]) + middle_nm
    return Illuminant("peak", SpectralGrid(knots), np.array([0.2, 1.0, 0.3]))


def narrow(middle_nm: float) -> Illuminant:
    knots = np.arange(380.0, 781.0)
    return Illuminant("narrow", SpectralGrid(knots), np.exp(-(((knots - middle_nm) / 3) ** 2)))


def shining(scene: Scene, lamp: Spectrum, world: Spectrum | Color, surface: Spectrum) -> Scene:
    """The scene in the light of one lamp, the world and a ball, each with its spectrum."""
    glowing = tuple(replace(m, surface=Emission(surface, 3.0)) if m.name == "red" else m for m in scene.materials)
    lit = lit_by(scene, replace(scene.lights[0], color=lamp))
    return in_spectra(replace(lit, world=World(world, 1.0), materials=glowing))


def test_a_spectrum_with_other_knots_has_its_color(scene: Scene) -> None:
    """Recorded launches had the range of a spectrum as a constant: a red lamp in place of a green one shone green."""
    stage = Stage()
    colors = {"lamp": peaked(500, True), "world": peaked(560, False), "surface": peaked(610, False)}
    for owner in ("nothing", *colors):
        now = colors | ({owner: peaked(450, owner == "lamp")} if owner in colors else {})
        shown = shining(scene, **now)
        np.testing.assert_array_equal(_pictured(stage, shown), _pictured(Stage(), shown), err_msg=owner)


def test_the_wavelengths_of_narrow_lights_are_drawn_after_they_were_edited(scene: Scene) -> None:
    """They were drawn where the light of the loaded scene was: the picture had twenty times the noise."""
    stage = Stage()
    for lamp_nm, surface_nm in ((532.0, 600.0), (620.0, 600.0), (620.0, 450.0)):
        now = shining(scene, narrow(lamp_nm), gray(0.0), narrow(surface_nm))
        np.testing.assert_array_equal(_pictured(stage, now), _pictured(Stage(), now))
    assert stage.loads == 1
    assert stage.launcher.recordings <= 2  # the first edit of a spectrum may need another one


def test_other_lamps_are_edited_with_the_same_wavelengths(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[object] = []
    monkeypatch.setattr(Launcher, "draw_by", lambda _launcher, plan: drawn.append(plan))
    stage = Stage()
    for kelvin in (6500.0, 3000.0, 9000.0):
        knots = np.arange(380.0, 781.0, 5.0)
        values = knots**-5 / np.expm1(1.4388e7 / (knots * kelvin))
        lamp = Illuminant("blackbody", SpectralGrid(knots), values / values.max())
        stage.show(in_spectra(lit_by(scene, replace(scene.lights[0], color=lamp))))
    assert (stage.loads, drawn) == (1, [])


def test_dyes_are_excited_by_the_edited_lamp(scene: Scene) -> None:
    """Another lamp, and then less of the dye."""
    dye = FluorescentDye.gaussian("green", 405, 530)
    stage, green = Stage(), []
    for peak_nm, amount in ((470, 0.5), (405, 0.5), (405, 0.1)):
        paint = Fluorescent(gray(0.2), (dye,), (amount,))
        dyed = tuple(replace(m, surface=paint) if m.name in ("red", "gray") else m for m in scene.materials)
        now = in_spectra(replace(lit_by(scene, replace(scene.lights[0], color=led(peak_nm))), materials=dyed))
        shown = _pictured(stage, now)
        np.testing.assert_array_equal(shown, _pictured(Stage(), now))
        green.append(shown[..., 1].sum())
    assert green[1] > 1.02 * green[2]


def test_garbage_is_collected_after_a_launch(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene of Mitsuba in a cycle of references that was freed while another was recorded ended the process."""
    launch, states = Launcher._launch, []

    def launched(*arguments: object) -> object:
        states.append(gc.isenabled())
        return launch(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Launcher, "_launch", launched)
    _pictured(Stage(), scene, 1)
    assert states
    assert not any(states)
    assert gc.isenabled()


def test_a_scene_that_is_dropped_is_freed(scene: Scene) -> None:
    server = Server(lambda _message: None)
    server.hear("scene", ("first", scene))
    server.work()
    loaded = weakref.ref(server._stages["first"].stage._job.loaded.scene)  # type: ignore[union-attr]
    assert loaded() is not None
    gc.disable()
    try:
        server.hear("drop", "first")
    finally:
        gc.enable()
    assert loaded() is None


def _far(scene: Scene, place: tuple[float, float, float]) -> Scene:
    """The scene moved as a whole."""
    there = at(*place)
    return replace(
        scene,
        camera=replace(scene.camera, world_from_camera=there @ scene.camera.world_from_camera),
        instances=tuple(replace(item, world_from_object=there @ item.world_from_object) for item in scene.instances),
        lights=tuple(replace(item, world_from_light=there @ item.world_from_light) for item in scene.lights),
    )


def test_a_view_far_from_the_origin_is_that_of_the_scene_at_the_origin(scene: Scene) -> None:
    """Rays start far off their surfaces there: contact shadows were gone."""
    lamp = PointLight(name="lamp", world_from_light=at(0, -2, 3), power_w=500.0, radius=0.3)
    near, stage = lit_by(scene, lamp), Stage()
    brighter = lit_by(scene, replace(lamp, power_w=700.0, world_from_light=at(1, -2, 3)))
    for now in (near, brighter):
        far = _far(now, (20_000.0, -3_000.0, 500.0))
        off = ~np.isclose(_pictured(stage, far), _pictured(Stage(), now), rtol=0.02, atol=5e-3)
        assert off.mean() < 0.003, "but for single samples at outlines"
    assert stage.loads == 1
