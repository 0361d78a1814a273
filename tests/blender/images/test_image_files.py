# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of several files: tiles of a UDIM set at their coordinates, and the present frame of a sequence."""

from __future__ import annotations

import struct
import zlib
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def saved(path, color):
    made = bpy.data.images.new("saved", 4, 4)
    made.pixels.foreach_set(np.tile(np.array([*color, 1.0], np.float32), 16))
    made.filepath_raw, made.file_format = str(path), "PNG"
    made.save()
    bpy.data.images.remove(made)


def textured(build, image):
    """A material that emits an image."""
    material = build.material(shader="ShaderNodeEmission")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    image.colorspace_settings.name = "Non-Color"
    material.node_tree.links.new(node.outputs["Color"], material.node_tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    return node


def colors(scene, *places):
    program = scene.materials[0].surface.color.program
    u, v = np.array(places, dtype=float).T
    return program.evaluate(lambda name, shift: (u, v, 0 * u))


def test_tiles_are_at_their_coordinates(build, translate, tmp_path):
    shown = {1001: (0.2, 0.4, 0.6), 1002: (0.8, 0.2, 0.0), 1011: (0.0, 0.6, 0.2)}
    for number, color in shown.items():
        saved(tmp_path / f"tile.{number}.png", color)
    image = bpy.data.images.load(str(tmp_path / "tile.1001.png"))
    image.source, image.filepath = "TILED", str(tmp_path / "tile.<UDIM>.png")
    for number in (1002, 1011, 1023):
        image.tiles.new(number)
    textured(build, image)
    before = len(bpy.data.images)
    scene = translate()
    assert len(bpy.data.images) == before, "the images of the tiles are gone again"
    found = colors(scene, (0.4, 0.5), (1.7, 0.1), (0.5, 1.5), (2.5, 0.5), (2.2, 2.2), (-1.5, 0.5), (10.5, 0.5))
    magenta = (1, 0, 1)  # the color that Cycles shows outside of all tiles
    expected = [*shown.values(), magenta, magenta, magenta, magenta]
    np.testing.assert_allclose(found, expected, atol=1 / 255)
    assert [note.message for note in scene.notes] == ["tile 1023 of this UDIM image could not be read; it is magenta"]


def test_a_sequence_shows_the_file_of_the_present_frame(build, translate, tmp_path):
    for number in (1, 2, 3):
        saved(tmp_path / f"walk_{number:04d}.png", (number / 5, 0, 0))
    image = bpy.data.images.load(str(tmp_path / "walk_0001.png"))
    image.source = "SEQUENCE"
    user = textured(build, image).image_user
    user.frame_duration = 3
    for frame, number in ((1, 1), (2, 2), (3, 3), (40, 3)):
        bpy.context.scene.frame_set(frame)
        scene = translate()
        np.testing.assert_allclose(colors(scene, (0.5, 0.5))[0][0], number / 5, atol=1 / 255)
        assert scene.notes == ()
    user.frame_offset = 7
    assert "walk_0001.png, file 10" in translate().notes[0].message


@pytest.mark.parametrize(
    ("frame", "settings", "file"),
    [(5, {}, 5), (5, {"frame_start": 3}, 3), (12, {"use_cyclic": True}, 2), (10, {"use_cyclic": True}, 10),
     (0, {"use_cyclic": True}, 10), (-3, {}, 0), (99, {"frame_offset": 4}, 14)],
)  # fmt: skip
def test_frame_numbers_follow_blender(frame, settings, file):
    from blender_addon.translate.shading.image_files import frame_of

    usual = {"frame_duration": 10, "frame_start": 1, "frame_offset": 0, "use_cyclic": False}
    assert frame_of(SimpleNamespace(**(usual | settings)), frame) == file


@pytest.mark.parametrize("path", ["", "/nowhere/lost.png", None])
def test_a_missing_picture_is_magenta_with_a_note(build, translate, path):
    """As Cycles shows it, whether the file or the image is missing; its alpha is 1."""
    image = bpy.data.images.new("lost", 4, 4)
    if path is not None:
        image.source, image.filepath = "FILE", path
    node = textured(build, image)
    if path is None:
        node.image = None
    scene = translate()
    np.testing.assert_array_equal(scene.materials[0].surface.color.linear_rgb, (1, 0, 1))
    assert [note.message.endswith("it is magenta, as in Cycles") for note in scene.notes] == [True]
    tree = bpy.data.materials[0].node_tree
    tree.links.new(node.outputs["Alpha"], tree.nodes["shader"].inputs["Color"])
    np.testing.assert_array_equal(translate().materials[0].surface.color.linear_rgb, (1, 1, 1))


def test_floats_of_a_file_are_as_in_the_file_in_every_mode_of_alpha(build, translate, tmp_path):
    """Blender multiplies them by alpha when they count as straight; Cycles reads the file itself."""
    made = bpy.data.images.new("saved", 4, 4, alpha=True, float_buffer=True)
    made.pixels.foreach_set(np.tile(np.array([0.4, 0.2, 1.5, 0.5], np.float32), 16))
    made.filepath_raw, made.file_format = str(tmp_path / "half.exr"), "OPEN_EXR"
    made.save()
    image = bpy.data.images.load(str(tmp_path / "half.exr"))
    textured(build, image)
    image.colorspace_settings.name = "Linear Rec.709"
    found, buffers = [], []
    for mode in ("CHANNEL_PACKED", "PREMUL", "STRAIGHT"):
        image.alpha_mode = mode
        scene = translate()
        found.append(colors(scene, (0.4, 0.5)))
        buffers.append(image.pixels[0])
        assert scene.notes == ()
    np.testing.assert_allclose(found, np.broadcast_to(found[0], np.shape(found)), rtol=2e-3)
    assert buffers[2] == pytest.approx(0.5 * buffers[1], rel=2e-3)  # what there is to be undone


@pytest.mark.parametrize(("setting", "value"), [("interpolation", "Closest"), ("extension", "EXTEND"),
                                               ("projection", "SPHERE"), ("projection", "BOX")])  # fmt: skip
def test_the_settings_of_a_node_count_for_the_tiles_of_its_image(build, translate, tmp_path, setting, value):
    from tests.settings_walk import fingerprint

    for number in (1001, 1002):
        saved(tmp_path / f"tile.{number}.png", (number / 2000, 0.4, 0.6))
    image = bpy.data.images.load(str(tmp_path / "tile.1001.png"))
    image.source, image.filepath = "TILED", str(tmp_path / "tile.<UDIM>.png")
    image.tiles.new(1002)
    node = textured(build, image)
    before = fingerprint(translate().materials)
    setattr(node, setting, value)
    assert fingerprint(translate().materials) != before


def test_digits_of_the_extension_are_no_frame(monkeypatch):
    from blender_addon.translate.shading import image_files

    monkeypatch.setattr(image_files, "_loaded", lambda like, path: nullcontext(path))
    image = SimpleNamespace(filepath="/shots/v2/take3_07.jp2", library=None, source="SEQUENCE")
    with image_files.frame_image(image, 12) as found:
        assert found == "/shots/v2/take3_12.jp2"


def test_a_muted_link_of_the_alpha_does_not_count(build, translate):
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = build.image("Half", np.full((4, 4, 4), 0.5), color_space="sRGB")
    tree.links.new(node.outputs["Color"], tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    link = tree.links.new(node.outputs["Alpha"], tree.nodes["shader"].inputs["Strength"])
    apart = np.ravel(colors(translate(), (0.5, 0.5)))[0]
    link.is_muted = True
    muted = np.ravel(colors(translate(), (0.5, 0.5)))[0]
    tree.links.remove(link)
    np.testing.assert_allclose(muted, np.ravel(colors(translate(), (0.5, 0.5)))[0])
    assert muted < 0.3 * apart  # multiplied by alpha, as without a link


@pytest.mark.parametrize("mode", ["STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"])
def test_floats_in_srgb_are_decoded_after_filtering_as_in_cycles(build, translate, tmp_path, mode):
    """Halfway between two pixels is the mean of the file's numbers, with the curve of sRGB undone."""
    openexr = pytest.importorskip("OpenEXR")
    numbers = np.random.default_rng(5).uniform(0.05, 0.95, (4, 4, 4)).astype(np.float32)
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    openexr.File(header, {"RGBA": numbers}).write(str(tmp_path / "colors.exr"))
    image = bpy.data.images.load(str(tmp_path / "colors.exr"))
    textured(build, image)
    image.colorspace_settings.name, image.alpha_mode = "sRGB", mode
    mean = (numbers[2, 1, :3] + numbers[2, 2, :3]) / 2  # row 0 of the file is at the top
    wanted = ((mean + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(np.ravel(colors(translate(), (0.5, 0.375))), wanted, rtol=5e-3)


def png_of_16_bits(path, numbers):
    """A file of ``numbers`` (height, width, 4) in [0, 1], row 0 at the bottom."""
    height, width = numbers.shape[:2]
    rows = np.rint(numbers[::-1] * 65535).astype(">u2").reshape(height, -1)
    parts = {b"IHDR": struct.pack(">2I5B", width, height, 16, 6, 0, 0, 0),
             b"IDAT": zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows)), b"IEND": b""}  # fmt: skip
    chunks = [struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in parts.items()]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


@pytest.mark.parametrize("reads_alpha", [False, True])
@pytest.mark.parametrize("mode", ["STRAIGHT", "PREMUL"])
@pytest.mark.parametrize("space", ["sRGB", "Linear Rec.709"])
def test_a_png_of_16_bits_is_multiplied_by_its_alpha_as_cycles_does(
    build, translate, tmp_path, space, mode, reads_alpha
):
    numbers = np.random.default_rng(3).uniform(0.2, 0.9, (4, 4, 4))
    numbers[..., :3] *= numbers[..., 3:]  # so that colors that count as multiplied are not above alpha
    png_of_16_bits(tmp_path / "leaf.png", numbers)
    image = bpy.data.images.load(str(tmp_path / "leaf.png"))
    node = textured(build, image)
    image.colorspace_settings.name, image.alpha_mode = space, mode
    if reads_alpha:
        tree = node.id_data
        tree.links.new(node.outputs["Alpha"], tree.nodes["shader"].inputs["Strength"])
    stored = numbers[..., :3] * numbers[..., 3:]
    mean = (stored[1, 1] + stored[1, 2]) / 2
    alpha = (numbers[1, 1, 3] + numbers[1, 2, 3]) / 2
    seen = mean / alpha if reads_alpha else mean
    wanted = (np.where(seen > 0.04045, ((seen + 0.055) / 1.055) ** 2.4, seen / 12.92)) if space == "sRGB" else seen
    found = np.ravel(colors(translate(), (0.5, 0.375)))[:3]
    np.testing.assert_allclose(found, wanted, rtol=5e-3)


def test_bytes_of_wide_spaces_keep_the_colors_that_no_display_shows(build, translate, tmp_path):
    """They were cut to [0, 1], and multiplied by alpha before they were made linear."""
    made = bpy.data.images.new("saved", 4, 4, alpha=True)
    made.pixels.foreach_set(np.tile(np.array([0, 1, 0.2, 0.4], np.float32), 16))
    made.filepath_raw, made.file_format = str(tmp_path / "green.png"), "PNG"
    made.save()
    image = bpy.data.images.load(str(tmp_path / "green.png"))
    textured(build, image)
    image.colorspace_settings.name = "Linear Rec.2020"
    srgb_of_rec2020 = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]]
    wanted = 0.4 * np.array(srgb_of_rec2020) @ (0, 1, 0.2)  # BT.2087
    scene = translate()
    np.testing.assert_allclose(np.ravel(colors(scene, (0.5, 0.5)))[:3], wanted, atol=2e-3)
    assert scene.notes == ()


@pytest.mark.parametrize("goes", ["to a node that nothing reads", "to a shader that a factor of 0 leaves out"])
def test_an_alpha_that_nothing_shows_does_not_count(build, translate, goes):
    """Cycles leaves such nodes out, so that the color is multiplied by alpha, as without the link."""
    node = textured(build, build.image("Half", np.full((4, 4, 4), 0.5), color_space="sRGB"))
    node.image.colorspace_settings.name, tree = "sRGB", node.id_data
    alone = np.ravel(colors(translate(), (0.5, 0.5)))
    other = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(node.outputs["Alpha"], other.inputs["Strength"])
    if "factor" in goes:
        mix = tree.nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = 0.0
        tree.links.new(tree.nodes["shader"].outputs[0], mix.inputs[1])
        tree.links.new(other.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Surface"])
    np.testing.assert_array_equal(np.ravel(colors(translate(), (0.5, 0.5))), alone)


def test_paint_that_is_not_saved_has_a_note(build, translate, tmp_path):
    """Cycles reads the file then, except if the image is packed."""
    saved(tmp_path / "wall.png", (0.2, 0.4, 0.6))
    image = bpy.data.images.load(str(tmp_path / "wall.png"))
    textured(build, image)
    assert not translate().notes
    image.pixels.foreach_set(np.tile(np.array([0.8, 0.2, 0.0, 1.0], np.float32), 16))
    image.update()
    scene = translate()
    np.testing.assert_allclose(colors(scene, (0.5, 0.5)), [(0.8, 0.2, 0.0)], atol=1 / 255)
    assert [(note.subject, note.message) for note in scene.notes] == [
        ("wall.png", "it shows what was painted and not saved; a final render of Cycles reads the file")
    ]
    image.pack()
    assert not translate().notes


def luminance_of(signal, space):
    """cd/m² of a gray signal by ITU-R BT.2100, of HLG on a screen of 1000 cd/m²."""
    if space == "Rec.2100-HLG":
        light = signal**2 / 3 if signal <= 0.5 else (np.exp((signal - 0.55991073) / 0.17883277) + 0.28466892) / 12
        return 1000 * light**1.2
    root = signal ** (32 / 2523)
    return 10000 * (max(root - 3424 / 4096, 0) / (2413 / 128 - 2392 / 128 * root)) ** (16384 / 2610)


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="Blender has these color spaces from 5.0 on")
@pytest.mark.parametrize("space", ["Rec.2100-HLG", "Rec.2100-PQ"])
@pytest.mark.parametrize("kind", ["PNG", "OPEN_EXR"])
def test_images_of_video_are_as_bright_as_in_cycles(build, translate, tmp_path, kind, space):
    """There 100 cd/m² are 1; Blender itself places 203 there. Floats of a packed file are Blender's in Cycles too."""
    made = bpy.data.images.new("saved", 4, 4, float_buffer=kind == "OPEN_EXR")
    made.colorspace_settings.name = "Non-Color"
    made.pixels.foreach_set(np.tile(np.array([0.6, 0.6, 0.6, 1.0], np.float32), 16))
    made.filepath_raw, made.file_format = str(tmp_path / "video"), kind
    made.save()
    image = bpy.data.images.load(str(tmp_path / "video"))
    textured(build, image)
    image.colorspace_settings.name = space
    scene = translate()
    found = colors(scene, (0.5, 0.5))[0]
    np.testing.assert_allclose(found, luminance_of(0.6, space) / 100, rtol=5e-3)
    image.pack()
    packed = colors(translate(), (0.5, 0.5))[0]
    np.testing.assert_allclose(packed, found / (2.03 if kind == "OPEN_EXR" else 1.0), rtol=1e-5)
    assert scene.notes == ()
