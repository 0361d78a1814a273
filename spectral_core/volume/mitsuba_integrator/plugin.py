# SPDX-License-Identifier: GPL-3.0-or-later
"""The Mitsuba integrator `adaptive_volume`.

``register_integrator()`` makes it known to Mitsuba, for dictionaries and XML, in the variant that is set and in every
variant set afterward. Its properties are those of ``VolumeSettings``, the fields of ``read_volumes``, and a nested
integrator for surfaces.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError, MissingDependencyError
from spectral_core.volume.march.loop import march
from spectral_core.volume.march.path import WorldRay, path_through
from spectral_core.volume.mitsuba_integrator.coverage import render_with_coverage
from spectral_core.volume.mitsuba_integrator.scene_fields import SceneFields, sensor_view
from spectral_core.volume.mitsuba_integrator.scene_light import Lit, surface_light
from spectral_core.volume.mitsuba_integrator.settings import read_settings, read_volumes, require_known

_registered: set[str] = set()
# Mitsuba calls plugins with denormals flushed to zero, where NumPy warns when it first reads a float type's limits.
_LIMITS = np.finfo(np.float32), np.finfo(np.float64)


def register_integrator() -> None:
    """Register `adaptive_volume` with Mitsuba; raises if Mitsuba is not installed or no variant is set."""
    try:
        import mitsuba as mi
    except ImportError as error:
        raise MissingDependencyError.package("mitsuba", "rendering volumes in a scene", "render") from error
    if mi.variant() is None:
        raise InvalidInputError("no Mitsuba variant is set; call mitsuba.set_variant before register_integrator")
    if not _registered:
        mi.detail.add_variant_callback(lambda _old, _new: _register())
    _register()


def _register() -> None:
    import mitsuba as mi

    variant = mi.variant()
    if variant is None or variant in _registered:
        return
    integrator = _integrator_class()
    mi.register_integrator("adaptive_volume", lambda props: integrator(props))
    _registered.add(variant)


def _integrator_class() -> Any:
    """The integrator class for the variant that is set: Mitsuba's base class differs between variants."""
    import drjit as dr
    import mitsuba as mi

    class AdaptiveVolume(mi.SamplingIntegrator):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            if mi.is_polarized:
                raise InvalidInputError("adaptive_volume knows no polarization; use an rgb, mono or spectral variant")
            require_known(props, (mi.Integrator, mi.Volume))
            nested = {key: props[key] for key in props.keys()}  # noqa: SIM118 (no mapping)
            grids = {key: value for key, value in nested.items() if isinstance(value, mi.Volume)}
            self.surface = next((v for v in nested.values() if isinstance(v, mi.Integrator)), None)
            self.settings = read_settings(props)
            self.fields = SceneFields(read_volumes(props, grids), self.settings)
            if self.surface is not None and self.surface.aov_names():
                # A film's channels are named before a ray is traced, and ours come from the march alone.
                mi.Log(
                    mi.LogLevel.Warn,
                    "adaptive_volume: channels of its nested integrator "
                    f"({', '.join(self.surface.aov_names())}) are not recorded; put the aov integrator around "
                    "adaptive_volume instead of inside",
                )

        def render(
            self,
            scene: Any,
            sensor: Any = 0,
            seed: Any = 0,
            spp: int = 0,
            develop: bool = True,
            evaluate: bool = True,
        ) -> Any:
            camera = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
            self.fields.prepare(sensor_view(camera), scene)
            return render_with_coverage(self, scene, camera, seed=seed, spp=spp, develop=develop, evaluate=evaluate)

        def aov_names(self) -> list[str]:
            if not self.settings.channels:
                return []
            return ["transmittance", *(f"amount.{name}" for name in self.fields.materials)]

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            light, coverage, channels = self.sample_coverage(scene, sampler, ray, active)
            # The caller (an aov integrator around this one) accepts only a Boolean: it is drawn at random, correct in
            # the mean.
            return light, active & (sampler.next_1d(active) < coverage), channels

        def sample_coverage(self, scene: Any, sampler: Any, ray: Any, active: Any = True) -> Any:
            """(light, opacity without background, extra channels) along Mitsuba's ``ray``."""
            if not self.fields.placed:
                self.fields.prepare(None, scene)
            hit = scene.ray_intersect_preliminary(ray, True, active)
            end = dr.select(hit.is_valid(), hit.t, 1e30)
            line = WorldRay(ray.o, ray.d, dr.minimum(end, ray.maxt))
            amounts, transmittance, light = self.march(scene, sampler, ray, line, active)
            behind, there = self.behind(scene, sampler, ray, active & (transmittance > 1e-5))
            channels = [transmittance, *amounts] if self.settings.channels else []
            return light + transmittance * behind, dr.select(there, 1.0, 1.0 - transmittance), channels

        def march(self, scene: Any, sampler: Any, ray: Any, line: WorldRay, active: Any) -> Any:
            """(amounts, transmittance, light) of all fields up to the first surface."""
            fields, settings = self.fields, self.settings
            phase = 1.0 - sampler.next_1d(active) if settings.jitter else None
            placed, seen = fields.those("in_camera"), [item for item in fields.items if item.in_camera]
            if not placed:
                none = mi.Float(line.end) * 0.0
                return fields.of_all([], none), none + 1.0, mi.Spectrum(0.0)
            every = zip(fields.items, fields.colors, strict=True)
            colors = [color for item, each in every if item.in_camera for color in each.at(ray.wavelengths)]
            path = path_through(placed, line, phase)
            if settings.shading:
                lit = [material.lit for item in seen for material in item.transfer.materials]
                shade = Lit(scene, placed, fields.those("in_shadow"), colors, lit, settings).shade(line, ray)
                out = march(path, shade=shade, light=mi.Spectrum(0.0), sampler=sampler)
                return fields.of_all(out.amounts, out.transmittance * 0.0), out.transmittance, out.light
            out = march(path)
            light = sum((a * c for a, c in zip(out.amounts, colors, strict=True)), mi.Spectrum(0.0))
            return fields.of_all(out.amounts, out.transmittance * 0.0), out.transmittance, light

        def behind(self, scene: Any, sampler: Any, ray: Any, active: Any) -> Any:
            """(light, True if there is any) from surfaces and the environment behind the fields."""
            if self.settings.shadows:
                passed, occluders = self.fields.those("in_bounces"), self.fields.those("in_shadow")
                return surface_light(scene, sampler, ray, passed, occluders, active, self.settings.max_depth)
            if self.surface is None:
                return mi.Spectrum(0.0), mi.Bool(False)
            light, valid, *_ = self.surface.sample(scene, sampler, mi.RayDifferential3f(ray), None, active)
            return light, valid

        def to_string(self) -> str:
            return f"AdaptiveVolume[{', '.join(item.volume.name for item in self.fields.items)}]"

    return AdaptiveVolume
