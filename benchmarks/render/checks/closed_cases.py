# SPDX-License-Identifier: GPL-3.0-or-later
"""Cases that are compared with formulas, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from benchmarks.render.checks.closed_forms import Compared, absorption, lamps, prism, slab
from benchmarks.render.checks.film_forms import thin_film
from benchmarks.render.checks.fluorescent_forms import fluorescence

Case = Callable[[int, str], Iterator[Compared]]
CASES: dict[str, tuple[Case, str]] = {
    "slab": (slab, "a sheet of glass, all internal reflections"),
    "absorption": (lambda samples, _: absorption(samples), "Beer and Lambert, per wavelength"),
    "prism": (lambda samples, _: prism(samples), "Snell, per wavelength"),
    "lamps": (lamps, "I cos θ / d² from a point and a ball"),
    "thin-film": (
        lambda samples, _: thin_film(samples),
        "on glass and metal, by transfer matrices",
    ),
    "fluorescence": (lambda samples, _: fluorescence(samples), "two surfaces and a room, per wavelength"),
}
"""Name -> pairs of render and formula by (samples, transport), and a description."""
