# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera, film and integrator."""

from __future__ import annotations

import numpy as np

from spectral_core.render.lens.camera_rays import CameraFrame, camera_frame
from spectral_core.render.lens.pixel_filter import filter_offsets
from spectral_core.render.mitsuba_export import xml_elements as xml
from spectral_core.render.mitsuba_export.draft import Draft
from spectral_core.scene import Camera, Film, Scene

_CAMERA = {
    "world_from_camera", "kind", "field_of_view_rad", "orthographic_scale", "sensor_fit", "shift", "aperture_radius",
    "focus_distance", "near", "far",
}  # fmt: skip
_FILM = {
    "width", "height", "samples", "seed", "crop", "transparent", "filter_width", "filter_kind", "exposure",
}  # fmt: skip
SMALLEST_FILTER = 0.05
"""Least standard deviation of the pixel filter, in pixels."""


def sensor(draft: Draft, scene: Scene, around: str) -> xml.Element:
    """The camera with its film; ``around``: identifier of the medium at the camera, "" for none."""
    camera, film = scene.camera, scene.film
    draft.leftover("Camera", camera, _CAMERA)
    draft.leftover("Film", film, _FILM)
    if camera.panorama is not None:
        draft.note("Camera", "panoramic cameras have no counterpart in Mitsuba; a perspective one is written")
        perspective = Camera(
            world_from_camera=camera.world_from_camera, field_of_view_rad=min(camera.field_of_view_rad, np.pi / 2),
            near=camera.near, far=camera.far,
        )  # fmt: skip
        frame = camera_frame(perspective, film)
    else:
        frame = camera_frame(camera, film)
    kind, children = _optics(draft, frame)
    inside = [xml.reference(around, "medium")] if around else []
    sampler = xml.plugin(
        "sampler", "independent", xml.integer("sample_count", film.samples), xml.integer("seed", film.seed)
    )
    return xml.plugin("sensor", kind, *children, *inside, sampler, _film(draft, film))


def _optics(draft: Draft, frame: CameraFrame) -> tuple[str, list[xml.Element]]:
    camera = frame.camera
    extent, center = frame.high - frame.low, (frame.high + frame.low) / 2
    matrix = np.eye(4)
    matrix[:3] = np.stack([-frame.right, frame.up, -frame.back, frame.origin], axis=1)
    clips = [xml.number("near_clip", camera.near), xml.number("far_clip", camera.far)]
    if camera.kind == "orthographic":
        if camera.aperture_radius > 0:
            draft.note("Camera", "Mitsuba's orthographic camera has no depth of field")
        matrix[:3, 3] += center[0] * frame.right + center[1] * frame.up
        matrix[:3, :2] *= extent[0] / 2
        return "orthographic", [xml.transform("to_world", matrix), *clips]
    field = xml.number("fov", float(np.degrees(2 * np.arctan(extent[0] / 2))))
    offsets = [
        xml.number("principal_point_offset_x", float(center[0] / extent[0])),
        xml.number("principal_point_offset_y", -float(center[1] / extent[1])),
    ]
    placed = [xml.transform("to_world", matrix), xml.string("fov_axis", "x"), field, *clips]
    if camera.aperture_radius <= 0:
        return "perspective", [*placed, *offsets]
    if np.any(center != 0):
        draft.note("Camera", "Mitsuba's camera with depth of field has no shift; it is left out")
    lens = [xml.number("aperture_radius", camera.aperture_radius), xml.number("focus_distance", camera.focus_distance)]
    return "thinlens", [*placed, *lens]


def _film(draft: Draft, film: Film) -> xml.Element:
    size = [xml.integer("width", film.width), xml.integer("height", film.height)]
    if film.crop is not None:
        left, bottom, width, height = film.crop
        size += [
            xml.integer("crop_offset_x", left), xml.integer("crop_offset_y", film.height - bottom - height),
            xml.integer("crop_width", width), xml.integer("crop_height", height),
        ]  # fmt: skip
    if film.filter_kind == "box" and film.filter_width == 1.0:
        pixel = xml.plugin("rfilter", "box")
    else:
        spread = max(float(np.std(filter_offsets(film))), SMALLEST_FILTER)
        pixel = xml.plugin("rfilter", "gaussian", xml.number("stddev", spread))
        draft.note("Film", f"the pixel filter is written as a Gaussian of equal variance ({spread:.3g} pixels)")
    shown = xml.string("pixel_format", "rgba" if film.transparent else "rgb")
    return xml.plugin("film", "hdrfilm", *size, shown, xml.string("component_format", "float32"), pixel)


def integrator(draft: Draft, scene: Scene, bounces: int) -> xml.Element:
    """A path tracer, volumetric if light crosses clear surfaces or media; call it after everything else."""
    draft.leftover("Light paths", scene.settings.light_paths, ())
    hides = _hides_lights(draft, scene)
    has_media = scene.world.medium is not None or scene.volumes or any(m.medium is not None for m in scene.materials)
    kind = "volpathmis" if has_media else "volpath" if draft.has_clear_surfaces else "path"
    return xml.plugin("integrator", kind, xml.integer("max_depth", bounces + 2), xml.boolean("hide_emitters", hides))


def _hides_lights(draft: Draft, scene: Scene) -> bool:
    """Mitsuba hides all lights from the camera, or none."""
    from spectral_core.render.mitsuba_scene.emission import is_dark

    bodies = [light for light in scene.lights if getattr(light, "radius", 1.0) > 0]
    hidden = [light.name for light in bodies if not light.camera_visible]
    emits = any(not is_dark(material.surface) for material in scene.materials)
    seen = len(hidden) < len(bodies) or emits or not (scene.world.is_black or scene.film.transparent)
    if not hidden:
        return scene.film.transparent and not emits and not bodies
    if seen:
        draft.note(
            ", ".join(hidden[:8]) + (" …" if len(hidden) > 8 else ""),
            "the camera sees it in Mitsuba, which hides all lights and the background or none of them",
        )
    return not seen
