# SPDX-License-Identifier: GPL-3.0-or-later
"""Emission of the sources at a path's wavelengths: rows of a table, so that many lamps need no more code than one."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.lights.listing import LightList, Source
from spectral_core.render.plugins.numbers import table
from spectral_core.render.plugins.paints import spectrum_rows
from spectral_core.spectra.spectrum import Spectrum


class Emission:
    """Emitted light by source. ``texture_of``: makes a Mitsuba texture of a spectrum that a 1 nm table cannot
    represent.
    """

    def __init__(self, mitsuba: Any, lights: LightList, *, spectral: bool, texture_of: Any) -> None:
        self._mi, self._lights, self._spectral = mitsuba, lights, spectral
        self._pointers: Any = None
        if spectral:
            self._load_spectra(lights.sources, texture_of)
        else:
            rgb = [np.zeros(3) if s.emitted is None else np.asarray(s.emitted) for s in lights.sources]
            self._colors = table(mitsuba.Float, np.array(rgb, np.float32).reshape(-1, 3))
        self._read, self._switched = -1, mitsuba.Float(1.0)

    @property
    def _gains(self) -> Any:
        """1 for sources that are on, 0 for others."""
        if self._read != self._lights.changes:
            self._read, self._switched = self._lights.changes, table(self._mi.Float, self._lights.gains)
        return self._switched

    def _load_spectra(self, sources: list[Source], texture_of: Any) -> None:
        """Store distinct spectra as rows at whole nm where that is exact, else as textures."""
        mi = self._mi
        rows: dict[bytes, int] = {}
        spectra: list[Any] = []
        textures: list[Any] = []
        index, scales = np.zeros(len(sources), np.uint32), np.zeros(len(sources))
        for number, source in enumerate(sources):
            if not isinstance(source.emitted, Spectrum) or not np.any(source.emitted.values):
                continue
            size = float(np.abs(source.emitted.values).max())
            scales[number] = size
            unit = source.emitted.scaled(1.0 / size)
            knots = unit.grid.wavelengths_nm
            exact = spectrum_rows.fits(unit)
            key = bytes([exact]) + knots.tobytes() + unit.values.astype(np.float32).tobytes()
            if key not in rows:
                if exact:
                    rows[key] = len(spectra)
                    spectra.append(spectrum_rows.row(unit))
                else:
                    rows[key] = -1 - len(textures)
                    textures.append(texture_of(unit))
            index[number] = rows[key] if rows[key] >= 0 else (1 << 24) - rows[key] - 1
        self._index, self._scales = table(mi.UInt32, index), table(mi.Float, scales)
        self._has_rows, self._kept = bool(spectra), textures
        self._table = table(mi.Float, spectra or np.zeros((1, spectrum_rows.WIDTH)))
        if textures:
            self._pointers = mi.TexturePtr(textures)

    def of(self, source: Any, wavelengths: Any, active: Any) -> Any:
        """Emitted light of a source at a path's wavelengths, where it is the same all over it."""
        import drjit as dr

        mi = self._mi
        gain = dr.gather(mi.Float, self._gains, source, active)
        if not self._spectral:
            return mi.Spectrum(dr.gather(mi.Color3f, self._colors, source, active)) * gain
        row = dr.gather(mi.UInt32, self._index, source, active)
        gain *= dr.gather(mi.Float, self._scales, source, active)
        sampled = row >= (1 << 24)
        value = mi.Spectrum(0.0)
        if self._has_rows:
            value = spectrum_rows.look_up(self._table, row, wavelengths, active & ~sampled)
        if self._pointers is not None:
            # one texture of a hundred: its pointer is read from a table, and the kernel branches on its type only
            pointer = dr.gather(mi.TexturePtr, self._pointers, row - (1 << 24), active & sampled)
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wavelengths = wavelengths
            value = dr.select(sampled, pointer.eval(si, active & sampled), value)
        return value * gain

    def gain(self, source: Any, active: Any) -> Any:
        """1 for a source that is on, 0 for one whose group is off."""
        import drjit as dr

        return dr.gather(self._mi.Float, self._gains, source, active)
