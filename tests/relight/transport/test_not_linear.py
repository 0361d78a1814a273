# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes whose pictures are no sums of their lights' shares: clamped samples and shadow catchers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.explore.sweep.compute import rendering
from spectral_core.render import render_scene
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.storage import MixtureStorage, Storage
from spectral_core.render.relight.transport import record_transport
from spectral_core.scene import Color, Film, LightPaths, Note, PointLight, RenderSettings, Scene, World, gray
from tests.render.scenes import lit_plane, looking_down, matrix


def _lamp(name: str, x: float, watts: float) -> PointLight:
    return PointLight(name=name, world_from_light=matrix((x, 0, 3)), power_w=watts, group=name)


def _clamped(direct: float, indirect: float = 0.0, left: float = 100.0) -> Scene:
    """A gray table, far brighter than the clamp, under two lamps."""
    settings = RenderSettings(transport="rgb", light_paths=LightPaths(clamp_direct=direct, clamp_indirect=indirect))
    lights = (_lamp("Left", -0.5, left), _lamp("Right", 0.5, 100.0))
    return lit_plane(*lights, film=Film(4, 4, samples=64, seed=1), camera=looking_down(4, 0.1), settings=settings)


def test_a_recording_of_clamped_samples_notes_that_its_mixtures_are_no_renders() -> None:
    scene = _clamped(0.05)
    transport = record_transport(scene, MixtureStorage())
    notes = [note for note in transport.notes if "clamped as under the recorded light" in note.message]
    assert [note.subject for note in notes] == ["Light Paths"]
    as_recorded = relight(transport)
    np.testing.assert_allclose(as_recorded, render_scene(scene).pixels, rtol=1e-5)
    brighter = relight(transport, mix={"Left": 4.0})[..., :3].mean()
    rendered = render_scene(_clamped(0.05, left=400.0)).pixels[..., :3].mean()
    assert brighter > 2 * rendered  # what the note is about: the render stays at the clamp


@pytest.mark.parametrize("limits", [(0.0, 0.0), (0.0, 10.0)])
def test_a_recording_without_a_clamp_has_no_note(limits: tuple[float, float]) -> None:
    """Cycles' usual limit of 10 for indirect light removes fireflies only."""
    transport = record_transport(_clamped(*limits), MixtureStorage())
    assert not any("clamped" in note.message for note in transport.notes)


@pytest.mark.parametrize(("transport", "is_noted"), [(None, True), ("rgb", True), ("spectral", False)])
def test_a_spectral_recording_of_a_scene_that_renders_in_rgb_is_noted(transport: str | None, is_noted: bool) -> None:
    """A blue table under an orange lamp is dark in RGB, and darker or brighter by a third in a spectral recording."""
    settings = RenderSettings(transport=transport)  # type: ignore[arg-type]
    orange = replace(_lamp("Key", 0.0, 60.0), color=Color((1.0, 0.5, 0.1)))
    scene = lit_plane(orange, film=Film(4, 4, samples=16, seed=1), camera=looking_down(4, 0.1), settings=settings)
    noted = ["a render of this scene red, green and blue" in note.message for note in _notes(scene, BandStorage(31))]
    assert any(noted) == is_noted
    assert not any("red, green and blue" in note.message for note in _notes(scene, MixtureStorage()))


def _notes(scene: Scene, storage: Storage) -> tuple[Note, ...]:
    return record_transport(scene, storage).notes


def test_a_point_without_light_is_black() -> None:
    """A lamp without power is not in a scene of Blender's: such a point was set aside, because nothing is recorded."""
    dark = lit_plane(film=Film(4, 3, samples=1), camera=looking_down(4, 0.1), settings=RenderSettings(transport="rgb"))
    found = rendering.Relighter().picture(dark)
    assert found.pictures[""].shape == (3, 4, 4) and not found.pictures[""][..., :3].any()
    assert found.values["mean_green"] == 0.0


def test_points_of_a_scene_with_a_shadow_catcher_are_rendered() -> None:
    """Re-lit pictures had neither the shadow nor the background: the catcher was black."""
    scene = lit_plane(_lamp("Key", 0.0, 60.0), world=World(gray(0.25)), film=Film(6, 6, samples=32, seed=4))
    catcher = replace(scene, instances=tuple(replace(each, is_shadow_catcher=True) for each in scene.instances))
    assert rendering.not_linear(scene) == "" and "shadow catchers" in rendering.not_linear(catcher)
    found = rendering.Relighter().picture(catcher).pictures[""]
    expected: Any = render_scene(catcher).pixels[::-1]
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_allclose(found[..., :3], 0.25, rtol=0.05)  # the world behind a catcher without shadows
