# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep of a changed .blend is another one, also if the change does not show at the start of the ranges."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from spectral_core.explore.sweep.effects import places  # noqa: E402
from spectral_core.explore.sweep.parameters import Parameter, Space  # noqa: E402
from tests.blender_sweep.test_sweep_in_blender import KEY, scene  # noqa: E402, F401 - a fixture
from tests.blender_sweep.test_swept_settings import node_of  # noqa: E402

HIDDEN = Parameter("hidden", kind="choice", choices=("on", "off"), path='bpy.data.objects["Plane"].hide_render')
WATTS = Parameter("watts", 0, 100, path=KEY)


def redden() -> None:
    bpy.data.lights["Key"].color = (1.0, 0.1, 0.1)


def roughen() -> None:
    bpy.data.materials["Metal"].node_tree.nodes["Glossy"].inputs["Roughness"].default_value = 0.9


@pytest.mark.parametrize(("swept", "change"), [((WATTS,), redden), ((HIDDEN,), roughen), ((HIDDEN, WATTS), redden)])
def test_changes_of_what_is_dark_or_hidden_at_the_start_are_noticed(
    scene: Any, tmp_path: Any, swept: tuple[Parameter, ...], change: Any  # noqa: F811
) -> None:  # fmt: skip
    """The rows of both scenes stood in one table: at 0 W a lamp has no color, and a hidden object no material."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    before = node_of(tmp_path, *swept).fingerprint
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    change()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert node_of(tmp_path, *swept).fingerprint != before


def test_an_applied_point_is_no_change(scene: Any, tmp_path: Any) -> None:  # noqa: F811
    found = []
    for watts in (300.0, 7.0):
        bpy.data.lights["Key"].energy = watts
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
        found.append(node_of(tmp_path, WATTS, HIDDEN).fingerprint)
    assert found[0] == found[1]


def test_a_sweep_is_looked_at_with_each_choice_while_others_have_an_effect() -> None:
    found = places(Space((HIDDEN, WATTS)))
    assert {"hidden": "on", "watts": 0.0} in found and {"hidden": "off", "watts": 63.0} in found
    assert len(found) == len({tuple(point.items()) for point in found}) == 4
