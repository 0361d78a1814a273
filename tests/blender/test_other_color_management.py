# SPDX-License-Identifier: GPL-3.0-or-later
"""With a configuration of OpenColorIO that ``$OCIO`` names, as studios have, whose color spaces have other names."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

ROOT = Path(__file__).parents[2]
ACES = "ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1"
"""A configuration that OpenColorIO itself contains; its scene-linear space is ACEScg."""


def displayed(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)


def test_pictures_and_views_are_right_in_another_configuration(tmp_path):
    """The names that Blender's own configuration has, such as Non-Color, are not there; they ended F12 and the dial."""
    environment = {**os.environ, "OCIO": ACES, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-P", str(ROOT / "tests/blender/other_colors.py"), str(tmp_path)]
    made = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stderr
    found = json.loads(made.stdout.split("FOUND")[1].splitlines()[0])
    shares = np.array((200, 100, 50)) / 255
    linear = ((shares + 0.055) / 1.055) ** 2.4
    (color, space), (numbers, _) = found["color"], found["numbers"]
    assert space == "ACEScg"
    np.testing.assert_allclose(color, linear, atol=2e-3)
    np.testing.assert_allclose(numbers, shares, atol=1e-6)
    shown = displayed(np.array([[0.0], [0.18], [0.5], [1.0]]))
    np.testing.assert_allclose(found["shown"], shown * np.ones(3), atol=2e-3)
    assert found["dial"] == "Linear Rec.709 (sRGB)"


def test_a_scene_linear_space_of_another_name_is_measured(monkeypatch):
    """Blender knows how its colors become linear sRGB, whatever the configuration calls their space."""
    from blender_addon import compat

    np.testing.assert_array_equal(compat.rec709_from_working("My Space"), np.eye(3))
    to_rec709 = compat.rec709_from_working("ACEScg")

    class OfAces(tuple):
        def from_scene_linear_to_rec709_linear(self):
            return to_rec709 @ np.array(self)

    monkeypatch.setattr(compat, "Color", OfAces)
    np.testing.assert_array_equal(compat.rec709_from_working("My Space"), to_rec709)
    before_5_0 = object()
    assert compat.working_space(before_5_0) == "ACEScg"
    to_rec709 = np.diag((1.5, 0.9, 0.7))
    assert compat.working_space(before_5_0) == "scene_linear"
    np.testing.assert_allclose(compat.rec709_from_working("scene_linear"), to_rec709)
