# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors of the lobes at the hits of camera rays: the light that each lobe would reflect under a white sky.

Light passes are divided by these colors, so both come from the same camera rays: else a pixel of which one ray in a
hundred meets a surface would divide the light of that ray by the color of others.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene.paint import white_light
from spectral_core.render.plugins.closures.holdout import QUESTION
from spectral_core.render.plugins.closures.subsurface import DIVES
from spectral_core.render.plugins.numbers import channel_mean, table
from spectral_core.render.trace.accumulate import Accumulator
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.render.trace.lobes import drawn_parts, of_fiber
from spectral_core.spectra.spectrum import FIRST_NM, WAVELENGTHS_NM

RAREST = 1e-4
"""Least probability of a lobe that is drawn as often as others: a pane of glass reflects 1 % of light."""
SPREAD = float(np.log(1.0 / RAREST))


class LobeColors(Accumulator):
    """A tracer that sums colors of lobes. Its subclass has ``_add``, ``_colors`` and ``_drawn``."""

    _measured: Any = None
    _colors: list[str]

    def _load_white(self) -> None:
        """Make the table of the light under which a white surface appears white."""
        if self.plan is not None:
            self._white = table(self._mi.Float, white_light().at(WAVELENGTHS_NM))

    def _picks(self, sampler: Any) -> list[tuple[Any, Any]]:
        """Two numbers that draw a lobe, with their weights: one even over [0, 1), one over orders of magnitude.

        Lobes are drawn by their share of [0, 1), reflecting lobes from 0 on. The weights of a ray, by the balance
        heuristic, add up to about 1, so that each ray counts about equally.
        """
        mi, dr = self._mi, self._dr
        draws = sampler.next_2d()
        found = []
        for pick in (mi.Float(draws.x), dr.exp(-SPREAD * (1.0 - draws.y))):
            density = 1.0 + dr.select(pick >= RAREST, 1.0 / (SPREAD * dr.maximum(pick, RAREST)), 0.0)
            found.append((dr.minimum(pick, 1.0 - 1e-6), mi.Float(dr.rcp(density))))
        return found

    def _see_colors(self, hit: tuple[Any, Any], clear: Any, draws: tuple[list[Any], Any], seen: Any) -> None:
        """Colors of the lobes of a hit (interaction, BSDF), each for a direction that the surface draws."""
        picks, direction = draws
        for pick, weight in picks:
            self._see_color(hit, clear * weight, (pick, direction), seen)

    def _see_color(self, hit: tuple[Any, Any], clear: Any, draws: tuple[Any, Any], seen: Any) -> None:
        mi, dr = self._mi, self._dr
        si, bsdf = hit
        bs, weight = bsdf.sample(mi.BSDFContext(), si, *draws, seen)
        straight = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
        dives = (bs.sampled_type & DIVES) != 0
        usable = seen & ~straight & dr.all(dr.isfinite(weight))
        diffuse, glossy = drawn_parts(mi, dr, si, bsdf, bs, usable & ~dives)
        weight = dr.select(dives, weight * bs.pdf, weight)
        # the color of hair is that of its reflecting lobes, as in Cycles
        is_hair = of_fiber(mi, bsdf.flags())
        glossy = dr.select(is_hair & ~mi.has_flag(bs.sampled_type, mi.BSDFFlags.Reflection), 0.0, glossy)
        through = dr.select(is_hair, 0.0, 1.0 - diffuse - glossy)
        white = clear * self._white_at(si)
        drawn = dr.select(usable, weight, 0.0)
        beneath = dr.select(dives, drawn, 0.0)
        seen_parts = {
            "Diffuse": beneath + self._matt(hit, draws[1], seen),
            "Glossy": dr.select(dives, 0.0, drawn * glossy),
            "Transmission": dr.select(dives, 0.0, drawn * through),
        }
        for lobe in self._colors:
            color = self._measured(white * seen_parts[lobe])
            self._add(f"{lobe} Color", (color.x, color.y, color.z), seen)

    def _matt(self, hit: tuple[Any, Any], draw: Any, seen: Any) -> Any:
        """Color of the diffuse lobes alone, which no chance of drawing another lobe affects, toward both sides."""
        mi, dr = self._mi, self._dr
        si, bsdf = hit
        asked = mi.BSDFContext()
        asked.type_mask = int(mi.BSDFFlags.Diffuse)
        is_matt = seen & ((bsdf.flags() & asked.type_mask) != 0)
        out = mi.warp.square_to_cosine_hemisphere(draw)
        total = mi.Spectrum(0.0)
        for side in (1.0, -1.0):
            wo = mi.Vector3f(out.x, out.y, out.z * side)
            value = bsdf.eval_pdf(asked, si, wo, is_matt)[0]
            total += dr.select(is_matt & dr.all(dr.isfinite(value)), value * dr.pi / dr.maximum(out.z, 1e-4), 0.0)
        return total

    def _add(self, name: str, values: tuple[Any, ...], active: Any) -> None:
        """Add numbers to a pass of the pixel, if it is requested."""
        raise NotImplementedError

    def _held_out(self, first_hit: FirstHit, si: Any, bsdf: Any, seen_through: tuple[Any, Any], seen: Any) -> Any:
        """Share of a hit that is a holdout: of an object all that is not transparent, else its holdout closures."""
        dr = self._dr
        passed, hole = seen_through
        share = dr.select(hole, 1.0 - channel_mean(dr, passed), 0.0)
        if first_hit.rules is None or not first_hit.rules.has_holdout_surfaces:
            return share
        marks = self._mi.Vector3f(si.dn_dv)  # a copy: the field itself changes below
        si.dn_dv = self._mi.Vector3f(QUESTION, 0.0, 0.0)
        asked = channel_mean(dr, bsdf.eval_null_transmission(si, seen & ~hole) - passed)
        si.dn_dv = marks
        return dr.select(hole, share, asked)

    def _white_at(self, si: Any) -> Any:
        """The light under which a white surface appears white: radiance per nm, or 1."""
        mi, dr = self._mi, self._dr
        if self.plan is None:
            return mi.Spectrum(1.0)
        values = []
        for k in range(4):
            place = dr.clip(si.wavelengths[k] - FIRST_NM, 0.0, WAVELENGTHS_NM.size - 1.001)
            low = mi.UInt32(place)
            ends = [dr.gather(mi.Float, self._white, low + step) for step in (0, 1)]
            values.append(dr.lerp(*ends, place - mi.Float(low)))
        return mi.Spectrum(*values)
