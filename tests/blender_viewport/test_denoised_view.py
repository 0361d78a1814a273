# SPDX-License-Identifier: GPL-3.0-or-later
"""The switch that denoises Rendered viewports: what is requested, and what the panel and the corner say."""

from __future__ import annotations

from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon import jobs  # noqa: E402
from blender_addon.viewport import words  # noqa: E402
from spectral_core.render.live.area import Place  # noqa: E402
from spectral_core.render.live.messages import Frame, Shown  # noqa: E402
from tests.blender_viewport.test_look import updated  # noqa: E402

MISSING = "Denoising needs the Python package 'pyoidn'."


def test_a_view_is_denoised_if_its_switch_is_on_and_the_filter_installed(stage, monkeypatch):
    settings = stage.scene.spectral.viewport
    monkeypatch.setattr(jobs, "missing_denoiser", lambda: "")
    updated(stage)
    assert [request.denoise for request in stage.link.requests] == [False], "off by default"
    settings.denoise = True
    updated(stage)
    updated(stage)
    assert [request.denoise for request in stage.link.requests] == [False, True], "another picture, once"
    monkeypatch.setattr(jobs, "missing_denoiser", lambda: MISSING)
    updated(stage)
    assert [request.denoise for request in stage.link.requests] == [False, True, False]


def test_the_switch_is_independent_of_that_of_renders(stage):
    from blender_addon.translate.settings import settings_of

    stage.scene.spectral.viewport.denoise = True
    assert not settings_of(stage.scene).denoise


@pytest.mark.parametrize(("is_on", "missing"), [(True, MISSING), (True, ""), (False, MISSING)])
def test_the_panel_says_how_the_filter_is_installed(stage, monkeypatch, is_on, missing):
    from blender_addon.panels.viewport import SPECTRAL_PT_look

    monkeypatch.setattr(jobs, "missing_denoiser", lambda: missing)
    stage.scene.spectral.viewport.denoise = is_on
    layout = MagicMock()
    here = SimpleNamespace(
        scene=stage.scene, view_layer=bpy.context.view_layer, region=SimpleNamespace(width=10_000),
        preferences=None,
    )  # fmt: skip
    SPECTRAL_PT_look.draw(SimpleNamespace(layout=layout), here)
    drawn = [call.args[1] for call in layout.column().prop.call_args_list if len(call.args) > 1]
    assert "denoise" in drawn
    assert (MISSING in str(layout.mock_calls)) == bool(is_on and missing)


@pytest.mark.parametrize("mode", ["SOLID", "MATERIAL", "RENDERED"])
@pytest.mark.parametrize(("kind", "is_split"), [("SCENE", False), ("SCENE", True), ("LAMP", False)])
def test_the_panel_says_which_mode_shows_a_chosen_light(stage, mode, kind, is_split):
    """In Solid mode a pressed light changed nothing, without a word."""
    from blender_addon.panels.viewport import HIDDEN, SPECTRAL_PT_look

    settings = stage.scene.spectral.viewport
    settings.look.kind, settings.is_split = kind, is_split
    layout = MagicMock()
    space = SimpleNamespace(type="VIEW_3D", shading=SimpleNamespace(type=mode))
    here = SimpleNamespace(
        scene=stage.scene, view_layer=bpy.context.view_layer, region=SimpleNamespace(width=10_000),
        preferences=None, space_data=space,
    )  # fmt: skip
    SPECTRAL_PT_look.draw(SimpleNamespace(layout=layout), here)
    is_chosen = kind != "SCENE" or is_split
    assert (HIDDEN in str(layout.mock_calls)) == (is_chosen and mode != "RENDERED")


def test_the_corner_of_a_denoised_view_says_so():
    def state(*denoised: bool) -> str:
        frames = [Frame("v", 1, Place(0, 1, 1, 1), 1, (0, 0), 8, False, 2.0, 10**8, "", True, 0, (), is_denoised=each,
                        left_s=2.0) for each in denoised]  # fmt: skip
        pictures = [SimpleNamespace(shown=Shown(None, frame), is_current=True) for frame in frames]
        return words(pictures, SimpleNamespace(is_paused=False, samples=16))[0]

    assert state(True) == "Spectral | Sample 8/16, denoised | 2.0 s | 2 s left | 100 MB"
    assert state(False) == "Spectral | Sample 8/16 | 2.0 s | 2 s left | 100 MB"
    assert "denoised" not in state(True, False), "one side of a split view still shows its noise"


def test_the_corner_of_a_split_view_names_the_transport_of_both_sides():
    def kind(*spectral: bool) -> str:
        frames = [
            Frame("v", 1, Place(0, 1, 1, 1), 1, (0, 0), 8, False, 2.0, 10**8, "", each, 0, ()) for each in spectral
        ]
        pictures = [SimpleNamespace(shown=Shown(None, frame), is_current=True) for frame in frames]
        return words(pictures, SimpleNamespace(is_paused=False, samples=16))[0].partition(" | ")[0]

    assert kind(False, True) == "RGB and Spectral"
    assert kind(True, True) == "Spectral"
    assert kind(False) == "RGB"
