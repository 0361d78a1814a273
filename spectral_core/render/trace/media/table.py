# SPDX-License-Identifier: GPL-3.0-or-later
"""Media in objects and around them: their coefficients, phase functions and borders.

A medium is a number, 0 for empty space. A ray knows the innermost medium at its place and the one around that; where
objects with media overlap, or are in the world's medium, their media add up. As in Cycles, rays that do not see an
object pass its border without entering or leaving its medium, and the medium takes nothing from shadow rays that do not
see it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.numbers import channel_mean, table
from spectral_core.render.trace.below.guide import scattering
from spectral_core.render.trace.media.grids import GridRow, MediumGrids
from spectral_core.scene import Rays

FARTHEST = 1e12
"""Length of a ray without end in a medium."""
NUMBER = (1 << 16) - 1
"""Bits of a medium's number."""
ONLY_BORDER = 1 << 16
"""Bit of an object without surface: rays pass it unchanged."""
HIDDEN = 17
"""Lowest of the bits of ``Rays`` that do not see a medium."""
IN_MEDIUM = 1 << 31
"""Bit of a receiver of light that is a medium: the rest is its number, which else is that of a shape."""


@dataclass(frozen=True, slots=True, eq=False)
class MediumRow:
    """One medium: textures of scattering, absorption and emission per unit of length, and its phase function.

    ``lobes``: (n, 3) of weight, g and α: the sum of Draine's phase functions, which equal Henyey and Greenstein's at α
    0. ``grid``: factors by which it varies, None for a homogeneous medium. ``group``: light group of its emission.
    """

    scattering: Any
    absorption: Any
    emission: Any | None
    lobes: NDArray[np.float64]
    grid: GridRow | None = None
    group: str = ""


@dataclass(frozen=True, slots=True)
class MediaAround:
    """Numbers of the world's medium and of the two innermost ones at the camera; ``overlap``: True if media of objects
    overlap; ``eye``: where the camera's are, (3,), if its rays may begin in others; None if all begin in these.
    """

    world: int = 0
    camera: tuple[int, int] = (0, 0)
    overlap: bool = False
    eye: tuple[float, float, float] | None = None


@dataclass(slots=True, eq=False)
class Part:
    """A medium at a point, and its scattering per unit of length there."""

    medium: Any
    scattering: Any


class Media:
    """All media of a scene.

    ``inside``: the medium in a shape, by the shape's number, and the bits above; ``hides``: True if some rays do not
    see one of them. ``around``: the medium of the world; ``camera``: the one at the camera and the one around that;
    ``eye``: as in ``MediaAround``.
    """

    def __init__(self, mitsuba: Any, rows: list[MediumRow], inside: Any, at: MediaAround, *, hides: bool) -> None:
        import drjit as dr

        self._mi, self._dr, self._rows, self._inside, self.hides = mitsuba, dr, rows, inside, hides
        self._overlap, self._in_world = at.overlap, at.world != 0 and inside is not None
        self.around = dr.opaque(mitsuba.UInt32, at.world)
        self.begin_in(at.camera)
        # read from memory, so that a moving camera needs no new kernel
        self.eye = None if at.eye is None else [table(mitsuba.Float, [value]) for value in at.eye]
        self._lobes = max(len(row.lobes) for row in rows)
        self.emits = any(row.emission is not None for row in rows)
        self.grids: MediumGrids | None = None
        self.rewrite()

    def begin_in(self, camera: tuple[int, int]) -> None:
        """Set the media at the camera, the innermost one first."""
        # arrays of their own: a recorded launch distinguishes one that two numbers share
        self.camera = tuple(table(self._mi.UInt32, [number]) for number in camera)

    def rewrite(self) -> None:
        """Write the tables again, after rows were exchanged for others of equal structure."""
        rows = self._rows
        numbers = np.zeros((len(rows) + 1, self._lobes, 3), np.float32)
        # Row 0 is empty space: one isotropic lobe, so that no lookup needs a case for it.
        numbers[0, 0, 0] = 1.0
        for number, row in enumerate(rows, 1):
            numbers[number, : len(row.lobes)] = row.lobes
        self._table = table(self._mi.Float, numbers)
        if any(row.grid is not None for row in rows):
            self.grids = MediumGrids(self._mi, [row.grid for row in rows])

    def present(self, media: tuple[Any, Any], is_shadow: Any = False) -> list[Any]:
        """Numbers of the media at a place, whose coefficients add up; 0 for none. ``media``: the innermost one, and the
        one around that; ``is_shadow``: True for shadow rays.
        """
        mi, dr = self._mi, self._dr
        medium, outer = media
        found = [mi.UInt32(medium)]
        # Each slot costs code for all media, so a scene has only as many as can be full.
        if self._overlap or self._in_world:
            found.append(mi.UInt32(dr.select(medium != self.around, outer, 0)))
        if self._overlap and self._in_world:
            found.append(mi.UInt32(dr.select((medium != self.around) & (outer != self.around), self.around, 0)))
        if not self.hides:
            return found
        unseen = [mi.Bool(is_shadow) & ((each >> HIDDEN & int(Rays.SHADOW)) != 0) for each in found]
        return [mi.UInt32(dr.select(no, 0, each & NUMBER)) for each, no in zip(found, unseen, strict=True)]

    def coefficients(self, medium: Any, wavelengths: Any, active: Any) -> tuple[Any, Any, Any]:
        """Scattering, absorption and emission per unit of length."""
        mi, dr = self._mi, self._dr
        place = dr.zeros(mi.SurfaceInteraction3f)
        # A medium varies by its grid alone: its textures are read anywhere, at the path's wavelengths.
        place.wavelengths = wavelengths
        scatters, absorbs, emission = mi.Spectrum(0.0), mi.Spectrum(0.0), mi.Spectrum(0.0)
        for number, row in enumerate(self._rows, 1):
            here = active & (medium == number)
            scatters = dr.select(here, row.scattering.eval(place, here), scatters)
            absorbs = dr.select(here, row.absorption.eval(place, here), absorbs)
            if row.emission is not None:
                emission = dr.select(here, row.emission.eval(place, here), emission)
        return scatters, absorbs, emission

    def varies(self, medium: Any, active: Any) -> Any:
        """True for a medium that varies."""
        return self._mi.Bool(False) if self.grids is None else self.grids.has(medium, active)

    def tints(self, wavelengths: Any, active: Any) -> Any:
        """``Tints`` at wavelengths; None if no grid has colors."""
        if self.grids is None:
            return None
        place = self._dr.zeros(self._mi.SurfaceInteraction3f)
        place.wavelengths = wavelengths
        return self.grids.tints(lambda texture: texture.eval(place, active))

    def crossed(self, before: tuple[Any, Any], shape: Any, si: Any, ways: tuple[Any, Any], active: Any) -> Any:
        """Medium, and the one around it, after a ray has hit a shape that it sees.

        ``before``: both before the hit; ``ways``: directions of the ray to the shape and away from it.
        """
        mi, dr = self._mi, self._dr
        medium, outer = before
        inside = self.inside(shape, active)
        to, away = (dr.dot(si.n, way) for way in ways)
        # A reflection stays on its side: only a ray that passes through the surface changes the medium.
        through = active & (inside != 0) & (to * away > 0.0)
        enters, leaves = through & (away < 0.0), through & (away > 0.0)
        own = leaves & (medium == inside)
        # objects that overlap may be left in any order
        other = leaves & ~own & (outer == inside)
        after = dr.select(enters, inside, dr.select(own, outer, medium))
        # of nested media two are known beside that of the world, as for a bottle and its drink
        around = dr.select(enters, medium, dr.select(own | other, self.around, outer))
        return mi.UInt32(after), mi.UInt32(around)

    def inside(self, shape: Any, active: Any) -> Any:
        """The medium in a shape, and its own bits."""
        return self._bits(shape, active) & ~self._mi.UInt32(ONLY_BORDER)

    def is_border(self, shape: Any, active: Any) -> Any:
        """True if a shape is only the border of a medium."""
        return (self._bits(shape, active) & ONLY_BORDER) != 0

    def _bits(self, shape: Any, active: Any) -> Any:
        return self._mi.UInt32(0) if self._inside is None else self._inside.look_up(shape, active=active)

    def _lobe(self, medium: Any, k: int, active: Any) -> tuple[Any, Any, Any]:
        mi, dr = self._mi, self._dr
        start = (medium * self._lobes + k) * 3
        return tuple(dr.gather(mi.Float, self._table, start + part, active) for part in range(3))

    def phase(self, parts: list[Part], cosine: Any, active: Any) -> tuple[Any, Any]:
        """Value of the phase function at an angle to the forward direction, and the density of ``turned`` there.

        Media that overlap scatter by their coefficients: the value may differ by wavelength.
        """
        mi, dr = self._mi, self._dr
        if len(parts) == 1:
            return self._phase_of(parts[0].medium, cosine, active)
        value, density, total = mi.Spectrum(0.0), mi.Float(0.0), mi.Spectrum(0.0)
        for part, share in zip(parts, self._shares(parts), strict=True):
            one, drawn = self._phase_of(part.medium, cosine, active)
            value += part.scattering * one
            total += part.scattering
            density += share * drawn
        return value * dr.rcp(dr.maximum(total, 1e-30)), density

    def _shares(self, parts: list[Part]) -> list[Any]:
        """Probability of each medium to turn a path."""
        mi, dr = self._mi, self._dr
        # One choice for all wavelengths: the phase function's value per wavelength makes up for it as a weight.
        means = [mi.Float(channel_mean(dr, part.scattering)) for part in parts]
        total = sum(means[1:], means[0])
        # a path without any scattering does not turn
        return [mean * dr.rcp(dr.maximum(total, 1e-30)) for mean in means]

    def _phase_of(self, medium: Any, cosine: Any, active: Any) -> tuple[Any, Any]:
        mi, dr = self._mi, self._dr
        value, density = mi.Float(0.0), mi.Float(0.0)
        for k in range(self._lobes):
            weight, g, alpha = self._lobe(medium, k, active)
            square = g * g
            base = (1.0 - square) / (4.0 * dr.pi)
            # At g near 1 and in forward direction the denominator vanishes in single precision.
            bend = dr.maximum(1.0 + square - 2.0 * g * cosine, 1e-9)
            plain = weight * base / (bend * dr.sqrt(bend))
            density += plain
            value += plain * (1.0 + alpha * cosine * cosine) / (1.0 + alpha * (1.0 + 2.0 * square) / 3.0)
        return value, density

    def turned(self, parts: list[Part], ahead: Any, draws: tuple[Any, Any], active: Any) -> tuple[Any, Any, Any]:
        """A direction after scattering, its density and the factor on its light; ``draws``: one number and two."""
        mi, dr = self._mi, self._dr
        pick, sample = draws
        chosen, below = mi.Float(0.0), mi.Float(0.0)
        shares = self._shares(parts) if len(parts) > 1 else [mi.Float(1.0)]
        for part, share in zip(parts, shares, strict=True):
            for k in range(self._lobes):
                weight, g, _ = self._lobe(part.medium, k, active)
                chosen = dr.select((pick >= below) & (weight > 0.0), g, chosen)
                below += share * weight
        # Directions are drawn by Henyey and Greenstein alone; Draine's factor, of mean 1, becomes a weight.
        local = scattering(mi, dr, chosen, sample)
        value, density = self.phase(parts, local.z, active)
        return mi.Frame3f(ahead).to_world(local), density, value / dr.maximum(density, 1e-20)
