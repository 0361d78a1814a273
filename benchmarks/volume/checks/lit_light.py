# SPDX-License-Identifier: GPL-3.0-or-later
"""Light along rays through a field that a lamp lights, integrated in NumPy; it shares nothing with the march."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lamp:
    """A sun that shines along ``at`` with an irradiance, or a point lamp at ``at`` with an intensity: linear RGB."""

    at: Array
    light: Array
    is_sun: bool

    def emitter(self) -> dict[str, Any]:
        """As Mitsuba's dictionary."""
        light = {"type": "rgb", "value": self.light.tolist()}
        if self.is_sun:
            return {"type": "directional", "direction": self.at.tolist(), "irradiance": light}
        return {"type": "point", "position": self.at.tolist(), "intensity": light}

    def arriving(self, points: Array) -> tuple[Array, Array]:
        """Directions to the lamp and irradiances, (n, 3) each, at ``points`` (n, 3)."""
        if self.is_sun:
            return np.broadcast_to(-self.at / np.linalg.norm(self.at), points.shape), np.tile(
                self.light, (len(points), 1)
            )
        way = self.at - points
        distance = np.linalg.norm(way, axis=-1, keepdims=True)
        return way / distance, self.light / distance**2


def lit_light(
    volume: ScalarVolume, transfer: TransferFunction, lamp: Lamp, eye: Array, along: Array, step: float = 1 / 150
) -> Array:
    """Linear RGB (n, 3) along rays from ``eye`` in unit directions ``along`` (n, 3), by steps of so many voxels.

    Each step is a midpoint; the field and its slopes over a voxel are SciPy's linear interpolation.
    """
    inverse = volume.index_from_world
    data = np.asarray(volume.data, np.float64)
    picture = np.zeros((len(eye), 3))
    for number, (origin, direction) in enumerate(zip(eye, along, strict=True)):
        start, ahead = inverse[:3, :3] @ origin + inverse[:3, 3], inverse[:3, :3] @ direction
        with np.errstate(divide="ignore"):
            borders = np.sort([(-0.5 - start) / ahead, (np.array(volume.shape) - 0.5 - start) / ahead], axis=0)
        near, far = max(float(borders[0].max()), 0.0), float(borders[1].min())
        if far <= near:
            continue
        count = int(np.ceil((far - near) * np.linalg.norm(ahead) / step))
        width = (far - near) / count
        distance = near + (np.arange(count) + 0.5) * width
        index = start + distance[:, None] * ahead
        extinction, source = transfer.curves(_value(data, index))
        depth = extinction.sum(-1) * width
        behind = np.exp(np.concatenate([[0.0], -np.cumsum(depth)[:-1]]))
        shows = (source.sum(-1) > 0) & (behind > 1e-9)
        index, source, behind, depth = (each[shows] for each in (index, source, behind, depth))
        gain = behind * width * np.where(depth > 1e-9, -np.expm1(-depth) / np.maximum(depth, 1e-9), 1.0)
        slopes = np.stack(
            [_value(data, index + half) - _value(data, index - half) for half in 0.5 * np.eye(3)], axis=-1
        )
        slopes = slopes @ inverse[:3, :3]
        steepness = np.linalg.norm(slopes, axis=-1)
        toward, light = lamp.arriving(origin + distance[shows, None] * direction)
        facing = np.abs(np.sum(slopes * toward, axis=-1)) / np.maximum(steepness, 1e-30)
        lit = light * (np.where(steepness > 0, facing, 0.25) / np.pi)[:, None]
        for k, material in enumerate(transfer.materials):
            shown = (gain * source[:, k])[:, None] * np.asarray(material.color)
            picture[number] += np.sum(shown * (lit if material.lit else 1.0), axis=0)
    return picture


def _value(data: Array, index: Array) -> Array:
    values: Array = map_coordinates(data, index.T, order=1, mode="nearest")
    return values


@dataclass(frozen=True)
class LitScene:
    """A Mitsuba scene with an `adaptive_volume` and one lamp, and its integrator, prepared for the sensor."""

    scene: Any
    integrator: Any
    view: View

    @classmethod
    def of(cls, volume: ScalarVolume, transfer: TransferFunction, lamp: Lamp, view: View, **settings: Any) -> LitScene:
        """Loaded and prepared, with the integrator's ``settings``; Mitsuba's variant must be set."""
        import mitsuba as mi

        from spectral_core.volume.mitsuba_integrator.scene_fields import sensor_view
        from spectral_core.volume.mitsuba_integrator.settings import SceneVolume, integrator_dict

        film = {"type": "hdrfilm", "width": view.width, "height": view.height, "rfilter": {"type": "box"}}
        made = integrator_dict([SceneVolume(volume, transfer)], shading=True, **settings)
        sensor = view.mitsuba_sensor() | {"film": film}
        scene = mi.load_dict({"type": "scene", "integrator": made, "sensor": sensor, "lamp": lamp.emitter()})
        scene.integrator().fields.prepare(sensor_view(scene.sensors()[0]), scene)  # as a render does first
        return cls(scene, scene.integrator(), view)

    def at_centers(self) -> tuple[Array, Array, Array]:
        """(picture, origins, directions), (pixels, 3) each, of one ray through the middle of each pixel."""
        import mitsuba as mi

        width, height = self.view.width, self.view.height
        down, across = np.divmod(np.arange(width * height), width)
        centers = mi.Point2f((across + 0.5) / width, (down + 0.5) / height)
        ray, _ = self.scene.sensors()[0].sample_ray_differential(0.0, 0.5, centers, mi.Point2f(0.5))
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(1, width * height)
        light, *_ = self.integrator.sample(self.scene, sampler, ray)
        picture, eye, along = (np.zeros((width * height, 3)) + np.array(each).T for each in (light, ray.o, ray.d))
        return picture, eye, along
