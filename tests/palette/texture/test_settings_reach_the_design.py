# SPDX-License-Identifier: GPL-3.0-or-later
"""Each setting of a texture is passed on to the design of its lights, its spectra or its texels."""

from __future__ import annotations

from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spectral_core.palette.texture import project as projects
from spectral_core.palette.texture.project import TextureProject, TextureSettings
from spectral_core.palette.texture.texture import Picture
from spectral_core.spectra.catalogue import illuminant

PICTURES = (Picture("a", np.full((2, 2, 3), 0.2)), Picture("b", np.full((2, 2, 3), 0.4)))
OTHER = {
    "floor": 0.05, "slope": 0.3, "mapping": "uniform_contrast", "spectra": 7, "importance": 2.0,
    "daylight_share": 0.25, "led_width_nm": 33.0,
}  # fmt: skip
NOT_WITH_GIVEN_LIGHTS = {"daylight_share", "led_width_nm"}


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Arguments of the calls of all parts of a design, which compute nothing."""
    made: list[Any] = []

    def record(name: str, answer: Any) -> None:
        def part(*given: Any, **named: Any) -> Any:
            shown = [repr(each) for each in given if isinstance(each, int | float | tuple) and each is not PICTURES]
            made.append((name, shown, {key: repr(value) for key, value in named.items() if key != "progress"}))
            return answer

        monkeypatch.setattr(projects, name, part)

    designed = SimpleNamespace(lights=(illuminant("D65"), illuminant("A")), floor=0.02)
    record("led_range", 0)
    record("design_lights", designed)
    record("reachable_contrast", None)
    record("design_texture", None)
    return made


def test_each_setting_has_another_value() -> None:
    assert set(OTHER) == {each.name for each in fields(TextureSettings)}


@pytest.mark.parametrize("name", OTHER)
@pytest.mark.parametrize("given", [False, True])
def test_each_setting_reaches_the_design(calls: list[Any], tmp_path: Any, name: str, given: bool) -> None:
    lights = (illuminant("D65"), illuminant("HP1")) if given else ()
    plain = TextureProject((tmp_path / "a.png", tmp_path / "b.png"), lights)
    projects.run_project(plain, PICTURES)
    before = list(calls)
    calls.clear()
    projects.run_project(replace(plain, settings=TextureSettings(**{name: OTHER[name]})), PICTURES)
    assert (calls == before) == (given and name in NOT_WITH_GIVEN_LIGHTS)
