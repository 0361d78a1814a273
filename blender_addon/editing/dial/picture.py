# SPDX-License-Identifier: GPL-3.0-or-later
"""The relit picture in the artist's view: over the camera view, in any workspace, with the scene's view transform.

Each scene has an image of its own: ``dial.picture``, which follows both through new names. A copy of a scene has the
image of its original; the name of the scene on the image tells them apart until the copy's first picture.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.types import Camera, Context, Image, Object, RegionView3D, Scene, SpaceView3D
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError

from ... import compat
from ...translate.camera import border_in_pixels, frame_in_pixels

PICTURE = "Light Dial"
OWNER = "spectral_dial_of"
"""Custom property of an image: name of the scene whose dial was last shown in it."""


def picture_of(scene: Scene) -> Image | None:
    """The image of a scene's dial. One that has no scene, as in files of earlier versions, is found by its name."""
    image = scene.spectral.dial.picture
    if image is None:
        unowned = bpy.data.images.get((PICTURE, None))
        return None if unowned is None or _owners(unowned) else unowned
    others = [each.name for each in _owners(image) if each != scene]
    return None if image.library is not None or image.get(OWNER) in others else image


def picture_for(scene: Scene, width: int, height: int, *, is_coarse: bool = False) -> Image:
    """The image of a scene's dial in this size. It is made if there is none. ``is_coarse``: the picture is one of half
    the size, and takes the place of the whole one.

    An image that was saved as a file or packed is replaced, in all places that use it: it no longer holds the picture's
    floats, or Blender would write the next picture over the artist's file.
    """
    image = picture_of(scene)
    if image is None or image.source != "GENERATED" or not image.is_float:
        image = _made(image, width, height)
    else:
        # not by the image's size: an undo brings back that of a drag, while editors keep their zoom
        (_magnify if is_coarse else _restore)(image)
        if tuple(image.size) != (width, height):
            image.scale(width, height)
    if image.alpha_mode != "PREMUL":  # that of its pixels; Blender would convert each picture before it is drawn
        image.alpha_mode = "PREMUL"
    if scene.spectral.dial.picture != image:
        scene.spectral.dial.picture = image
    if image.get(OWNER) != scene.name:
        image[OWNER] = scene.name
    return image


def fits_half(scene: Scene, height: int, width: int) -> bool:
    """True if a picture of half the size can take the place of one of (height, width): both are even, and it is not set
    into a larger frame.
    """
    whole = frame_in_pixels(scene.render)
    return height % 2 == width % 2 == 0 and _border(scene, *whole) is None


_magnified: dict[int, list[tuple[int, tuple[float, float]]]] = {}
"""By session number of an image that has half its size, the image editors that show it twice as large: address of each
one's settings, and by how many pixels of the image it was moved.
"""


def _magnify(image: Image) -> None:
    """Let image editors show an image twice as large, because its size is halved: it covers the same part of each."""
    if image.session_uid in _magnified:
        return
    shown = _magnified[image.session_uid] = []
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            space = area.spaces.active
            if area.type == "IMAGE_EDITOR" and space.image == image:
                region = next(each for each in area.regions if each.type == "WINDOW")
                place = region.view2d.view_to_region(0.5, 0.5, clip=False)  # the image's middle, in pixels
                sizes, zoom = (region.width, region.height), 2 * space.zoom_percentage / 100
                # an editor counts the way to its middle in pixels of the image, of which there are half as many now
                moved = tuple((at - size / 2) / zoom for at, size in zip(place, sizes, strict=True))
                shown.append((space.as_pointer(), moved))
                _zoom(area, 2.0, moved)


def _restore(image: Image) -> None:
    """Let image editors show an image as they did before ``_magnify``, those of other workspaces as well."""
    for address, (across, up) in _magnified.pop(image.session_uid, ()):
        for screen in bpy.data.screens:
            for area in screen.areas:
                if area.spaces.active.as_pointer() == address:
                    _zoom(area, 0.5, (-across, -up))


def _zoom(area: Any, factor: float, moved: tuple[float, ...]) -> None:
    """Multiply the zoom of an image editor, and move its image by so many pixels of it."""
    area.spaces.active.zoom_percentage *= factor
    if max(map(abs, moved)) * area.spaces.active.zoom_percentage <= 100:
        return  # less than a pixel of the screen, to which the place of the middle is rounded
    for window in bpy.context.window_manager.windows:
        if window.screen == area.id_data:
            region = next(each for each in area.regions if each.type == "WINDOW")
            with bpy.context.temp_override(window=window, area=area, region=region):
                bpy.ops.image.view_pan(offset=moved)


def new_picture(name: str, width: int, height: int) -> Image:
    """A new image for linear light; a file of it that Blender saves as an image, not as a render, is linear sRGB."""
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True)
    compat.set_linear_rec709(image)
    return image


def fill(image: Image, pixels: NDArray[np.float32]) -> None:
    """Give an image of floats linear sRGB, (height, width, 4), bottom row first.

    Blender takes the floats of an image for scene-linear when it shows or saves it, whatever the image's color space.
    """
    matrix = compat.rec709_from_working(compat.working_space(bpy.data))
    image.pixels.foreach_set(_transformed(pixels, np.linalg.inv(matrix)).reshape(-1))


def linear_pixels(image: Image) -> NDArray[np.float32]:
    """The linear sRGB (height, width, 4) that ``fill`` gave to an image."""
    found = np.empty((image.size[1], image.size[0], 4), np.float32)
    image.pixels.foreach_get(found.reshape(-1))
    return _transformed(found, compat.rec709_from_working(compat.working_space(bpy.data)))


def _transformed(pixels: NDArray[np.float32], matrix: NDArray[np.float64]) -> NDArray[np.float32]:
    if np.array_equal(matrix, np.eye(3)):
        return np.ascontiguousarray(pixels)
    made = pixels.copy()
    made[..., :3] = pixels[..., :3] @ matrix.T.astype(np.float32)
    return made


def _made(replaced: Image | None, width: int, height: int) -> Image:
    """A new image, in place of another one."""
    image = new_picture(PICTURE, width, height)
    if replaced is not None:
        name = replaced.name
        replaced.user_remap(image)
        bpy.data.images.remove(replaced)
        image.name = name
    return image


def _owners(image: Image) -> list[Scene]:
    """Scenes whose dial has this image: one, or more after a scene was copied."""
    return [each for each in bpy.data.scenes if each.spectral.dial.picture == image]


def in_frame(scene: Scene, pixels: NDArray[Any]) -> NDArray[Any]:
    """Pixels (height, width, channels) of a render border at their place in the whole frame, 0 around them.

    The camera view shows the image over the whole frame. Pixels of any other size than the border are returned as they
    are: the border has changed since the recording.
    """
    width, height = frame_in_pixels(scene.render)
    border = _border(scene, width, height)
    if border is None or (border[3], border[2]) != pixels.shape[:2] or pixels.shape[:2] == (height, width):
        return pixels
    left, bottom, across, up = border
    whole = np.zeros((height, width, pixels.shape[2]), pixels.dtype)
    whole[bottom : bottom + up, left : left + across] = pixels
    return whole


def cropped(scene: Scene, image: Image) -> NDArray[np.float32] | None:
    """Pixels of the border in an image of the whole frame, if renders are cropped to it; None if they are the image."""
    width, height = image.size
    border = _border(scene, width, height) if (width, height) == frame_in_pixels(scene.render) else None
    if border is None or not scene.render.use_crop_to_border:
        return None
    left, bottom, across, up = border
    return np.ascontiguousarray(linear_pixels(image)[bottom : bottom + up, left : left + across])


def _border(scene: Scene, width: int, height: int) -> tuple[int, int, int, int] | None:
    try:
        return border_in_pixels(scene.render, width, height)
    except InvalidInputError:  # an empty border
        return None


def place(scene: Scene, image: Image, *, over_camera: bool) -> None:
    """Show ``image`` over the camera view, as a background image of the camera, or remove it from every camera.

    A camera of several scenes shows the picture of the last one only.
    """
    if not over_camera:
        for each in bpy.data.cameras:
            if compat.is_editable(each):
                _remove(each, {image})
        return
    if scene.camera is None or scene.camera.type != "CAMERA" or not compat.is_editable(scene.camera.data):
        return
    camera = scene.camera.data
    _remove(camera, {each.spectral.dial.picture for each in bpy.data.scenes} - {image, None})
    if all(each.image != image for each in camera.background_images):
        shown = camera.background_images.new()
        shown.image = image
        shown.alpha, shown.display_depth, shown.frame_method = 1.0, "FRONT", "STRETCH"
        camera.show_background_images = True
    image.use_view_as_render = True  # shown through the scene's view transform, as a render is


def covers(context: Context, scene: Scene, camera: Object | None) -> bool:
    """True if the 3D view of ``context`` looks through ``camera`` and shows the picture over its frame."""
    return _covers(context.space_data, context.region_data, scene, camera)


def _covers(space: SpaceView3D, view: RegionView3D, scene: Scene, camera: Object | None) -> bool:
    if camera is None or camera.type != "CAMERA" or view.view_perspective != "CAMERA":
        return False
    image = scene.spectral.dial.picture
    if image is None or not (space.overlay.show_overlays and camera.data.show_background_images):
        return False
    shown = (each for each in camera.data.background_images if each.image == image)
    return any(each.show_background_image and each.alpha == 1.0 and each.display_depth == "FRONT" for each in shown)


def lacks_view_transform(context: Context) -> bool:
    """True if the 3D view of ``context`` shows the picture otherwise than a render: in Solid and Wireframe mode Blender
    draws everything with the transform Standard, without the file's exposure.
    """
    space, scene = context.space_data, context.scene
    if space.type != "VIEW_3D" or space.shading.type not in ("SOLID", "WIREFRAME"):
        return False
    view = scene.view_settings
    plain = view.view_transform == "Standard" and view.look == "None" and (view.exposure, view.gamma) == (0.0, 1.0)
    plain = plain and not (view.use_curve_mapping or getattr(view, "use_white_balance", False))
    camera = space.camera if space.use_local_camera and space.camera else scene.camera
    return not plain and _covers(space, space.region_3d, scene, camera)  # a panel's region has no view of its own


def _remove(camera: Camera, images: set[Image]) -> None:
    found = [each for each in camera.background_images if each.image in images]
    for each in found:
        camera.background_images.remove(each)
    if found:
        camera.update_tag()  # a view draws the evaluated camera, which would keep them


def look(context: Context, image: Image) -> bool:
    """Show the picture on this screen: in an image editor, else through the camera. False if there is neither."""
    areas = context.screen.areas if context.screen else ()
    editor = next((area for area in areas if area.type == "IMAGE_EDITOR"), None)
    if editor is not None:
        editor.spaces.active.image = image
    views = [area.spaces.active.region_3d for area in areas if area.type == "VIEW_3D"]
    if editor is None and views and all(view.view_perspective != "CAMERA" for view in views):
        views[0].view_perspective = "CAMERA"
    return editor is not None or bool(views)
