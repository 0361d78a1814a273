# SPDX-License-Identifier: GPL-3.0-or-later
"""Alpha of image files as Cycles reads them: WebP counts as multiplied by it, gray files with alpha are not multiplied,
and gray files without have 1 beside them too.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def shown(build, translate, path, kind, mode, *, packed=False, is_alpha=False):
    """What a material shows of a file of one color of alpha 0.5 in its middle and beside it."""
    made = bpy.data.images.new("made", 4, 4, alpha=True)
    made.pixels.foreach_set(np.tile(np.array([0.8, 0.4, 0.2, 0.5], np.float32), 16))
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_mode, settings.quality = kind, mode, 100
    bpy.context.scene.view_settings.view_transform = "Standard"
    made.save_render(str(path))
    return of_file(build, translate, path, packed=packed, is_alpha=is_alpha)


def of_file(build, translate, path, mode="STRAIGHT", *, packed=False, is_alpha=False, space="sRGB"):
    """What a material shows of a file in its middle and beside it."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name, image.alpha_mode = space, mode
    if packed:
        image.pack()
    material = build.material(shader="ShaderNodeEmission")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node.extension = image, "CLIP"
    material.node_tree.links.new(
        node.outputs["Alpha" if is_alpha else "Color"], material.node_tree.nodes["shader"].inputs["Color"]
    )
    build.plane(material=material)
    paint = translate().materials[0].surface.color
    if not hasattr(paint, "program"):
        return np.broadcast_to(paint.linear_rgb, (2, 3))
    u, v = np.array([(0.5, 0.5), (1.5, 0.5)]).T
    return np.broadcast_to(paint.program.evaluate(lambda name, shift: (u, v, 0 * u)), (2, 3))


@pytest.mark.parametrize(
    ("kind", "packed", "red"), [("WEBP", False, 0.604), ("WEBP", True, 0.133), ("PNG", False, 0.133)]
)
def test_colors_of_webp_files_are_not_multiplied_by_alpha_again(build, translate, tmp_path, kind, packed, red):
    """Cycles shows 0.604 of a WebP file, the linear value of 0.8, and multiplies the same pixels if they are packed."""
    found = shown(build, translate, tmp_path / "picture", kind, "RGBA", packed=packed)
    assert found[0, 0] == pytest.approx(red, abs=0.01)
    assert np.all(found[1] == 0)


@pytest.mark.parametrize(("mode", "beside"), [("BW", 1.0), ("RGB", 0.0)])
def test_the_alpha_beside_a_gray_file_is_1(build, translate, tmp_path, mode, beside):
    found = shown(build, translate, tmp_path / "picture", "PNG", mode, is_alpha=True)
    assert np.all(found[0] == 1) and np.all(found[1] == beside)


def gray_png(path, depth, *, has_alpha=True):
    """Write a PNG of 4×4 texels of gray 0.8, with alpha 0.5, in 8 or 16 bits."""
    most = 2**depth - 1
    texel = np.array([0.8 * most + 0.5, 0.5 * most + 0.5][: 1 + has_alpha]).astype(f">u{depth // 8}")
    row = b"\0" + np.tile(texel, 4).tobytes()
    parts = (
        (b"IHDR", struct.pack(">IIBBBBB", 4, 4, depth, 4 if has_alpha else 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(4 * row)),
        (b"IEND", b""),
    )
    chunks = (struct.pack(">I", len(b)) + a + b + struct.pack(">I", zlib.crc32(a + b)) for a, b in parts)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


@pytest.mark.parametrize("depth", [8, 16])
@pytest.mark.parametrize(("mode", "red"), [("STRAIGHT", 0.604), ("CHANNEL_PACKED", 0.604)])
def test_colors_of_gray_png_files_are_not_multiplied_by_alpha(build, translate, tmp_path, depth, mode, red):
    """Cycles multiplies four channels only: it shows 0.604, the linear value of 0.8, in 4.3, 5.0 and 5.2."""
    gray_png(tmp_path / "gray.png", depth)
    found = of_file(build, translate, tmp_path / "gray.png", mode)
    assert found[0] == pytest.approx([red] * 3, abs=0.01)


@pytest.mark.parametrize("depth", [8, 16])
def test_a_gray_file_stays_gray_in_spaces_that_color_grays(build, translate, tmp_path, depth):
    """Cycles keeps one channel, the mean of red, green and blue: of XYZ = (0.8, 0.8, 0.8) it shows 0.816."""
    gray_png(tmp_path / "gray.png", depth, has_alpha=False)
    found = of_file(build, translate, tmp_path / "gray.png", space="Linear CIE-XYZ D65")
    from_xyz = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
    assert found[0] == pytest.approx([0.8 * from_xyz.sum() / 3] * 3, abs=0.003)
