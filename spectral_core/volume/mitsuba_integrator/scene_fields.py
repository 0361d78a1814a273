# SPDX-License-Identifier: GPL-3.0-or-later
"""The fields of one integrator: on the device, with the steps that pilot rays chose for each sensor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from spectral_core.errors import MissingDependencyError
from spectral_core.llvm_library import LLVM_INSTALL_HINT
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.device.voxels import opaque_doubles
from spectral_core.volume.march.march_input import MarchInput
from spectral_core.volume.march.path import Placed
from spectral_core.volume.mitsuba_integrator.lit_rays import LitRays
from spectral_core.volume.mitsuba_integrator.scene_colors import SceneColors
from spectral_core.volume.mitsuba_integrator.settings import SceneVolume, VolumeSettings
from spectral_core.volume.mitsuba_integrator.unit_light import UnitLit, emitter_groups, sees_shadows
from spectral_core.volume.pilot.places import RayTracer, is_in_picture
from spectral_core.volume.plan import Plan, plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View

_KEPT_PLANS = 32  # sensors whose steps are remembered
_BESIDE = 128  # pixels across the view for which the steps of a field beside the picture are chosen


def variant_types() -> Any:
    """The Dr.Jit array module of Mitsuba's variant; raises MissingDependencyError for a scalar one."""
    import drjit.cuda.ad
    import drjit.llvm.ad
    import mitsuba as mi

    name = mi.variant() or ""
    if name.startswith("scalar"):
        raise MissingDependencyError(
            f"volumes are rendered by Mitsuba's llvm and cuda variants, but {name} is set; set llvm_ad_rgb or "
            f"llvm_ad_spectral, and if LLVM is missing, {LLVM_INSTALL_HINT}"
        )
    return drjit.llvm.ad if name.startswith("llvm") else drjit.cuda.ad


class SceneFields:
    """All fields of one integrator, ready to march for one sensor at a time.

    The choice of the pilot rays is cached per sensor: only the first frame of each pays for it, and a sensor that
    moves, zooms or changes its size counts as another one. ``plans`` belong to the sensor that was prepared last.
    """

    def __init__(self, items: list[SceneVolume], settings: VolumeSettings) -> None:
        self.items, self.settings, self.types = items, settings, variant_types()
        self.renderers = [VolumeRenderer(item.volume, self.types) for item in items]
        self.colors = [SceneColors(self.types, item, settings.light, settings.shading) for item in items]
        self.plans: tuple[Plan | None, ...] = (None,) * len(items)
        self.placed: list[Placed] = []
        self.shadows_planned = False
        """True if the pilot rays have seen shadows."""
        self._kept: dict[tuple[object, ...] | None, tuple[tuple[Plan | None, ...], list[Placed]]] = {}

    @property
    def materials(self) -> list[str]:
        """Names of the material channels; with several fields, each with its field's name as prefix."""
        if len(self.items) == 1:
            return list(self.items[0].transfer.names)
        fields = [item.volume.name for item in self.items]
        # Names of channels in a film are unique, so fields with equal names are numbered.
        marks = [name if fields.count(name) == 1 else f"{name} {i + 1}" for i, name in enumerate(fields)]
        return [f"{mark}.{name}" for mark, i in zip(marks, self.items, strict=True) for name in i.transfer.names]

    def those(self, visibility: str) -> list[Placed]:
        """The placed fields whose ``in_camera``, ``in_shadow`` or ``in_bounces`` is True."""
        return [placed for item, placed in zip(self.items, self.placed, strict=True) if getattr(item, visibility)]

    def of_all(self, amounts: list[Any], none: Any) -> list[Any]:
        """The amounts of every material, from those of the fields that the camera sees; ``none`` for the others."""
        left = iter(amounts)
        return [next(left) if item.in_camera else none for item in self.items for _ in item.transfer.materials]

    def prepare(self, view: View | Sequence[View] | None, scene: Any = None) -> None:
        """Choose steps and put everything on the device.

        ``view``: of the picture, or one for each field; None for a view around each.

        With ``shading``, the pilot rays are lit by the emitters of Mitsuba's ``scene``, each at one strength and one
        spectrum, so that other ones have the same steps; without it they see even light.
        """
        views: list[View | None]
        views = [view] * len(self.items) if view is None or isinstance(view, View) else [*view]
        key = None if view is None else tuple(each.key for each in views if each is not None)
        if key not in self._kept:
            while len(self._kept) >= _KEPT_PLANS:
                self._kept.pop(next(iter(self._kept)))
            self._kept[key] = self._prepared(views, scene if self.settings.shading else None)
        self.plans, self.placed = self._kept[key]

    def take_steps(self, other: SceneFields) -> None:
        """The steps of other fields of the same data and functions, whose colors may differ."""
        for key, (plans, _) in other._kept.items():
            self._kept[key] = plans, [self._place(number, made) for number, made in enumerate(plans)]
            self.plans, self.placed = self._kept[key]
        self.shadows_planned = other.shadows_planned

    def _prepared(self, views: list[View | None], scene: Any) -> tuple[tuple[Plan | None, ...], list[Placed]]:
        numbers = range(len(self.items))
        self.shadows_planned = self.settings.shadows and scene is not None and sees_shadows(scene)
        occluders: list[Placed] = []
        if self.shadows_planned:  # of the fields, with the steps of even light
            self.placed = [self._place(number, self._plan(number, views[number])) for number in numbers]
            occluders = self.those("in_shadow")
        plans = tuple(self._plan(number, views[number], scene, occluders) for number in numbers)
        for item, made in zip(self.items, plans, strict=True):
            _report(item, made)
        return plans, [self._place(number, made) for number, made in enumerate(plans)]

    def _place(self, number: int, made: Plan | None) -> Placed:
        wanted, item = self.settings, self.items[number]
        if made is None:
            rule = item.rule or wanted.rule
            rule = "error" if rule == "auto" else rule
            quadrature = "midpoint" if wanted.quadrature == "auto" else wanted.quadrature
            stepping = Stepping(rule, quadrature, wanted.scale)  # type: ignore[arg-type]
        else:
            stepping = made.stepping
        return self._in_world(number, self.renderers[number].prepare(item.transfer).march_input(stepping))

    def _in_world(self, number: int, data: MarchInput) -> Placed:
        matrix = self.items[number].volume.index_from_world
        rows = [opaque_doubles(self.types, row) for row in matrix[:3, :3]]
        return Placed(data, (rows[0], rows[1], rows[2]), opaque_doubles(self.types, matrix[:3, 3]))

    def _plan(
        self, number: int, view: View | None, scene: Any = None, occluders: list[Placed] | None = None
    ) -> Plan | None:
        """The choice of the pilot rays, lit by ``scene`` (None: evenly); None if the settings fix the steps.

        The steps of a field beside the picture are chosen for a small view around it, in even light: it may shadow what
        is in the picture, and the camera of a 3D view may turn to it.
        """
        wanted, item, renderer = self.settings, self.items[number], self.renderers[number]
        if wanted.scale > 0:
            return None
        is_beside = view is not None and not is_in_picture(view, renderer.shown_corners(item.transfer))
        around = View.around(item.volume, width=_BESIDE, height=_BESIDE) if is_beside else view
        around = around or View.around(item.volume)

        def planned(rays: RayTracer) -> Plan:
            rule, quadrature = item.rule or wanted.rule, wanted.quadrature
            return plan(rays, around, item.transfer, wanted.quality, rule=rule, quadrature=quadrature)  # type: ignore[arg-type]

        lit = [material.lit for material in item.transfer.materials]
        is_lit = scene is not None and len(scene.emitters()) > 0 and item.in_camera and any(lit)
        if is_lit and not is_beside:
            shadows = self.shadows_planned
            groups = emitter_groups(scene, item.volume, shadows=shadows)
            light = UnitLit(scene, groups, occluders or [], lit, shadows)
            made = planned(LitRays(renderer, light, self.colors[number], lambda data: self._in_world(number, data)))
            # Without an error no emitter may reach the field.
            if math.isfinite(made.estimate_db):
                return made
        return planned(renderer)


def _report(item: SceneVolume, made: Plan | None) -> None:
    """A warning in Mitsuba's log if the wanted quality is not reached."""
    import mitsuba as mi

    if made is not None and made.shortfall:
        mi.Log(mi.LogLevel.Warn, f"volume {item.volume.name!r}: {made.shortfall}")


def sensor_view(sensor: Any) -> View | None:
    """The View of a perspective or orthographic Mitsuba sensor; None for any other."""
    import mitsuba as mi

    known = mi.traverse(sensor)
    width, height = (int(n) for n in sensor.film().size())
    matrix = np.array(sensor.world_transform().matrix, dtype=np.float64).reshape(4, 4)
    name = sensor.class_name() if hasattr(sensor, "class_name") else type(sensor).__name__
    if "x_fov" in known:
        fov, right, down = (
            float(np.array(known[key]).ravel()[0]) if key in known else 0.0
            for key in ("x_fov", "principal_point_offset_x", "principal_point_offset_y")
        )
        return View(matrix, width, height, fov_deg=fov, shift=(right, -down * height / width))
    if "Orthographic" in name:
        scale = float(np.linalg.norm(matrix[:3, 0]))
        matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
        return View(matrix, width, height, fov_deg=None, ortho_width=2 * scale)
    return None
