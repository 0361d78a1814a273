# SPDX-License-Identifier: GPL-3.0-or-later
"""A note on values of a volume that count as missing data."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from spectral_core.volume.field import ScalarVolume


def noted(volume: ScalarVolume) -> ScalarVolume:
    """The volume, after a printed note on its values that presets and fractions leave out."""
    from spectral_core.volume.fill_values import fill_values_note

    note = fill_values_note(volume.data, volume.range_without_fill_values)
    if note:
        print(f'{volume.name}: {note}. If it is data, state the knots by value (values = "data")')
    return volume
