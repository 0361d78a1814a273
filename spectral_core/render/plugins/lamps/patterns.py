# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps whose emission varies over their surface, by direction or with distance: a shading program as a factor."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.numbers import table

FIRST_BOUNCE = 1.0
"""Bounces of a ray to a light that leaves the surface the camera sees, where nobody counts them."""


def lamp_place(point: Any, normal: Any, way: tuple[Any, Any], it: Any, bounces: Any = FIRST_BOUNCE) -> Any:
    """The point of a lamp that emits, as a surface interaction for programs.

    ``way``: direction toward the receiver, where the path has bounced, and the distance; ``it``: an interaction with
    the wavelengths; ``bounces``: what the Light Path node counts, as in the marks of a ray (``paints.ray_marks``).
    """
    import drjit as dr
    import mitsuba as mi

    toward, distance = way
    place = dr.zeros(mi.SurfaceInteraction3f)
    place.p, place.n, place.t = mi.Point3f(point), mi.Normal3f(normal), mi.Float(distance)
    place.sh_frame, place.wavelengths = mi.Frame3f(normal), it.wavelengths
    place.wi = place.to_local(toward)
    place.dn_dv = mi.Vector3f(0.0, bounces, 0.0)
    return place


class Patterns:
    """Factors of the emission by source: ``textures`` in their order, None for a source that emits evenly."""

    def __init__(self, mitsuba: Any, textures: list[Any]) -> None:
        self._mi = mitsuba
        self._textures = [texture for texture in textures if texture is not None]
        self.are_none = not self._textures
        if not self.are_none:
            numbers = iter(range(1, len(self._textures) + 1))
            self._numbers = table(mitsuba.UInt32, [0 if texture is None else next(numbers) for texture in textures])

    def of(self, source: Any, place: Any, active: Any) -> Any:
        """The factor of a source at a place (``lamp_place``)."""
        import drjit as dr

        mi = self._mi
        number = dr.gather(mi.UInt32, self._numbers, source, active)
        varied = active & (number > 0)

        def call(texture: Any) -> Any:
            return lambda place, active: mi.Spectrum(texture.eval(place, active))

        if len(self._textures) == 1:
            found = call(self._textures[0])(place, varied)
        else:
            calls = [call(texture) for texture in self._textures]
            found = dr.switch(dr.maximum(number, 1) - 1, calls, place, varied, label="lamp")
        return dr.select(varied, found, mi.Spectrum(1.0))
