# SPDX-License-Identifier: GPL-3.0-or-later
"""Values that mark missing data do not widen the range that fractions refer to."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.volume.documents.transfer_document import TransferDocument, stated_in_fractions
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.fill_values import fill_values_note
from spectral_core.volume.presets import preset
from spectral_core.volume.transfer import Material, TransferFunction

PLAIN = np.linspace(-2.0, 5.0, 9 * 8 * 7).reshape(9, 8, 7)


def filled(*marks: float) -> ScalarVolume:
    data = PLAIN.copy()
    for place, mark in enumerate(marks):
        data[place] = mark
    return ScalarVolume("filled", data)


@pytest.mark.parametrize("marks", [(1e20,), (-9999.0,), (-9999.0, 1e20), (-32768.0,), (-1e9,)])
def test_fractions_refer_to_the_other_values(marks):
    volume = filled(*marks)
    low, high = PLAIN[len(marks) :].min(), PLAIN.max()
    assert volume.range_without_fill_values == (low, high)
    stated = TransferDocument(
        TransferFunction((Material("m", [0.0, 0.25, 1.0], [0, 1, 0], [1, 1, 1]),)), "fraction", "voxel"
    )
    knots = stated.for_volume(volume).materials[0].values
    assert knots.tolist() == pytest.approx([low, low + 0.25 * (high - low), high])
    fractions = stated_in_fractions(preset("narrow", volume), volume).transfer.materials[0].values
    assert 0.1 < fractions.min() < fractions.max() < 0.5
    assert len(np.unique(np.float32(fractions))) == 3


@pytest.mark.parametrize("data", [PLAIN, np.arange(60).reshape(3, 4, 5), np.full((2, 2, 2), 7.0), np.eye(3)[None]])
def test_data_without_fill_values_have_their_whole_range(data):
    volume = ScalarVolume("plain", data)
    assert volume.range_without_fill_values == (data.min(), data.max())


@pytest.mark.parametrize("kind", ["uint8", "int16", "uint16", "int32", "float32", "float64"])
@pytest.mark.parametrize("labels", [(0, 1, 2, 255), (0, 1, 2, 3, 100), (0, 4, 5, 250), (-1, 0, 1, 2, 3, 120)])
def test_labels_far_from_the_others_are_data(labels, kind):
    """A segmentation names its parts by any numbers; 255 is often one of them."""
    if min(labels) < 0 and kind.startswith("u"):
        return
    data = np.resize(np.array(labels, kind), (12, 11, 10))
    volume = ScalarVolume("labels", data)
    assert volume.range_without_fill_values == (min(labels), max(labels))
    assert fill_values_note(data, volume.range_without_fill_values) is None
    stated = TransferDocument(TransferFunction((Material("m", [0.0, 1.0], [1, 1], [1, 1, 1]),)), "fraction", "voxel")
    assert stated.for_volume(volume).materials[0].values.tolist() == [min(labels), max(labels)]


def test_a_bright_voxel_is_data():
    """Missing data mark many voxels; the source in the middle of a field marks one."""
    away = np.linalg.norm(np.indices((21, 21, 21)) - 10.0, axis=0)
    data = 1.0 / np.maximum(away, 0.05) ** 2
    assert ScalarVolume("source", data).range_without_fill_values == (data.min(), data.max())


def test_a_note_tells_what_counts_as_missing():
    volume = filled(-9999.0, 1e20)
    note = fill_values_note(volume.data, volume.range_without_fill_values)
    assert note is not None
    assert note.startswith("-9999 and 1e+20 count as missing data")


def test_values_between_those_looked_at_count():
    """Of a large field only some voxels are sorted; the least value may be any other."""
    data = np.linspace(0.0, 1.0, 210**3, dtype=np.float32).reshape(210, 210, 210)
    data[1, 1, 1], data[3, 1, 1], data[5, 1, 1] = -0.5, 1.5, 1e20
    low, high = ScalarVolume("large", data).range_without_fill_values
    assert low == -0.5
    assert 0.99 < high <= 1.5


@pytest.mark.parametrize("at", [100, 101])
@pytest.mark.parametrize("mark", [-9999.0, 65535.0])
def test_a_fill_value_is_one_wherever_it_is(at, mark):
    """Between the voxels that are looked at it needed ten times the gap."""
    data = np.linspace(0.0, 5000.0, 200**3, dtype=np.float32).reshape(200, 200, 200)
    data[at, at, at] = mark
    low, high = ScalarVolume("large", data).range_without_fill_values
    assert -1.0 < low < 50.0
    assert 4950.0 < high < 5001.0
