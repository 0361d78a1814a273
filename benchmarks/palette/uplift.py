# SPDX-License-Identifier: GPL-3.0-or-later
"""One picture with pins: exactness, pins, far colors, smoothness against tetrahedra and Jakob-Hanika."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks.palette.checks.uplift_rival import rivals
from spectral_core.palette.texture.reach import stimulus_matrix
from spectral_core.palette.texture.uplift import Pin, design_uplift
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

Array = NDArray[np.float64]
PINNED = np.array([[0.6, 0.1, 0.1], [0.2, 0.5, 0.2], [0.3, 0.3, 0.7]])
FACTORS = np.array([[0.6, 0.6, 0.6], [1.3, 1.1, 0.5], [0.8, 1.2, 1.0]])


def run(options: Options) -> dict[str, Any]:
    """Every figure of acceptance line 4 of the spectral textures."""
    first, second = illuminant("D65"), illuminant("HP1")
    plain = design_uplift(first, second)
    under_first, under_second = stimulus_matrix([first]).T, stimulus_matrix([second]).T
    wanted = np.clip(plain.spectra(PINNED) @ under_second * FACTORS, 0, 1)
    started = time.process_time()
    pinned = design_uplift(first, second, [Pin(c, w) for c, w in zip(PINNED, wanted, strict=True)])
    processor = time.process_time() - started
    colors = np.random.default_rng(5).random((500 if options.quick else 2000, 3))
    exact = float(
        delta_e_2000(lab_from_linear_rgb(pinned.spectra(colors) @ under_first), lab_from_linear_rgb(colors)).max()
    )
    moved = delta_e_2000(
        lab_from_linear_rgb(pinned.spectra(colors) @ under_second),
        lab_from_linear_rgb(plain.spectra(colors) @ under_second),
    )
    far = np.linalg.norm(colors[:, None] - PINNED, axis=2).min(axis=1) > 0.45
    at_pins = [result.delta_e for result in pinned.pins]
    lattice = _second_difference(lambda c: pinned.spectra(c) @ under_second)
    tetrahedra = _second_difference(_tetrahedral(plain.spectra, pinned.spectra(PINNED), under_second))
    ratio = tetrahedra / lattice
    print(f"built in {pinned.seconds:.2f} s ({processor:.2f} s of processor time)")
    print(f"D65: largest ΔE2000 {exact:.1e} over {len(colors)} colors; pins {', '.join(f'{e:.2f}' for e in at_pins)}")
    print(f"far colors moved by ΔE2000 {moved[far].mean():.4f} in the mean, 95 % {np.percentile(moved[far], 95):.3f}")
    print(f"second difference {lattice:.4f}, tetrahedral mixing {tetrahedra:.4f}: {ratio:.1f} times smoother")
    rows = rivals(plain, options.quick)
    holds = {
        "colors are exact under the first light within ΔE2000 0.06": exact <= 0.06,
        "wanted colors are met within ΔE2000 0.3": max(at_pins) <= 0.3,
        "far colors move by ΔE2000 0.05 at most in the mean": float(moved[far].mean()) < 0.05,
        "three times smoother than tetrahedral mixing": ratio >= 3,
        "built in under 2 s (processor time)": processor < 2,
        "round trip better than Jakob-Hanika": rows["lattice"]["round_trip_max"] < rows["sigmoid"]["round_trip_max"],
        "smoother than Jakob-Hanika": rows["lattice"]["kink"] < rows["sigmoid"]["kink"],
        "Jakob-Hanika stays the one way from RGB, being the faster at render time": (
            rows["sigmoid"]["ns_per_path"] < min(rows["lattice"]["ns_per_path"], rows["eight"]["ns_per_path"])
        ),
    }
    return {
        "first_light_delta_e": exact, "pins_delta_e": at_pins, "far_moved_delta_e": float(moved[far].mean()),
        "second_difference": lattice, "tetrahedral_second_difference": tetrahedra, "smoother_by": ratio,
        "seconds": pinned.seconds, "processor_seconds": processor, "rivals": rows, "holds": holds,
    }  # fmt: skip


def _second_difference(colors_of: Any) -> float:
    """Root mean square second difference of CIELAB under the second light, in 1 % steps along random lines."""
    rng = np.random.default_rng(9)
    ends = rng.random((60, 2, 3))
    share = np.linspace(0, 1, 101)[None, :, None]
    lines = ends[:, None, 0] * (1 - share) + ends[:, None, 1] * share
    lab = lab_from_linear_rgb(colors_of(lines.reshape(-1, 3))).reshape(60, 101, 3)
    return float(np.sqrt(np.mean(np.diff(lab, 2, axis=1) ** 2)))


def _tetrahedral(spectra_of: Any, at_pins: Array, under: Array) -> Any:
    """The rival: spectra at the cube's corners and the pins, mixed barycentrically in a Delaunay tetrahedralization."""
    from scipy.spatial import Delaunay

    corners = np.array(np.meshgrid(*[[0.0, 1.0]] * 3)).reshape(3, -1).T
    points = np.concatenate([corners, PINNED])
    spectra = np.concatenate([spectra_of(corners), at_pins])
    mesh = Delaunay(points)

    def colors(wanted: Array) -> Array:
        inside = np.clip(wanted, 1e-9, 1 - 1e-9)
        cells = mesh.find_simplex(inside)
        transform = mesh.transform[cells]
        part = np.einsum("mij,mj->mi", transform[:, :3], inside - transform[:, 3])
        shares = np.concatenate([part, 1 - part.sum(axis=1, keepdims=True)], axis=1)
        return np.einsum("mk,mkn->mn", shares, spectra[mesh.simplices[cells]]) @ under

    return colors
