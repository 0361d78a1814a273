# SPDX-License-Identifier: GPL-3.0-or-later
"""The lattice of ``uplift`` against Jakob and Hanika 2019 (Mitsuba's ``srgb.coeff``): round trip, smoothness, speed."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.texture.basis import design_basis
from spectral_core.palette.texture.reach import TEXTURE_GRID, stimulus_matrix
from spectral_core.palette.texture.spline import cell
from spectral_core.palette.texture.uplift import Uplift, design_uplift
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.upsample import coefficients_from_linear_rgb, upsampled

Array = NDArray[np.float64]
WAVELENGTHS_PER_PATH = 4


def rivals(uplift: Uplift, quick: bool) -> dict[str, dict[str, float]]:
    """Figures of the lattice (``lattice``), its eight-channel form (``eight``) and Jakob-Hanika (``sigmoid``)."""
    daylight = illuminant("D65")
    basis = design_basis(stimulus_matrix([daylight]), 8, floor=0.0).spectra
    eight = design_uplift(daylight, None, (), basis)
    ways: dict[str, Any] = {
        "lattice": uplift.spectra,
        "eight": eight.spectra,
        "sigmoid": lambda colors: upsampled(colors, TEXTURE_GRID.wavelengths_nm),
    }
    colors = np.random.default_rng(6).random((300 if quick else 2000, 3))
    times = _render_times(uplift, eight, 1 << (14 if quick else 20))
    rows = {}
    for name, spectra_of in ways.items():
        spectra = spectra_of(colors)
        shown = spectra @ stimulus_matrix([daylight]).T
        error = delta_e_2000(lab_from_linear_rgb(np.maximum(shown, 0)), lab_from_linear_rgb(colors))
        rough = np.sqrt(np.mean(np.sum(np.diff(spectra, 2, axis=1) ** 2, axis=1)))
        rows[name] = {
            "round_trip_max": float(error.max()), "round_trip_mean": float(error.mean()), "roughness": float(rough),
            "kink": _kink(spectra_of), "ns_per_path": times[name],
        }  # fmt: skip
        print(
            f"{name:8}: round trip ΔE2000 max {error.max():.3f}, mean {error.mean():.4f}; roughness of spectra "
            f"{rough:.4f}; second difference under HP1 {rows[name]['kink']:.4f}; {times[name]:.1f} ns per path"
        )
    return rows


def _kink(spectra_of: Any) -> float:
    """RMS second difference of CIELAB under HP1 in 1 % steps along random lines through the cube."""
    ends = np.random.default_rng(9).random((40, 2, 3))
    share = np.linspace(0, 1, 101)[None, :, None]
    lines = (ends[:, None, 0] * (1 - share) + ends[:, None, 1] * share).reshape(-1, 3)
    lab = lab_from_linear_rgb(np.maximum(spectra_of(lines) @ stimulus_matrix([illuminant("HP1")]).T, 0))
    return float(np.sqrt(np.mean(np.diff(lab.reshape(40, 101, 3), 2, axis=1) ** 2)))


def _render_times(uplift: Uplift, eight: Uplift, paths: int) -> dict[str, float]:
    """Nanoseconds per path and hit for four wavelengths from the stored data of a texel (Dr.Jit, LLVM)."""
    import drjit as dr
    from drjit.llvm import Float, UInt32

    rng = np.random.default_rng(2)
    colors = rng.random((4096, 3))
    texel = UInt32(rng.integers(0, len(colors), paths, dtype=np.uint32))
    where = [
        Float(rng.uniform(0, TEXTURE_GRID.size - 1.01, paths).astype(np.float32)) for _ in range(WAVELENGTHS_PER_PATH)
    ]
    flat: dict[str, Any] = {
        "coefficients": Float(coefficients_from_linear_rgb(colors).astype(np.float32).ravel()),
        "weights": Float(eight.weights(colors).ravel()),
        "spectra": Float(eight.basis.T.astype(np.float32).ravel()),
    }
    nodes, shares = cell(colors)
    flat |= {
        "nodes": UInt32(nodes.astype(np.uint32).ravel()), "shares": Float(shares.astype(np.float32).ravel()),
        "lattice": Float(np.asarray(uplift.lattice, dtype=np.float32).ravel()),
    }  # fmt: skip

    def sigmoid() -> list[Any]:
        a, b, c = (dr.gather(Float, flat["coefficients"], texel * 3 + k) for k in range(3))
        values = []
        for position in where:
            nm = 380.0 + 5.0 * position
            x = dr.fma(dr.fma(a, nm, b), nm, c)
            values.append(dr.fma(0.5 * x, dr.rsqrt(dr.fma(x, x, 1.0)), 0.5))
        return values

    def weighted() -> list[Any]:
        weights = [dr.gather(Float, flat["weights"], texel * 8 + k) for k in range(8)]
        values = []
        for position in where:
            low = UInt32(position)
            share = position - Float(low)
            total = Float(0.0)
            for k, weight in enumerate(weights):
                first = dr.gather(Float, flat["spectra"], low * 8 + k)
                second = dr.gather(Float, flat["spectra"], low * 8 + 8 + k)
                total = dr.fma(weight, dr.fma(second - first, share, first), total)
            values.append(total)
        return values

    def looked_up() -> list[Any]:
        count = TEXTURE_GRID.size
        values = [Float(0.0) for _ in where]
        for k in range(27):
            node = dr.gather(UInt32, flat["nodes"], texel * 27 + k) * count
            weight = dr.gather(Float, flat["shares"], texel * 27 + k)
            for number, position in enumerate(where):
                low = UInt32(position)
                first = dr.gather(Float, flat["lattice"], node + low)
                second = dr.gather(Float, flat["lattice"], node + low + 1)
                values[number] = dr.fma(weight, dr.fma(second - first, position - Float(low), first), values[number])
        return values

    found = {}
    for name, work in (("sigmoid", sigmoid), ("eight", weighted), ("lattice", looked_up)):
        times = []
        for _ in range(5):  # the first compiles
            started = time.perf_counter()
            values = work()
            dr.eval(*values)
            dr.sync_thread()
            times.append(time.perf_counter() - started)
        found[name] = 1e9 * min(times[1:]) / paths
    return found
