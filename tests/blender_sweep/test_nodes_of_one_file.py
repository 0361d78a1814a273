# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of several sweeps of one .blend in one process, as on a worker of dask: each renders its own settings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from tests.blender_sweep.test_nodes_and_runs import HIGH, WATTS, node_of
from tests.blender_sweep.test_sweep_in_blender import scene  # noqa: F401 - a fixture


def test_a_node_renders_no_setting_of_another_sweep_of_its_file(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    """The second sweep had the size of the first one, and the lamp's power at its last point."""
    heights, powers = node_of(tmp_path, HIGH), node_of(tmp_path, WATTS, percentage=50)
    for _ in range(2):
        dim = powers.scene({"watts": 20.0}, 0)
        seen = heights.scene({"high": 2.5}, 0)
        assert (dim.film.width, dim.lights[0].power_w) == (16, pytest.approx(20.0))
        assert (seen.film.width, seen.lights[0].power_w) == (32, pytest.approx(300.0))
        assert seen.camera.world_from_camera[2, 3] == pytest.approx(2.5)
        assert dim.camera.world_from_camera[2, 3] == pytest.approx(3.0)
