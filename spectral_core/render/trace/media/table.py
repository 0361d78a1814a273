# SPDX-License-Identifier: GPL-3.0-or-later
"""Media in objects and around them: free flight, scattering, and emission along rays.

A medium is a number, 0 for empty space. Distances are drawn by scattering alone, and absorption is a factor along the
ray, so that nothing is lost in a medium that only absorbs. A distance is weighted by its density over all wavelengths
(Wilkie et al. 2014, "Hero wavelength spectral sampling").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.trace.media import tracking
from spectral_core.render.plugins.numbers import table
from spectral_core.render.trace.media.grids import GridRow, MediumGrids
from spectral_core.render.trace.subsurface import scattering

FARTHEST = 1e12
"""Length of a ray without end in a medium."""
ONLY_BORDER = 1 << 16
"""Bit of an object without surface: rays pass it unchanged."""


@dataclass(frozen=True, slots=True, eq=False)
class MediumRow:
    """One medium: textures of scattering, absorption and emission per unit of length, and its phase function.

    ``lobes``: (n, 3) of weight, g and α: the sum of Draine's phase functions, which equal Henyey and Greenstein's at α
    0. ``grid``: factors by which it varies, None for a homogeneous medium.
    """

    scattering: Any
    absorption: Any
    glow: Any | None
    lobes: NDArray[np.float64]
    grid: GridRow | None = None


@dataclass(slots=True, eq=False)
class Flight:
    """Rays on their way to the next surface: True if they scatter before it, the distance, the factor on their light,
    and the emission along the whole way.

    ``carried``: throughput before the flight; ``reach``: length of the segment; ``share``: probability of each
    wavelength to draw the distance; ``scattering`` and ``extinction`` coefficients; ``inside``: True in a medium;
    ``ends``: True if the segment ends at a surface, which samples lights itself; ``varies``: True in a medium that
    varies, where lights are sampled from the scattering point alone.
    """

    scatters: Any
    distance: Any
    weight: Any
    glow: Any
    carried: Any
    reach: Any
    share: Any
    scattering: Any
    extinction: Any
    inside: Any
    ends: Any = True
    varies: Any = False

    @property
    def even(self) -> Any:
        """True in a homogeneous medium."""
        return self.inside & ~self.varies


class Media:
    """All media of a scene.

    ``inside``: the medium in a shape, by the shape's number, and ``ONLY_BORDER``. ``around``: the medium of the world;
    ``camera``: the one at the camera.
    """

    def __init__(self, mitsuba: Any, rows: list[MediumRow], inside: Any, around: int, camera: int) -> None:
        import drjit as dr

        self._mi, self._dr, self._rows, self._inside = mitsuba, dr, rows, inside
        self.around = dr.opaque(mitsuba.UInt32, around)
        self.begin_in(camera)
        self._lobes = max(len(row.lobes) for row in rows)
        self.glows = any(row.glow is not None for row in rows)
        self.grids: MediumGrids | None = None
        self.rewrite()

    def begin_in(self, medium: int) -> None:
        """Set the medium at the camera."""
        # an array of its own: a recorded launch distinguishes one that two numbers share
        self.camera = table(self._mi.UInt32, [medium])

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

    def coefficients(self, medium: Any, wavelengths: Any, active: Any) -> tuple[Any, Any, Any]:
        """Scattering, absorption and emission per unit of length."""
        mi, dr = self._mi, self._dr
        place = dr.zeros(mi.SurfaceInteraction3f)
        # A medium varies by its grid alone: its textures are read anywhere, at the path's wavelengths.
        place.wavelengths = wavelengths
        scatters, absorbs, glow = mi.Spectrum(0.0), mi.Spectrum(0.0), mi.Spectrum(0.0)
        for number, row in enumerate(self._rows, 1):
            here = active & (medium == number)
            scatters = dr.select(here, row.scattering.eval(place, here), scatters)
            absorbs = dr.select(here, row.absorption.eval(place, here), absorbs)
            if row.glow is not None:
                glow = dr.select(here, row.glow.eval(place, here), glow)
        return scatters, absorbs, glow

    def fly(self, path: Any, reach: Any, sampler: Any, active: Any) -> Flight:
        """Flight of a path's ray to its hit at a distance ``reach``."""
        mi, dr = self._mi, self._dr
        inside = active & (path.medium != 0)
        reach = dr.minimum(reach, FARTHEST)
        scatters, absorbs, glow = self.coefficients(path.medium, path.ray.wavelengths, inside)
        # A wavelength is chosen by its remaining contribution: the brightest one draws the distance most often.
        share = dr.abs(path.throughput * scatters)
        total = dr.sum(share)
        channels = dr.size_v(mi.Spectrum)
        share = dr.select(total > 0.0, share / dr.maximum(total, 1e-30), 1.0 / channels)
        pick, place = sampler.next_1d(), sampler.next_1d()
        chosen, below = scatters[0], share[0]
        for k in range(1, channels):
            chosen = dr.select(pick >= below, scatters[k], chosen)
            below = below + share[k]
        # A wavelength that does not scatter never collides; its distance is beyond everything.
        drawn = dr.select(chosen > 0.0, -dr.log(1.0 - place) / dr.maximum(chosen, 1e-30), FARTHEST)
        collides = inside & (drawn < reach)
        distance = dr.minimum(drawn, reach)
        event = dr.select(collides, scatters, mi.Spectrum(1.0))
        # Balance heuristic over wavelengths: the density with which any of them would have drawn this event.
        density = dr.sum(share * event * dr.exp(-scatters * distance))
        extinction = scatters + absorbs
        gained = event * dr.exp(-extinction * distance) / dr.maximum(density, 1e-30)
        weight = dr.select(inside, dr.select(density > 0.0, gained, 0.0), 1.0)
        brought = mi.Spectrum(0.0)
        if self.glows:
            # Emission is integrated along the whole way, scattered or not, so it adds no noise.
            depth = extinction * reach
            # (1 - exp(-x)) / x, by its series if that cancels
            mean = dr.select(depth > 1e-3, (1.0 - dr.exp(-depth)) / dr.maximum(depth, 1e-9), 1.0 - 0.5 * depth)
            brought = dr.select(inside, glow * reach * mean, 0.0)
        carried = mi.Spectrum(path.throughput)
        flight = Flight(collides, distance, weight, brought, carried, reach, share, scatters, extinction, inside)
        flight.varies = mi.Bool(False)
        if self.grids is not None:
            self._track(flight, path, (scatters, absorbs, glow), tracking.seed_of(pick, place), inside)
        return flight

    def is_even(self, medium: Any, active: Any) -> Any:
        """True for a homogeneous medium."""
        found = medium != 0
        return found if self.grids is None else found & ~self.grids.has(medium, active)

    def _track(self, flight: Flight, path: Any, light: tuple[Any, Any, Any], seed: Any, inside: Any) -> None:
        """Fly through media that vary."""
        mi, dr, grids = self._mi, self._dr, self.grids
        assert grids is not None
        # the closed forms above stay where the medium is homogeneous: they have less noise
        varies = inside & grids.has(path.medium, inside)
        way = grids.way(path.medium, path.ray, varies)
        way.tints = self._tints(path.ray.wavelengths, varies)
        found = tracking.fly(grids, way, flight.reach, (path.throughput, *light), seed, varies)
        names = ("scatters", "distance", "weight", "glow")
        for name, value in zip(names, found, strict=True):
            setattr(flight, name, dr.select(varies, value, getattr(flight, name)))
        flight.varies = mi.Bool(varies)

    def _tints(self, wavelengths: Any, active: Any) -> Any:
        """Red, green and blue at the wavelengths of rays; None if no grid has colors."""
        if self.grids is None or self.grids.tints is None:
            return None
        place = self._dr.zeros(self._mi.SurfaceInteraction3f)
        place.wavelengths = wavelengths
        return tuple(tint.eval(place, active) for tint in self.grids.tints)

    def clear(self, medium: Any, length: Any, ray: Any, active: Any) -> Any:
        """Transmittance of a ray through a medium, up to a distance; estimated where the medium varies."""
        dr = self._dr
        scatters, absorbs, _ = self.coefficients(medium, ray.wavelengths, active)
        length = dr.minimum(length, FARTHEST)
        passes = dr.exp(-(scatters + absorbs) * length)
        if self.grids is not None:
            varies = active & self.grids.has(medium, active)
            way = self.grids.way(medium, ray, varies)
            way.tints = self._tints(ray.wavelengths, varies)
            tracked = tracking.transmittance(self.grids, way, length, (scatters, absorbs), varies)
            passes = dr.select(varies, tracked, passes)
        return dr.select(active & (medium != 0), passes, 1.0)

    def crossed(self, before: tuple[Any, Any], shape: Any, si: Any, ways: tuple[Any, Any], active: Any) -> Any:
        """Medium, and the one around it, after a ray has hit a shape.

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
        after = dr.select(enters, inside, dr.select(own, outer, medium))
        # of nested media two are known, as for a bottle and its drink
        around = dr.select(enters, medium, dr.select(own, self.around, outer))
        return mi.UInt32(after), mi.UInt32(around)

    def inside(self, shape: Any, active: Any) -> Any:
        """The medium in a shape."""
        return self._bits(shape, active) & (ONLY_BORDER - 1)

    def is_border(self, shape: Any, active: Any) -> Any:
        """True if a shape is only the border of a medium."""
        return (self._bits(shape, active) & ONLY_BORDER) != 0

    def _bits(self, shape: Any, active: Any) -> Any:
        return self._mi.UInt32(0) if self._inside is None else self._inside.look_up(shape, active=active)

    def _lobe(self, medium: Any, k: int, active: Any) -> tuple[Any, Any, Any]:
        mi, dr = self._mi, self._dr
        start = (medium * self._lobes + k) * 3
        return tuple(dr.gather(mi.Float, self._table, start + part, active) for part in range(3))

    def phase(self, medium: Any, cosine: Any, active: Any) -> tuple[Any, Any]:
        """Value of the phase function at an angle to the forward direction, and the density of ``turned`` there."""
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

    def turned(self, medium: Any, ahead: Any, draws: tuple[Any, Any], active: Any) -> tuple[Any, Any, Any]:
        """A direction after scattering, its density and the factor on its light; ``draws``: one number and two."""
        mi, dr = self._mi, self._dr
        pick, sample = draws
        _, chosen, _ = self._lobe(medium, 0, active)
        below = self._lobe(medium, 0, active)[0]
        for k in range(1, self._lobes):
            weight, g, _ = self._lobe(medium, k, active)
            chosen = dr.select(pick >= below, g, chosen)
            below += weight
        # Directions are drawn by Henyey and Greenstein alone; Draine's factor, of mean 1, becomes a weight.
        local = scattering(mi, dr, chosen, sample)
        value, density = self.phase(medium, local.z, active)
        return mi.Frame3f(ahead).to_world(local), density, value / dr.maximum(density, 1e-20)
