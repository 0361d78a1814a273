# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a scene's view as plain values: read from one scene, set in a scene of another Blender."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bpy.types import Scene

from .transform import Key, settings_of, view_key

Values = dict[str, Any]
Point = tuple[tuple[float, float], str]
"""Location and handle of a point of a curve."""
FIRST = ("view_transform", "look", "use_curve_mapping", "use_white_balance", "white_balance_whitepoint")
"""Settings that come first: each limits the choices of the next, creates what others belong to, or sets others too, as
the white point sets its temperature and tint."""
CURVE_ENDS = 2
"""Points that every curve has."""


@dataclass(frozen=True)
class ViewSettings:
    """``key``: as ``view_key``. ``device``: of the display. ``view``: settings of the view. ``mapping``, ``curves``: of
    its curves, if used.
    """

    key: Key
    device: str
    view: Values
    mapping: Values
    curves: tuple[tuple[Point, ...], ...]

    @classmethod
    def of(cls, scene: Scene) -> ViewSettings:
        """Those of a scene."""
        view = scene.view_settings
        mapping = view.curve_mapping if view.use_curve_mapping else None
        points = [
            tuple(((float(p.location[0]), float(p.location[1])), p.handle_type) for p in curve.points)
            for curve in (mapping.curves if mapping else ())
        ]
        return cls(
            view_key(scene),
            scene.display_settings.display_device,
            settings_of(view),
            settings_of(mapping) if mapping else {},
            tuple(points),
        )

    def set_in(self, scene: Scene) -> bool:
        """Give a scene these settings; False if it then shows other colors, as with another working space."""
        self._set(scene)
        return view_key(scene) == self.key

    def _set(self, scene: Scene) -> None:
        scene.display_settings.display_device = self.device
        view = scene.view_settings
        for name in (*FIRST, *(each for each in self.view if each not in FIRST)):
            if name in self.view:
                setattr(view, name, self.view[name])
        if not self.curves:
            return
        mapping = view.curve_mapping
        for name, value in self.mapping.items():
            setattr(mapping, name, value)
        for curve, wanted in zip(mapping.curves, self.curves, strict=True):
            while len(curve.points) > max(CURVE_ENDS, len(wanted)):
                curve.points.remove(curve.points[1])
            for location, _ in wanted[len(curve.points) :]:
                curve.points.new(*location)
            for point, (location, handle) in zip(curve.points, wanted, strict=True):
                point.location, point.handle_type = location, handle
        mapping.update()
