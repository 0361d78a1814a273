# SPDX-License-Identifier: GPL-3.0-or-later
"""F12: positions of pixels, errors that the user sees, cancel, and the record of a render."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import RenderCancelled

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


@pytest.fixture
def f12(build, tmp_path):
    """Render the scene to an EXR and read it: (height, width, 4), row 0 at the bottom."""
    from blender_addon import compat, jobs

    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.render.resolution_x, scene.render.resolution_y = 24, 16
    scene.spectral.render.samples = 4
    jobs.records.clear()

    def run():
        if scene.camera is None:
            build.camera(type="ORTHO", ortho_scale=3.0)
        scene.render.filepath = str(tmp_path / "frame.exr")
        compat.set_image_format(scene.render.image_settings, "OPEN_EXR", color_depth="32", color_mode="RGBA")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath, check_existing=False)
        pixels = np.array(image.pixels[:], dtype=np.float32).reshape(*reversed(image.size[:]), 4)
        bpy.data.images.remove(image)
        return pixels

    return run


def glowing(build, color=(0.5, 0.25, 0.125)):
    return build.material("Glow", "ShaderNodeEmission", Color=(*color, 1.0), Strength=1.0)


def test_pixels_have_the_positions_that_blender_expects(build, f12):
    build.mesh("Corner", [(-2, 0.5, 0), (0, 0.5, 0), (0, 2, 0), (-2, 2, 0)], [(0, 1, 2, 3)], glowing(build))
    pixels = f12()
    assert pixels.shape == (16, 24, 4)
    np.testing.assert_allclose(pixels[13:, :11, :3], np.broadcast_to((0.5, 0.25, 0.125), (3, 11, 3)), rtol=1e-3)
    assert not pixels[:11, :, :3].any() and not pixels[:, 13:, :3].any() and np.all(pixels[..., 3] == 1)


def test_the_record_states_the_outcome_of_the_render(build, f12):
    from blender_addon import jobs

    build.plane(material=glowing(build))
    f12()
    assert [(entry.status, entry.samples, entry.frame) for entry in jobs.records] == [("done", 4, 1)]
    assert jobs.records[0].result.pixels.shape == (16, 24, 4) and jobs.failures() == []


def test_transparent_film(build, f12):
    bpy.context.scene.render.film_transparent = True
    build.mesh("Left", [(-2, -2, 0), (0, -2, 0), (0, 2, 0), (-2, 2, 0)], [(0, 1, 2, 3)], build.material())
    alpha = f12()[..., 3]
    assert np.all(alpha[:, :11] == 1) and not alpha[:, 13:].any()


@pytest.mark.parametrize("crops", [False, True])
def test_a_render_border_shows_the_same_part_of_the_picture(build, f12, crops):
    build.mesh("Slope", [(-2, -2, 0), (2, -2, 0), (2, 1, 0), (-2, 0, 0)], [(0, 1, 2, 3)], glowing(build))
    bpy.context.scene.render.filter_size = 0.01  # narrow, so that edges do not depend on random numbers
    whole = f12()
    render = bpy.context.scene.render
    render.use_border, render.use_crop_to_border = True, crops
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.5, 1.0
    part = f12()
    assert part.shape == ((8, 12, 4) if crops else (16, 24, 4))
    inside = part if crops else part[8:, 6:18]
    assert np.abs(inside[..., :3] - whole[8:, 6:18, :3]).mean() < 0.02
    if not crops:
        assert not part[:8].any()


def test_every_view_layer_gets_its_own_picture(build, f12):
    from blender_addon import jobs

    build.plane(material=glowing(build))
    bpy.context.scene.view_layers.new("Second")
    f12()
    assert [entry.view_layer for entry in jobs.records] == ["ViewLayer", "Second"]


def test_both_eyes_of_a_stereo_render_show_their_views(build, f12, tmp_path):
    """The left eye is the camera; the right eye sees a post moved as the convergence distance of 1.95 requires."""
    build.mesh("Post", [(-0.1, -2, 0), (0.1, -2, 0), (0.1, 2, 0), (-0.1, 2, 0)], [(0, 1, 2, 3)], glowing(build))
    camera = build.camera((0, 0, 4))
    camera.data.stereo.interocular_distance = 0.8
    scene = bpy.context.scene
    scene.render.use_multiview, scene.render.resolution_x = True, 48
    with pytest.raises(RuntimeError, match="frame.exr"):
        f12()  # Blender writes a file per eye instead
    centers = []
    for eye in "LR":
        image = bpy.data.images.load(str(tmp_path / f"frame_{eye}.exr"))
        row = np.array(image.pixels[:]).reshape(16, 48, 4)[8, :, 0]
        centers.append((row * np.arange(48)).sum() / row.sum())
    lens, eyes_apart, distance, crossed = 50 / 36, 0.8, 4.0, camera.data.stereo.convergence_distance
    moved = 48 * lens * eyes_apart * (1 / crossed - 1 / distance)
    np.testing.assert_allclose(centers, [23.5, 23.5 + moved], atol=0.2)


def test_a_view_layer_can_override_all_materials(build, f12):
    build.plane(size=9, material=glowing(build))
    bpy.context.view_layer.material_override = glowing(build, (0.25, 1.0, 0.5))
    np.testing.assert_allclose(f12()[8, 12, :3], (0.25, 1.0, 0.5), rtol=1e-3)


def test_animation_renders_each_frame(build, f12, tmp_path):
    from blender_addon import jobs

    plane = build.plane(material=glowing(build))
    for frame, place in ((1, 0.0), (3, 9.0)):
        plane.location.x = place
        plane.keyframe_insert("location", frame=frame)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 3
    f12()
    jobs.records.clear()
    scene.render.filepath = str(tmp_path / "walk_")
    bpy.ops.render.render(animation=True)
    assert [entry.frame for entry in jobs.records] == [1, 2, 3]
    assert sorted(path.name for path in tmp_path.glob("walk_*")) == [f"walk_{n:04d}.exr" for n in (1, 2, 3)]


def test_an_error_reaches_the_user_and_the_next_render_works(build, f12):
    from blender_addon import jobs

    build.plane(material=glowing(build))
    f12()
    settings = bpy.context.scene.spectral.render
    wrong = settings.overrides.add()
    wrong.name, wrong.value = "bounce", "3"
    with pytest.raises(RuntimeError, match="no effect is named 'bounce'; did you mean 'bounces'"):
        bpy.ops.render.render()
    assert jobs.records[-1].status == "failed" and jobs.failures()[0].message.startswith("no effect is named")
    settings.overrides.clear()
    f12()
    assert jobs.records[-1].status == "done"


def test_an_error_of_this_project_ends_the_render_with_an_error(build, f12, monkeypatch):
    from blender_addon import engine, jobs

    monkeypatch.setattr(engine, "translate_scene", lambda *_, **__: 1 / 0)
    with pytest.raises(RuntimeError, match="ZeroDivisionError: division by zero"):
        f12()
    assert [entry.status for entry in jobs.records] == ["failed"]


def test_an_animation_stops_at_its_first_error(build, f12, monkeypatch):
    from blender_addon import engine, jobs

    build.plane(material=glowing(build))
    f12()
    jobs.records.clear()
    monkeypatch.setattr(engine, "translate_scene", lambda *_, **__: 1 / 0)
    bpy.context.scene.frame_end = 3
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        bpy.ops.render.render(animation=True)
    assert [entry.status for entry in jobs.records] == ["failed"]


def test_a_cancelled_render_has_a_record_and_no_error(build, f12):
    from blender_addon import jobs

    def stop(scene):
        raise RenderCancelled("seen enough")

    with jobs.request(jobs.RenderRequest(translated=stop)):
        f12()
    assert [(entry.status, entry.message) for entry in jobs.records] == [("cancelled", "seen enough")]


def test_a_file_in_another_working_space_shows_the_same_color(build, f12):
    """Numbers in the file depend on its working space; the rendered color does not."""
    from blender_addon.translate.context import Translation

    if not hasattr(bpy.ops.wm, "set_working_color_space") or not hasattr(bpy.data, "colorspace"):
        pytest.skip("this Blender has one working space only")
    build.plane(size=9, material=glowing(build, (0.75, 0.5, 0.25)))
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=True)
    seen = f12()[8, 12, :3]
    assert np.abs(seen - (0.75, 0.5, 0.25)).max() > 0.05
    np.testing.assert_allclose(Translation.of(None, bpy.data).linear_rgb(seen), (0.75, 0.5, 0.25), atol=2e-3)


def test_registering_twice_leaves_no_classes_behind(blender):
    import blender_addon
    from blender_addon.engine import SpectralRenderEngine as engine_class

    def marked():
        return {
            panel for panel in bpy.types.Panel.__subclasses__() if "SPECTRAL" in getattr(panel, "COMPAT_ENGINES", ())
        }

    assert len(marked()) > 200 and engine_class.is_registered
    blender_addon.unregister()
    try:
        assert not {panel for panel in marked() if not panel.__module__.startswith("blender_addon")}
        assert not hasattr(bpy.types.Scene, "spectral")
        assert not engine_class.is_registered
    finally:
        blender_addon.register()
    assert len(marked()) > 200


def test_grease_pencil_is_in_the_picture_as_its_note_says(build, f12):
    """Blender draws it over the picture of any engine: note and docs called it left out.

    So it does with Freestyle lines, by EEVEE, whose start takes half a minute here.
    """
    from blender_addon import jobs

    build.camera(type="ORTHO", ortho_scale=3.0)
    bpy.context.scene.world = bpy.data.worlds.new("Gray")
    bpy.ops.object.grease_pencil_add(type="MONKEY", location=(-0.6, 0, 1), rotation=(-np.pi / 2, 0, 0))
    layer = bpy.context.view_layer
    if not hasattr(layer, "use_grease_pencil"):
        pytest.skip("before Blender 5 no layer can leave it out")
    layer.use_grease_pencil = False
    bare = f12()
    layer.use_grease_pencil = True
    drawn = f12()
    if np.array_equal(bare, drawn):
        pytest.skip("Blender finds no OpenGL or Vulkan here, without which no engine has grease pencil")
    assert np.abs(drawn - bare).max() > 0.01
    assert any("grease pencil over the picture" in note.message for note in jobs.records[-1].notes)
    layer.use_pass_grease_pencil = True  # a pass of its own beside the picture
    np.testing.assert_allclose(f12(), drawn, atol=1e-3)
