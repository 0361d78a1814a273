# SPDX-License-Identifier: GPL-3.0-or-later
"""``spectral-scene render`` where the file's output has a color management of its own."""

from __future__ import annotations

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


def test_render_states_and_keeps_the_color_management_of_the_output(build, tmp_path, capfd):
    """Output ▸ Color Management ▸ Override: the report named the scene's view, and an EXR lost its color space."""
    from blender_addon import compat
    from blender_addon.commands import main

    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 12, 8
    scene.view_settings.view_transform = "Standard"
    build.plane(size=20, material=build.material("Paper", Color=(0.7, 0.3, 0.1, 1)))
    build.light("SUN", np.pi)
    build.camera()
    output = scene.render.image_settings
    compat.set_image_format(output, "OPEN_EXR", color_depth="32")
    plain, other = tmp_path / "plain.blend", tmp_path / "other.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(plain))
    output.color_management, output.linear_colorspace_settings.name = "OVERRIDE", "ACEScg"
    output.view_settings.view_transform = "Raw"
    bpy.ops.wm.save_as_mainfile(filepath=str(other))

    def rendered(file, name):
        assert main(["render", str(file), "--out", str(tmp_path / name), "--samples", "2", "--json"]) == 0
        image = bpy.data.images.load(str(tmp_path / name))
        image.colorspace_settings.name = "Non-Color"
        pixels = np.array(image.pixels).reshape(-1, 4)[:, :3]
        return pixels, json.loads(capfd.readouterr().out.splitlines()[-1])["colors"]

    assert rendered(other, "view.png")[1] == "sRGB through the output's own view transform Raw"
    (linear, _), (aces, stated) = rendered(plain, "linear.exr"), rendered(other, "aces.exr")
    assert stated == "linear, ACEScg, by the output's own color space"
    # the primaries of ACES TB-2014-004 and IEC 61966-2-1, with Bradford's adaptation from D65 to D60
    matrix = np.array([[0.6131, 0.3395, 0.0474], [0.0702, 0.9164, 0.0135], [0.0206, 0.1096, 0.8698]])
    np.testing.assert_allclose(aces, linear @ matrix.T, atol=2e-3 * linear.max())
