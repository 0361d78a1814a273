# SPDX-License-Identifier: GPL-3.0-or-later
"""The Mitsuba integrator `adaptive_volume`.

``register_integrator()`` makes it known to Mitsuba, for dictionaries and XML, in the variant that is set and in every
variant set afterwards. Its properties are those of ``VolumeSettings``, the fields of ``read_volumes``, and a nested
integrator for surfaces.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError, MissingDependencyError
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.device import is_scalar
from spectral_core.volume.march.loop import march
from spectral_core.volume.mitsuba_integrator.scene_colors import SceneColors
from spectral_core.volume.mitsuba_integrator.scene_light import Lit, surface_light
from spectral_core.volume.mitsuba_integrator.scene_march import Placed, WorldRay, march_scene
from spectral_core.volume.mitsuba_integrator.settings import SceneVolume, VolumeSettings, read_settings, read_volumes
from spectral_core.volume.plan import Plan, plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View

_registered: set[str] = set()
# Mitsuba calls plugins with denormals flushed to zero, where NumPy warns on its first look at a float type's limits.
_LIMITS = np.finfo(np.float32), np.finfo(np.float64)


def register_integrator() -> None:
    """Make `adaptive_volume` known to Mitsuba; raises where Mitsuba is absent or no variant is set."""
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


def variant_types() -> Any:
    """The Dr.Jit array module of Mitsuba's variant."""
    import drjit.cuda.ad
    import drjit.llvm.ad
    import drjit.scalar
    import mitsuba as mi

    name = mi.variant() or ""
    return drjit.llvm.ad if name.startswith("llvm") else drjit.cuda.ad if name.startswith("cuda") else drjit.scalar


class SceneFields:
    """All fields of one integrator, ready to march, and what pilot rays chose for each."""

    def __init__(self, items: list[SceneVolume], settings: VolumeSettings) -> None:
        self.items, self.settings, self.types = items, settings, variant_types()
        self.renderers = [VolumeRenderer(item.volume, self.types) for item in items]
        self.colors = [SceneColors(self.types, i.transfer, settings.light, settings.shading) for i in items]
        self.plans: list[Plan | None] = [None] * len(items)
        self.placed: list[Placed] = []

    @property
    def materials(self) -> list[str]:
        """Names of the material channels; with several fields, each with its field's name before it."""
        if len(self.items) == 1:
            return list(self.items[0].transfer.names)
        fields = [item.volume.name for item in self.items]
        # A film takes no two channels of one name, so fields that share a name are numbered.
        marks = [name if fields.count(name) == 1 else f"{name} {i + 1}" for i, name in enumerate(fields)]
        return [f"{mark}.{name}" for mark, i in zip(marks, self.items, strict=True) for name in i.transfer.names]

    def prepare(self, view: View | None) -> None:
        """Choose steps (for ``view``, else for one around each field) and put everything on the device."""
        self.placed = []
        for number, (item, renderer) in enumerate(zip(self.items, self.renderers, strict=True)):
            stepping = self._stepping(number, item, view or View.around(item.volume))
            data = renderer.prepare(item.transfer).march_input(stepping)
            matrix = item.volume.to_index
            linear = [[_number(self.types, matrix[a, b]) for b in range(3)] for a in range(3)]
            self.placed.append(Placed(data, linear, [_number(self.types, matrix[a, 3]) for a in range(3)]))

    def _stepping(self, number: int, item: SceneVolume, view: View) -> Stepping:
        wish = self.settings
        alone = len(self.items) == 1 and not wish.shading
        quadrature = wish.quadrature if alone else "midpoint"
        if wish.scale > 0 or is_scalar(self.types):
            rule = "error" if wish.rule == "auto" else wish.rule
            fixed = "midpoint" if quadrature == "auto" else quadrature
            return Stepping(rule, fixed, wish.scale or 0.7)  # type: ignore[arg-type]
        renderer = self.renderers[number]
        made = plan(renderer, view, item.transfer, wish.quality, rule=wish.rule, quadrature=quadrature)  # type: ignore[arg-type]
        self.plans[number] = made
        if made.shortfall:
            import mitsuba as mi

            mi.Log(mi.LogLevel.Warn, f"volume {item.volume.name!r}: {made.shortfall}")
        return made.stepping


def sensor_view(sensor: Any) -> View | None:
    """The View of a perspective or orthographic Mitsuba sensor; None for any other."""
    import mitsuba as mi

    known = mi.traverse(sensor)
    width, height = (int(n) for n in sensor.film().size())
    matrix = np.array(sensor.world_transform().matrix, dtype=np.float64).reshape(4, 4)
    name = sensor.class_name() if hasattr(sensor, "class_name") else type(sensor).__name__
    if "x_fov" in known:
        fov = float(np.array(known["x_fov"]).ravel()[0])
        return View(matrix, width, height, fov_deg=fov)
    if "Orthographic" in name:
        scale = float(np.linalg.norm(matrix[:3, 0]))
        matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
        return View(matrix, width, height, fov_deg=None, ortho_width=2 * scale)
    return None


def _number(types: Any, value: float) -> Any:
    import drjit as dr

    return dr.opaque(types.Float, float(value))


def _integrator_class() -> Any:
    """The integrator for the variant that is set: Mitsuba's base class is another one in each."""
    import drjit as dr
    import mitsuba as mi

    class AdaptiveVolume(mi.SamplingIntegrator):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            if mi.is_polarized:
                raise InvalidInputError("adaptive_volume knows no polarisation; use an rgb, mono or spectral variant")
            nested = {key: props[key] for key in props.keys()}  # noqa: SIM118 (no mapping)
            grids = {key: value for key, value in nested.items() if isinstance(value, mi.Volume)}
            self.surface = next((v for v in nested.values() if isinstance(v, mi.Integrator)), None)
            self.settings = read_settings(props)
            self.fields = SceneFields(read_volumes(props, grids), self.settings)
            if is_scalar(self.fields.types):
                mi.Log(mi.LogLevel.Warn, "adaptive_volume marches one ray at a time, in Python, in scalar variants")

        def render(self, scene: Any, sensor: Any = 0, *rest: Any, **named: Any) -> Any:
            camera = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
            self.fields.prepare(sensor_view(camera))
            return super().render(scene, camera, *rest, **named)

        def aov_names(self) -> list[str]:
            if not self.settings.channels:
                return []
            return ["transmittance", *(f"amount.{name}" for name in self.fields.materials)]

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            if not self.fields.placed:
                self.fields.prepare(None)
            hit = scene.ray_intersect_preliminary(ray, True, active)
            end = dr.select(hit.is_valid(), hit.t, 1e30)
            line = WorldRay(list(ray.o), list(ray.d), dr.minimum(end, ray.maxt))
            amounts, seen, light = self.march(scene, sampler, ray, line, active)
            behind, there = self.behind(scene, sampler, ray, active & (seen > 1e-5))
            channels = [seen, *amounts] if self.settings.channels else []
            return light + seen * behind, active & (there | (seen < 1.0)), channels

        def march(self, scene: Any, sampler: Any, ray: Any, line: WorldRay, active: Any) -> Any:
            """(amounts, transmittance, light) of all fields up to the first surface."""
            placed, wish = self.fields.placed, self.settings
            if wish.jitter:
                from dataclasses import replace

                vary = 0.75 + 0.5 * sampler.next_1d(active)
                placed = [replace(p, data=replace(p.data, scale=p.data.scale * vary)) for p in placed]
            colors = [color for each in self.fields.colors for color in each.at(ray.wavelengths)]
            if wish.shading:
                lit = Lit(scene, placed, colors, [m.lit for i in self.fields.items for m in i.transfer.materials], wish)
                gather = lit.gather(line, ray)
                amounts, seen, light = march_scene(placed, line, gather, mi.Spectrum(0.0), sampler)
                return amounts, seen, light
            if len(placed) == 1:
                rays, _ = placed[0].rays(line)
                out = march(placed[0].data, rays)
                amounts, seen = out.amounts, out.transmittance
            else:
                amounts, seen, _ = march_scene(placed, line)
            return amounts, seen, sum((a * c for a, c in zip(amounts, colors, strict=True)), mi.Spectrum(0.0))

        def behind(self, scene: Any, sampler: Any, ray: Any, active: Any) -> Any:
            """(light, whether there is any) from surfaces and surroundings behind the fields."""
            if self.settings.shadows:
                return surface_light(scene, sampler, ray, self.fields.placed, active, self.settings.max_depth)
            if self.surface is None:
                return mi.Spectrum(0.0), mi.Bool(False)
            light, valid, *_ = self.surface.sample(scene, sampler, mi.RayDifferential3f(ray), None, active)
            return light, valid

        def to_string(self) -> str:
            return f"AdaptiveVolume[{', '.join(item.volume.name for item in self.fields.items)}]"

    return AdaptiveVolume
