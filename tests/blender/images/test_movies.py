# SPDX-License-Identifier: GPL-3.0-or-later
"""Movies as textures show the picture of the scene's frame."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender.images.test_image_files import colors, textured  # noqa: E402

PICTURES = 4


@pytest.fixture(scope="module")
def movie(tmp_path_factory):
    """The path of a movie whose k-th picture has a red of k/5."""
    path = tmp_path_factory.mktemp("movie") / "red.mp4"
    scene = bpy.data.scenes.new("Movie")
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    for number in range(1, PICTURES + 1):
        has_length = "length" in strips.bl_rna.functions["new_effect"].parameters  # from Blender 5.0 on
        length = {"length": 1} if has_length else {"frame_end": number + 1}
        strip = strips.new_effect(name=f"red {number}", type="COLOR", channel=1, frame_start=number, **length)
        strip.color = (number / 5, 0.0, 0.0)
    render, output = scene.render, scene.render.image_settings
    scene.frame_start, scene.frame_end = 1, PICTURES
    render.resolution_x = render.resolution_y = 32
    render.resolution_percentage, render.use_sequencer = 100, True
    scene.view_settings.view_transform = "Standard"
    if hasattr(output, "media_type"):
        output.media_type = "VIDEO"
    output.file_format = "FFMPEG"
    render.ffmpeg.format, render.ffmpeg.codec, render.ffmpeg.gopsize = "MPEG4", "H264", 1
    render.ffmpeg.constant_rate_factor = "PERC_LOSSLESS"
    render.filepath, render.use_file_extension = str(path), False
    bpy.ops.render.render(animation=True, scene=scene.name)
    bpy.data.scenes.remove(scene)
    return path


def test_a_movie_shows_the_picture_of_the_present_frame(build, translate, movie):
    """Cycles shows the first and last picture beyond the ends; each node has its own offset."""
    image = bpy.data.images.load(str(movie))
    assert image.source == "MOVIE"
    node = textured(build, image)
    node.image_user.frame_duration = PICTURES
    before = len(bpy.data.images), len(bpy.data.textures)
    for frame, offset, number in ((1, 0, 1), (3, 0, 3), (2, 0, 2), (2, 2, 4), (-5, 0, 1), (40, 9, PICTURES)):
        bpy.context.scene.frame_set(frame)
        node.image_user.frame_offset = offset
        scene = translate()
        np.testing.assert_allclose(colors(scene, (0.5, 0.5))[0], (number / 5, 0, 0), atol=3 / 255)
        assert scene.notes == ()
    assert (len(bpy.data.images), len(bpy.data.textures)) == before, "what reads a picture is gone again"


def test_a_movie_that_nothing_has_read_so_far_has_its_color_space(build, translate, movie):
    """Blender finds it when it reads the file; until then the image has none."""
    image = bpy.data.images.load(str(movie))
    material = build.material(shader="ShaderNodeEmission")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs["Color"], material.node_tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    bpy.context.scene.frame_set(1)
    linear = ((1 / 5 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(colors(translate(), (0.5, 0.5))[0], (linear, 0, 0), atol=0.004)
