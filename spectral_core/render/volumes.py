# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampled volumes of a scene, as its path integrator shows them between surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.errors import UnknownNameError
from spectral_core.render.lens.camera_rays import CameraFrame, camera_frame, rays
from spectral_core.render.trace.media.sampled import SampledVolumes
from spectral_core.scene import Camera, Film, Note, Rays, Scene, VolumeObject
from spectral_core.spectra.observer import STANDARD, observer
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.mitsuba_integrator.scene_colors import in_even_light
from spectral_core.volume.mitsuba_integrator.scene_fields import SceneFields
from spectral_core.volume.mitsuba_integrator.settings import SceneVolume, VolumeSettings
from spectral_core.volume.view import View

LIGHTING = ("even", "scene", "shadows")
"""Light of volumes with lit materials: even and white, the scene's lights, or these with shadows to and from
surfaces.
"""
_WIDEST = np.radians(120.0)
"""Largest angle of view for which the steps of a panoramic camera are chosen."""
WITHOUT_SHADOWS = (
    "its steps are chosen without shadows, since a sky or more than three lamps light it: the picture with shadows may "
    "have less than the wanted quality. Raise it if that matters"
)


OWN_LIGHT = (
    "shines by itself, and the recording counts its light to light group {}, the first by name: that bulb dims and "
    "colors it, too, while Apply to Lights leaves it as it is. Leave that bulb at 1 and at its light to keep it"
)


def sampled_volumes(
    scene: Scene, loaded: Any, *, spectral: bool, own_light: bool = True, like: SampledVolumes | None = None
) -> SampledVolumes:
    """The volumes of ``scene`` for its path integrator, under the active variant.

    Steps are chosen for the scene's camera and, where lamps light the volumes, for the lights of ``loaded``, the scene
    in Mitsuba. ``own_light`` False omits light that does not come from the scene's lights, so that the shares of light
    groups add up to the picture; such volumes take the steps of those that they are ``like``.
    """
    lighting = max((require_lighting(volume) for volume in scene.volumes), key=LIGHTING.index)
    items = [_item(volume, lighting, spectral=spectral, own_light=own_light) for volume in scene.volumes]
    quality = float(max(volume.quality for volume in scene.volumes))
    settings = VolumeSettings(quality=quality, shading=lighting != "even", shadows=lighting == "shadows")
    fields = SceneFields(items, settings)
    if like is None:
        fields.prepare([view_of(scene.camera, scene.film, item.volume) for item in items], loaded)
    else:
        fields.take_steps(like.fields)
    return SampledVolumes(fields, [_hidden_from(volume) for volume in scene.volumes])


def missed_qualities(fields: SceneFields) -> tuple[Note, ...]:
    """Notes on the volumes whose wanted quality no steps reach, or only without shadows."""
    planned = zip(fields.items, fields.plans, strict=True)
    notes = [Note(item.volume.name, made.shortfall) for item, made in planned if made and made.shortfall]
    if fields.settings.shadows and not fields.shadows_planned:
        notes += [Note(item.volume.name, WITHOUT_SHADOWS) for item in fields.items if item.in_camera]
    return tuple(notes)


def _hidden_from(volume: VolumeObject) -> Rays:
    """Rays that pass a volume: without shadows also those to lamps, and those that matt surfaces scatter."""
    without = Rays.NONE if volume.lighting == "shadows" else Rays.DIFFUSE | Rays.SHADOW
    return volume.hidden_from | without


def shining(scene: Scene) -> tuple[str, ...]:
    """Names of the sampled volumes that emit light or are in even light, neither of which is that of a lamp."""
    return tuple(
        volume.name
        for volume in scene.volumes
        if any(
            (require_lighting(volume) == "even" or not each.lit) and _has_light(each)
            for each in volume.transfer.materials
        )
    )


def _has_light(material: Any) -> bool:
    strongest = max(material.extinction.max(), 0.0 if material.emission is None else material.emission.max())
    return bool(strongest > 0.0 and np.any(material.color > 0.0))


def view_of(camera: Camera, film: Film, volume: ScalarVolume) -> View:
    """The camera for the pilot rays of a volume: square pixels, no lens; flat, toward the volume, for a panorama."""
    frame = camera_frame(camera, film)
    if camera.panorama is not None:
        return _view_toward(volume, frame, film)
    matrix = np.eye(4)
    matrix[:3] = np.stack([-frame.right, frame.up, -frame.back, frame.origin], axis=1)
    across, upwards = frame.high - frame.low
    height = max(1, round(film.width * float(upwards / across)))
    middle = (frame.high + frame.low) / 2 / across
    shift = float(middle[0]), float(middle[1])
    if camera.kind == "orthographic":
        return View(matrix, film.width, height, fov_deg=None, ortho_width=float(across), shift=shift)
    return View(matrix, film.width, height, fov_deg=float(np.degrees(2 * np.arctan(across / 2))), shift=shift)


def _view_toward(volume: ScalarVolume, frame: CameraFrame, film: Film) -> View:
    """A flat picture of a volume from the place of a panoramic camera, with pixels as large as at its middle.

    It shows the sphere around the volume, and ``_WIDEST`` at most.
    """
    corners = volume.corners_world
    middle = corners.mean(axis=0)
    away, radius = middle - frame.origin, float(np.linalg.norm(corners - middle, axis=1).max())
    distance = float(np.linalg.norm(away))
    is_inside = distance <= radius
    fov = _WIDEST if is_inside else min(2.0 * float(np.arcsin(radius / distance)), _WIDEST)
    ahead = -frame.back if distance < 1e-6 * radius else away / distance
    up = frame.up if abs(ahead @ frame.up) < 0.99 else frame.back
    places = np.array([0.5, 0.5 + 1.0 / film.width]), np.array([0.5, 0.5])
    _, toward, _ = rays(frame, places, (np.zeros(2), np.zeros(2)), lambda *parts: np.stack(np.broadcast_arrays(*parts)))
    pixel = max(float(np.linalg.norm(toward[:, 1] - toward[:, 0])), 1e-9)
    size = int(np.clip(round(2.0 * np.tan(fov / 2.0) / pixel), 1, film.width))
    return View.looking(frame.origin, frame.origin + ahead, up, width=size, height=size, fov_deg=float(np.degrees(fov)))


def require_lighting(volume: VolumeObject) -> str:
    """The lighting of a volume. Raises UnknownNameError if there is none of this name."""
    if volume.lighting not in LIGHTING:
        raise UnknownNameError.among("volume lighting", volume.lighting, LIGHTING)
    return volume.lighting


def _item(volume: VolumeObject, lighting: str, *, spectral: bool, own_light: bool) -> SceneVolume:
    """The field with gains that convert its light to the renderer's unit.

    The renderer's spectral radiance is per nm, and its sum over the observer's ȳ is luminance. ``spectral_core.volume``
    counts a flat spectrum of 1 as luminance 1; in the renderer's unit that is 1 / ∑ȳ. Reflected light of the scene has
    the light's unit.

    ``lighting`` is the integrator's, that of the volume which asks for most. A volume in even light beside one that
    lamps light shines in its colors; only volumes with shadows cast them.
    """
    transfer = volume.transfer
    if volume.lighting == "even" and lighting != "even":
        transfer = in_even_light(transfer)
    unit = 1.0 / float(observer(STANDARD).cmfs[1].sum()) if spectral else 1.0
    own = unit if own_light else 0.0
    gains = tuple(1.0 if m.lit and lighting != "even" else own for m in transfer.materials)
    field = ScalarVolume(volume.name, volume.data, volume.world_from_index)
    seen = ~_hidden_from(volume)
    return SceneVolume(field, transfer, gains, volume.rule, bool(seen & Rays.CAMERA), bool(seen & Rays.SHADOW))
