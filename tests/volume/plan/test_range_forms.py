# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables over ranges of data against loops over their bins, and the settings of the integrator at their limits."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.ranges import BINS, RangeTables, _over_ranges
from spectral_core.volume.march.tables import tabulate
from spectral_core.volume.mitsuba_integrator import settings as module
from spectral_core.volume.mitsuba_integrator.settings import (
    SceneVolume,
    VolumeSettings,
    integrator_dict,
    read_settings,
    read_volumes,
    release,
    require_known,
)
from spectral_core.volume.transfer import Material, TransferFunction
from tests.volume.cases import blob, two_tents

VOLUME = ScalarVolume("v", np.linspace(0, 255, 64).reshape(4, 4, 4))
UNEVEN = TransferFunction((Material("m", [1.0, 1.001, 1.002, 200.0], [0, 2.0, 0.1, 0.3], [1, 1, 1]),))


def glowing() -> TransferFunction:
    return TransferFunction(
        (
            Material("a", [20, 70, 120], [0, 0.2, 0], [1, 1, 1], [0, 0.5, 0]),
            Material("b", [90, 150, 200], [0, 0.4, 0.5], [1, 1, 1]),
        )
    )


@pytest.mark.parametrize("transfer", [two_tents(), UNEVEN, glowing()], ids=["even", "uneven", "glowing"])
@pytest.mark.parametrize("voxel", [1e-9, 1.0, 40.0])
def test_rises_are_those_of_the_saturated_source(transfer: TransferFunction, voxel: float) -> None:
    """1 - exp(-σ·voxel) times the source per extinction; the source times the voxel where the depth is tiny."""
    ranges = RangeTables(tabulate(transfer, VOLUME), voxel)
    edges = ranges.edges
    assert len(edges) == BINS + 1 and np.all(np.diff(edges) > 0)
    saturated = np.empty((len(edges), len(transfer.materials)))
    for number, value in enumerate(edges):
        extinction, source = (each[0] for each in transfer.curves(np.array([value])))
        depth = extinction.sum() * voxel
        saturated[number] = source * voxel * (1.0 if depth <= 1e-6 else (1 - np.exp(-depth)) / depth)
    rises = np.diff(saturated, axis=0) / np.diff(edges)[:, None]
    np.testing.assert_allclose(ranges._rises, rises, atol=1e-6 * max(np.abs(rises).max(), 1e-12))
    slopes = np.abs(rises).sum(axis=1)
    padded = np.pad(rises, ((1, 1), (0, 0)), mode="edge")
    most = np.max([padded[:-2], padded[1:-1], padded[2:]], axis=0)
    least = np.min([padded[:-2], padded[1:-1], padded[2:]], axis=0)
    rng = np.random.default_rng(1)
    for low, high in np.sort(rng.integers(0, BINS, (60, 2)), axis=1):
        part = slice(low, high + 1)
        assert ranges.slope[low, high] == pytest.approx(slopes[part].max(), rel=1e-5, abs=1e-9 * slopes.max())
        change = (most[part].max(axis=0) - least[part].min(axis=0)).sum()
        assert ranges.kink[low, high] == pytest.approx(change, rel=1e-4, abs=1e-12 + 1e-6 * np.abs(rises).max())


def test_bins_are_even_where_two_of_them_lie_between_any_two_knots() -> None:
    even, uneven = (RangeTables(tabulate(each, VOLUME), 1.0) for each in (two_tents(), UNEVEN))
    assert even.is_even and not uneven.is_even
    steps = np.diff(even.edges)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-9)
    knots = uneven.table.knots
    counts = np.histogram(uneven.edges[1:-1], knots)[0]
    assert np.ptp(counts) <= 1
    for ranges in (even, uneven):
        span = ranges.table.knots[-1] - ranges.table.knots[0]
        assert ranges.edges[1] == pytest.approx(ranges.table.knots[0])
        assert ranges.edges[-2] == pytest.approx(ranges.table.knots[-1])
        assert ranges.edges[-1] - ranges.edges[-2] == pytest.approx(span / (BINS - 2))
        values = np.random.default_rng(2).uniform(ranges.edges[0], ranges.edges[-1], 500).astype(np.float32)
        found = ranges.bins(values)
        inside = (ranges.edges[found] <= values + 1e-4) & (values <= ranges.edges[found + 1] + 1e-4)
        assert inside.mean() > 0.995
        assert ranges.bins(np.float32([-1e9, 1e9])).tolist() == [0, BINS - 1]
    constant = RangeTables(tabulate(two_tents(), ScalarVolume("c", np.full((2, 2, 2), 50.0))), 1.0)
    assert np.all(np.isfinite(constant.edges)) and constant.edges[0] < 50 < constant.edges[-1]
    zero = RangeTables(tabulate(two_tents(), ScalarVolume("c", np.zeros((2, 2, 2)))), 1.0)
    assert np.all(np.diff(zero.edges) > 0)


def test_running_extremes_cover_every_range() -> None:
    values = np.random.default_rng(3).normal(size=BINS)
    most, least = _over_ranges(values, np.maximum), _over_ranges(values, np.minimum)
    for low, high in ((0, 0), (3, 9), (0, BINS - 1), (BINS - 1, BINS - 1), (100, 200)):
        assert most[low, high] == values[low : high + 1].max()
        assert least[low, high] == values[low : high + 1].min()


def test_ends_of_supports_are_visible_or_not() -> None:
    transfer = TransferFunction((Material("m", [10, 20, 20, 30], [0, 1, 0, 0], [1, 1, 1]),))
    ranges = RangeTables(tabulate(transfer, VOLUME), 1.0)
    for low, high, shown in ((0, 10, False), (0, 10.5, True), (20.5, 25, False), (19.5, 25, True), (10, 10, False)):
        assert ranges.shows(np.float32([low]), np.float32([high]))[0] == shown


@pytest.mark.parametrize(
    "wrong",
    [{"quality": 9.9}, {"quality": 90.1}, {"scale": -0.1}, {"scale": 64.1}, {"max_depth": 0}, {"rule": "none"},
     {"quadrature": "none"}],
)  # fmt: skip
def test_settings_beyond_their_limits_are_refused(wrong: dict) -> None:
    with pytest.raises((InvalidInputError, UnknownNameError)):
        VolumeSettings(**wrong)


def test_the_outermost_settings_are_accepted_and_read_back() -> None:
    for right in ({"quality": 10.0}, {"quality": 90.0}, {"scale": 0.0}, {"scale": 64.0}, {"max_depth": 1}):
        assert VolumeSettings(**right)
    assert read_settings({}) == VolumeSettings()
    assert read_settings({"quality": 55.0, "other": 3}) == VolumeSettings(quality=55.0)
    with pytest.raises(InvalidInputError, match="at least one field"):
        integrator_dict([])


def test_shared_fields_are_found_until_they_are_released() -> None:
    items = [SceneVolume(blob(4), two_tents()), SceneVolume(blob(5), two_tents())]
    made = integrator_dict(items, quality=60.0)
    handles = made["handles"].split(",")
    assert made["type"] == "adaptive_volume" and made["quality"] == 60.0 and len(set(handles)) == 2
    assert read_volumes(made, {}) == items and "surface" not in made
    assert integrator_dict(items[:1], {"type": "path"})["surface"] == {"type": "path"}
    release(handles[0])
    release(handles[0])
    with pytest.raises(InvalidInputError, match="it was released, or never shared"):
        read_volumes(made, {})
    with pytest.raises(InvalidInputError, match="has no field"):
        read_volumes({}, {})


@pytest.mark.parametrize(
    ("names", "error"),
    [(["file", "transfer", "quality"], None), (["file_a", "transfer_a"], None),
     (["volume_b", "to_world_b", "transfer_b"], None),
     (["volume", "to_world"], None), (["file", "qualty"], "quality"), (["file_a", "transfer_b"], "belongs to no field"),
     (["file_a", "to_world_b"], "belongs to no field"), (["handles", "scale"], None), (["filex"], "filex")],
)  # fmt: skip
def test_properties_must_be_known_and_belong_to_a_field(names: list[str], error: str | None) -> None:
    class Nested:
        pass

    props = {name: Nested() if name.startswith("volume") else "x" for name in names}
    if error is None:
        require_known(props, (Nested,))
    else:
        with pytest.raises((InvalidInputError, UnknownNameError), match=error):
            require_known(props, (Nested,))


def test_a_grid_of_mitsuba_is_placed_by_its_unit_cube() -> None:
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    data = np.arange(24, dtype=np.float32).reshape(4, 3, 2, 1)  # z, y, x
    grid = mi.load_dict({"type": "gridvolume", "grid": mi.VolumeGrid(data)})
    plain = module._grid_volume("g", grid, None)
    assert plain.shape == (2, 3, 4) and plain.data[1, 2, 3] == data[3, 2, 1, 0]
    np.testing.assert_allclose(plain.corners_world.min(0), 0.0, atol=1e-6)
    np.testing.assert_allclose(plain.corners_world.max(0), 1.0, atol=1e-6)
    placed = module._grid_volume("g", grid, mi.ScalarTransform4f(np.diag([2.0, 3.0, 4.0, 1.0]) + np.eye(4, k=3)))
    np.testing.assert_allclose(placed.corners_world.min(0), [1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(placed.corners_world.max(0), [3, 3, 4], atol=1e-6)
    colored = mi.load_dict({"type": "gridvolume", "grid": mi.VolumeGrid(np.ones((2, 2, 2, 3), np.float32))})
    with pytest.raises(InvalidInputError, match="g has 3 channels; expected one"):
        module._grid_volume("g", colored, None)
