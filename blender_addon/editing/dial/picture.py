# SPDX-License-Identifier: GPL-3.0-or-later
"""The relit picture in the artist's view: over the camera view, in any workspace, with the scene's view transform."""

from __future__ import annotations

from bpy.types import Context, Image, Scene

from ... import compat

PICTURE = "Light Dial"


def place(scene: Scene, image: Image, *, over_camera: bool) -> None:
    """Show ``image`` over the camera view, as a background image of the camera, or remove it."""
    if scene.camera is None or scene.camera.type != "CAMERA" or not compat.is_editable(scene.camera.data):
        return
    camera = scene.camera.data
    kept = next((each for each in camera.background_images if each.image == image), None)
    if not over_camera:
        if kept is not None:
            camera.background_images.remove(kept)
        return
    if kept is None:
        kept = camera.background_images.new()
        kept.image = image
        kept.alpha, kept.display_depth, kept.frame_method = 1.0, "FRONT", "FIT"
        camera.show_background_images = True
    image.use_view_as_render = True  # shown through the scene's view transform, as a render is


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
