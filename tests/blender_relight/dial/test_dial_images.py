# SPDX-License-Identifier: GPL-3.0-or-later
"""The image of a dial: one for each scene, in saved files too, and its background in cameras."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.dial import live  # noqa: E402
from blender_addon.editing.dial.picture import OWNER, PICTURE, fits_half, picture_for  # noqa: E402


@pytest.fixture
def shown(monkeypatch):
    """Show a gray of this level as the relit picture of a scene; returns the image."""

    def show(scene, level, size=(16, 12)):
        pixels = np.full((size[1], size[0], 4), level, np.float32)
        mix = SimpleNamespace(picture=lambda _, quick: pixels, is_coarse=False)
        monkeypatch.setattr(live, "live_mix", lambda _: mix)
        return live.show(scene)

    return show


@pytest.fixture
def scene(blender):
    """An empty scene with a camera."""
    scene = bpy.context.scene
    scene.name = "Day"
    scene.camera = camera_in(scene, "Front")
    return scene


def camera_in(scene, name):
    made = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    scene.collection.objects.link(made)
    return made


def backgrounds(name):
    return [each.image for each in bpy.data.cameras[name].background_images]


def level_of(image):
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return float(pixels.mean())


def save_as_file(image, path, kind):
    image.filepath_raw, image.file_format = str(path), kind
    image.save()


@pytest.mark.parametrize("kind", ["PNG", "OPEN_EXR"])
def test_a_picture_that_was_saved_as_a_file_is_replaced_where_it_is_used(scene, shown, tmp_path, kind):
    image = shown(scene, 0.25)
    material = bpy.data.materials.new("Screen")
    from blender_addon import compat

    compat.use_nodes(material).nodes.new("ShaderNodeTexImage").image = image
    material.use_fake_user = True
    path = tmp_path / "kept"
    save_as_file(image, path, kind)
    written = path.read_bytes()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    for level in (0.5, 0.75):
        image = shown(bpy.context.scene, level)
        assert list(bpy.data.images) == [image] and image.name == PICTURE and image.is_float
        assert backgrounds("Front") == [image] and level_of(image) == pytest.approx(level)
    used = [each.image for each in bpy.data.materials["Screen"].node_tree.nodes if each.type == "TEX_IMAGE"]
    assert used == [image]
    assert image.source == "GENERATED" and path.read_bytes() == written


def test_a_packed_picture_is_replaced(scene, shown):
    image = shown(scene, 0.25)
    image.pack()
    image = shown(scene, 0.5)
    assert list(bpy.data.images) == [image] and image.packed_file is None and backgrounds("Front") == [image]
    assert level_of(image) == pytest.approx(0.5)


def test_a_picture_keeps_its_image_over_saving_new_names_and_another_size(scene, shown, tmp_path):
    shown(scene, 0.25)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    scene, image = bpy.context.scene, bpy.data.images[PICTURE]
    scene.name, image.name = "Evening", "Mixed"
    assert shown(scene, 0.5, size=(20, 10)) == image and tuple(image.size) == (20, 10)
    assert list(bpy.data.images) == [image] and backgrounds("Front") == [image]


@pytest.mark.parametrize("how", ["mixed", "read"])
def test_a_picture_that_cannot_be_shown_again_is_no_black_frame(scene, shown, monkeypatch, tmp_path, how):
    """Blender makes the image anew in black when a file is opened, or when a recording of another size is undone."""
    from spectral_core.errors import InvalidInputError

    shown(scene, 0.25)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))

    def fail(_scene):
        raise InvalidInputError("no recording")

    def fails(scene):
        monkeypatch.setattr(live, "live_mix", fail)
        if how == "mixed":
            live._show_quietly(scene)
        else:
            live._was_read(("", 0, 0), scene, "no recording")
        return scene.spectral.dial.message, len(backgrounds("Front"))

    # a light that cannot be mixed leaves the last picture, a recording that cannot be read does not: it had another one
    assert fails(scene) == ("no recording", 1 if how == "mixed" else 0)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    scene = bpy.context.scene
    assert level_of(bpy.data.images[PICTURE]) == pytest.approx(0.25)  # the alpha of black
    assert fails(scene) == ("no recording", 0)
    image = shown(scene, 0.5)
    assert backgrounds("Front") == [image]


def test_an_image_of_an_earlier_version_is_taken_over(scene, shown):
    image = bpy.data.images.new(PICTURE, 16, 12, alpha=True, float_buffer=True)
    assert shown(scene, 0.5) == image and image[OWNER] == "Day"


def test_each_scene_has_its_picture(scene, shown):
    other = bpy.data.scenes.new("Night")
    other.camera = camera_in(other, "Back")
    day, night = shown(scene, 0.75), shown(other, 0.25)
    assert day != night and backgrounds("Front") == [day] and backgrounds("Back") == [night]
    assert (level_of(day), level_of(night)) == pytest.approx((0.75, 0.25))
    assert shown(scene, 0.5) == day and level_of(night) == pytest.approx(0.25)
    live.uncover(other)
    assert backgrounds("Front") == [day] and backgrounds("Back") == []


@pytest.mark.parametrize("first", ["original", "copy"])
def test_a_copied_scene_gets_a_picture_of_its_own(scene, shown, first):
    image = shown(scene, 0.75)
    twin = scene.copy()
    order = [scene, twin] if first == "original" else [twin, scene]
    for each in order:
        shown(each, 0.25 if each == twin else 0.5)
        assert backgrounds("Front") == [each.spectral.dial.picture]  # the camera of both shows the last one
    assert scene.spectral.dial.picture == image and twin.spectral.dial.picture != image
    assert level_of(image) == pytest.approx(0.5)
    assert level_of(twin.spectral.dial.picture) == pytest.approx(0.25)


def test_a_copy_of_a_renamed_scene_does_not_take_its_picture(scene, shown):
    image = shown(scene, 0.75)
    scene.name = "Morning"
    twin = scene.copy()
    assert shown(scene, 0.5) == image and shown(twin, 0.25) != image


def test_pictures_are_removed_from_every_camera(scene, shown):
    image = shown(scene, 0.5)
    scene.camera = camera_in(scene, "Side")
    shown(scene, 0.5)
    own = bpy.data.images.new("Reference", 4, 4)
    bpy.data.cameras["Front"].background_images.new().image = own
    assert backgrounds("Front") == [image, own] and backgrounds("Side") == [image]
    scene.spectral.dial.over_camera = False
    shown(scene, 0.5)
    assert backgrounds("Front") == [own] and backgrounds("Side") == []


def test_a_view_does_not_draw_a_picture_that_was_removed(scene, shown):
    """A view draws the evaluated camera, which kept the picture until the next edit of the camera."""
    bpy.context.window.scene = scene
    image = shown(scene, 0.5)

    def drawn():
        camera = bpy.data.cameras["Front"].evaluated_get(bpy.context.evaluated_depsgraph_get())
        return [each.image.name for each in camera.background_images]

    assert drawn() == [image.name]
    scene.spectral.dial.over_camera = False
    shown(scene, 0.5)
    assert drawn() == []


def test_pictures_without_a_camera_are_removed_too(scene, shown):
    shown(scene, 0.5)
    scene.camera, scene.spectral.dial.over_camera = None, False
    shown(scene, 0.5)
    assert backgrounds("Front") == []


def test_a_linked_scene_has_one_picture(scene, shown, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (there, here):
        here.scenes = there.scenes
    linked = here.scenes[0]
    image = shown(linked, 0.25)
    assert shown(linked, 0.5) == image and list(bpy.data.images) == [image]
    assert shown(bpy.context.scene, 0.75) != image and level_of(image) == pytest.approx(0.5)


def test_views_are_not_told_of_the_image_at_each_change(scene, shown):
    """A reported image would make 3D views read all images again."""
    told = []

    def listen(_scene, depsgraph):
        told.extend(type(update.id).__name__ for update in depsgraph.updates)

    shown(scene, 0.25)
    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.append(listen)
    try:
        for level in (0.5, 0.75):
            shown(scene, level)
            bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(listen)
    assert "Image" not in told


@pytest.mark.parametrize("mode", ["SOLID", "WIREFRAME", "MATERIAL", "RENDERED"])
def test_the_panel_states_where_blender_shows_the_picture_without_the_view_transform(scene, shown, mode):
    """Blender draws Solid and Wireframe mode with Standard: seen in windows of Blender 4.3 and 5.2."""
    from blender_addon.editing.dial.picture import lacks_view_transform

    image, view = shown(scene, 0.5), scene.view_settings
    live.place(scene, image, over_camera=True)
    space = SimpleNamespace(
        type="VIEW_3D", shading=SimpleNamespace(type=mode), overlay=SimpleNamespace(show_overlays=True),
        use_local_camera=False, camera=None, region_3d=SimpleNamespace(view_perspective="CAMERA"),
    )  # fmt: skip
    context = SimpleNamespace(space_data=space, scene=scene, region_data=None)  # as in a panel
    plain = mode in ("SOLID", "WIREFRAME")
    view.view_transform = "AgX"
    assert lacks_view_transform(context) == plain
    view.view_transform = "Standard"
    assert not lacks_view_transform(context), "the file's own transform is Standard"
    view.exposure = 1.0
    assert lacks_view_transform(context) == plain
    space.region_3d.view_perspective = "PERSP"
    assert not lacks_view_transform(context), "the picture is not shown"
    space.type = "IMAGE_EDITOR"
    assert not lacks_view_transform(context)


def test_an_image_editor_shows_a_picture_of_half_the_size_over_the_same_pixels(scene):
    image = picture_for(scene, 40, 20)
    area = bpy.context.window_manager.windows[0].screen.areas[0]
    area.type = "IMAGE_EDITOR"
    space = area.spaces.active
    space.image = image
    space.zoom_percentage = 70
    for _ in range(2):  # further pictures of a drag find it magnified
        assert picture_for(scene, 20, 10, is_coarse=True) == image
        assert (tuple(image.size), space.zoom_percentage) == ((20, 10), pytest.approx(140))
    picture_for(scene, 40, 20)
    assert (tuple(image.size), space.zoom_percentage) == ((40, 20), pytest.approx(70))
    image.scale(20, 10)  # as an undo does, which brings back the image of a drag
    for is_coarse, zoom in ((True, 140), (False, 70)):
        picture_for(scene, 20, 10, is_coarse=is_coarse)
        assert space.zoom_percentage == pytest.approx(zoom)


def test_a_picture_of_odd_size_or_in_a_border_is_not_halved(scene):
    assert fits_half(scene, 20, 40)
    assert not fits_half(scene, 21, 40) and not fits_half(scene, 20, 41)
    scene.render.use_border = True
    scene.render.border_min_x = 0.5
    assert not fits_half(scene, 20, 40)
