# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands on .blend files write over no file that the scene reads."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


@pytest.mark.parametrize(
    ("image", "source", "command", "out"),
    [("scene.png", "FILE", ["render"], []), ("scene_L.png", "FILE", ["render"], []),
     ("sky.exr", "FILE", ["transport"], ["--out", "sky.exr"]),
     ("leaf.1001.png", "TILED", ["render"], ["--out", "leaf.1002.png"]),
     ("walk_0001.png", "SEQUENCE", ["render", "--frame", "3"], ["--out", "walk_0003.png"]),
     ("scene.png", "FILE", ["cost"], ["--plot", "scene.png"])],
)  # fmt: skip
def test_no_image_of_the_scene_is_written_over(build, tmp_path, capfd, monkeypatch, image, source, command, out):
    """``render scene.blend`` wrote scene.png by default, also if that was a texture of the scene."""
    from blender_addon.commands import main

    monkeypatch.chdir(tmp_path)
    names = {"FILE": [image], "TILED": ["leaf.1001.png", "leaf.1002.png"],
             "SEQUENCE": [f"walk_{number:04d}.png" for number in (1, 2, 3)]}[source]  # fmt: skip
    for name in names:
        made = bpy.data.images.new(name, 2, 2, float_buffer=name.endswith(".exr"))
        made.filepath_raw, made.file_format = str(tmp_path / name), "OPEN_EXR" if name.endswith("exr") else "PNG"
        made.save()
        bpy.data.images.remove(made)
    texture = bpy.data.images.load(str(tmp_path / image))
    texture.source = source
    if source == "TILED":
        texture.filepath = str(tmp_path / "leaf.<UDIM>.png")
    texture.use_fake_user = True
    build.camera()
    bpy.context.scene.render.use_multiview = image == "scene_L.png"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    before = {path: path.read_bytes() for path in tmp_path.glob("*.*") if path.suffix in (".png", ".exr")}
    assert len(before) == len(names)
    assert main([*command, "scene.blend", *out]) == 1
    error = capfd.readouterr().err
    assert "is read by this command and would be lost" in error
    assert {path: path.read_bytes() for path in before} == before
