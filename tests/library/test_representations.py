# SPDX-License-Identifier: GPL-3.0-or-later
"""What an interactive session shows of spectra, solutions, volumes and recordings: one line, not their arrays."""

from __future__ import annotations

import numpy as np

from spectral_core.errors import counted
from spectral_core.palette import presets, solve_palette
from spectral_core.render.relight.storages import storage_named
from spectral_core.render.relight.transport import Transport
from spectral_core.spectra.catalogue import illuminant
from spectral_core.volume.samples import sample_volume


def test_objects_with_arrays_are_shown_in_one_line() -> None:
    assert repr(illuminant("HP1")) == "Illuminant('HP1', 380–780 nm / 5 nm (81 samples))"
    assert repr(illuminant("HP1").grid) == "SpectralGrid(380–780 nm / 5 nm (81 samples), linear)"
    volume = sample_volume("engine", 16)
    assert repr(volume).startswith("ScalarVolume('engine', 16×16×16 uint8, values 0 to ")
    solution = solve_palette(presets.hidden_mark())
    assert repr(solution).startswith("PaletteSolution(solved, 2 reflectances, 2 lights, ΔE2000 2.7")
    recorded = Transport(
        storage_named("bands31"), ("Key", "Fill"), np.zeros((2, 31, 4, 6), np.float32), np.ones((4, 6), np.float32),
        (None, None), 1.0, "0" * 64, 16, 0,
    )  # fmt: skip
    assert repr(recorded) == "Transport(bands, 6×4 pixels, 16 samples, light groups ('Key', 'Fill'))"


def test_one_thing_is_singular() -> None:
    assert [counted(count, "sample") for count in (0, 1, 2)] == ["0 samples", "1 sample", "2 samples"]
    assert [counted(count, "entry", "entries") for count in (1, 2)] == ["1 entry", "2 entries"]
    assert [counted(count, "sample", form=".0f") for count in (0.9, 1.2, 1.6)] == ["1 sample", "1 sample", "2 samples"]
    assert counted(1000, "row", form=",") == "1,000 rows"
