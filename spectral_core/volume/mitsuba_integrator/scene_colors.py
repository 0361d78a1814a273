# SPDX-License-Identifier: GPL-3.0-or-later
"""Material colors for the renderer's variant: RGB, one luminance, or values at a ray's wavelengths."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import luminance_from_linear_rgb
from spectral_core.spectra.spectrum import WAVELENGTHS_NM
from spectral_core.volume.mitsuba_integrator.settings import SceneVolume
from spectral_core.volume.transfer import TransferFunction

Array = NDArray[np.float64]


class SceneColors:
    """Colors of K materials; ``at(wavelengths)`` gives K radiances of Mitsuba's ``Spectrum`` type.

    With ``reflectances``, lit materials have their bare reflectance (to be lit by the scene); else they are lit by
    ``light``, a catalogue illuminant scaled so that a perfect white has luminance 1.
    """

    def __init__(self, types: Any, item: SceneVolume, light: str, reflectances: bool) -> None:
        import mitsuba as mi

        transfer = item.transfer
        gains = np.ones(len(transfer.materials)) if item.gains is None else np.array(item.gains)
        self.types, self.spectral = types, mi.is_spectral
        if mi.is_spectral:
            self.first, self.step, table = _spectra(transfer, light, reflectances)
            table = table * gains[:, None]
            self.count = table.shape[1]
            self.table: Any = types.Float(table.astype(np.float32).ravel())
            self.materials = len(table)
        else:
            rgb = _shown_rgb(transfer, "D65" if reflectances else light) * gains[:, None]
            rgb = luminance_from_linear_rgb(rgb)[:, None] if mi.is_monochromatic else rgb
            self.fixed = [[_number(types, v) for v in row] for row in rgb]

    def at(self, wavelengths: Any) -> list[Any]:
        """One Spectrum per material; ``wavelengths`` in nm count in spectral variants only."""
        import mitsuba as mi

        if not self.spectral:
            return [mi.Spectrum(*row) for row in self.fixed]
        return [mi.Spectrum([self._lookup(k, wavelengths[i]) for i in range(4)]) for k in range(self.materials)]

    def _lookup(self, material: int, wavelength: Any) -> Any:
        """Linear between table entries; zero outside the table."""
        import drjit as dr

        types = self.types
        x = (wavelength - self.first) / self.step
        inside = (x >= 0) & (x <= self.count - 1)
        index = types.UInt32(dr.clip(x, 0, self.count - 2))
        part = x - types.Float(index)
        at = index + material * self.count
        low = dr.gather(types.Float, self.table, at, inside)
        high = dr.gather(types.Float, self.table, at + 1, inside)
        return dr.select(inside, dr.fma(high - low, part, low), 0.0)


def _shown_rgb(transfer: TransferFunction, light: str) -> Array:
    from spectral_core.spectra import catalogue
    from spectral_core.volume.mitsuba_integrator.illumination import display_matrix

    if light == "D65":
        return display_matrix(transfer)
    return display_matrix(transfer, catalogue.illuminant(light))


def _spectra(transfer: TransferFunction, light: str, bare: bool) -> tuple[float, float, Array]:
    """(first wavelength, spacing, (K, n) radiance) at 1 nm over the visible range; ``bare`` leaves reflectances so.

    Mitsuba's film divides by the integral of ȳ, so a flat radiance of 1 has luminance 1, as here. RGB becomes the
    reflectance of surfaces of this color; RGB of an emitting material is that reflectance times D65.
    """
    from spectral_core.volume.mitsuba_integrator.illumination import spectrum_of_color

    nm = WAVELENGTHS_NM
    if transfer.wavelengths_nm is None:
        colors = spectrum_of_color(transfer.colors, nm)
    else:
        known = transfer.wavelengths_nm
        colors = np.stack([np.interp(nm, known, c, left=0.0, right=0.0) for c in transfer.colors])
    own_light = np.ones_like(nm) if transfer.wavelengths_nm is not None else _white(nm, "D65")
    lights = [(np.ones_like(nm) if bare else _white(nm, light)) if m.lit else own_light for m in transfer.materials]
    return float(nm[0]), 1.0, colors * np.stack(lights)


def in_even_light(transfer: TransferFunction) -> TransferFunction:
    """The transfer function with materials that shine as its lit ones look in even, white light."""
    known = transfer.wavelengths_nm
    white = 1.0 if known is None else _white(known, "D65")
    return replace(
        transfer,
        materials=tuple(replace(m, lit=False, color=m.color * white) if m.lit else m for m in transfer.materials),
    )


def _white(nm: Array, light: str) -> Array:
    """The illuminant scaled to luminance 1, as Mitsuba's film counts it."""
    from spectral_core.spectra import catalogue
    from spectral_core.spectra.observer import STANDARD, observer

    viewer = observer(STANDARD)
    lamp = catalogue.illuminant(light)
    luminous = viewer.cmfs[1]
    return lamp.at(nm) * (luminous.sum() / float(luminous @ lamp.at(viewer.wavelengths_nm)))


def _number(types: Any, value: float) -> Any:
    import drjit as dr

    return dr.opaque(types.Float, float(value))
