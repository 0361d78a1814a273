# SPDX-License-Identifier: GPL-3.0-or-later
"""Analyses of a stored sweep: they read its table and write columns, or print their results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, UnknownNameError, counted, first_of
from spectral_core.explore.analysis.embedding import Variant, cluster, spectral_embedding
from spectral_core.explore.analysis.process import MAX_ROWS, propose
from spectral_core.explore.analysis.sensitivity import sobol_indices
from spectral_core.explore.features.compare import distances_to, feature_matrix, picture_features
from spectral_core.explore.features.expression import as_column
from spectral_core.explore.sweep.designs import MAX_LATTICE_DIMENSIONS, Design, DesignKind, Point, design_points
from spectral_core.explore.sweep.parameters import Value
from spectral_core.explore.sweep.region import bounding_region
from spectral_core.explore.sweep.store import TIMING_COLUMN, Store

PICTURES = "pictures"
"""The feature name of the pictures themselves."""
CANDIDATES = (2048, 256, 32)
"""Numbers of points of the region among which a proposal is searched first; the largest that the region holds."""


def features_of(store: Store, names: Sequence[str] | None) -> NDArray[np.float64]:
    """Features (rows, k) of finished rows: the named columns, or all numeric outcomes; "pictures" adds the pictures."""
    columns = store.columns()
    if not names:
        skip = {*store.project.space.names, *store.ledger.manual(), "key", TIMING_COLUMN}
        names = [name for name, values in columns.items() if name not in skip and not name.upper().startswith("FILE")
                 and as_column(values).dtype.kind == "f"]  # fmt: skip
    plain = [name for name in names if name != PICTURES]
    parts = [feature_matrix(columns, plain)] if plain else []
    lacking = {name: int(np.isnan(as_column(columns[name])).sum()) for name in plain}
    said = ", ".join(f"{name} at {count}" for name, count in lacking.items() if count)
    if said:
        print(f"note: values are missing of {said} of {len(columns['key'])} points; the column's mean is taken there")
    if PICTURES in names:
        parts.append(picture_features(store, [row.files for row in store.ledger.rows("done")]))
    if not parts:
        raise InvalidInputError("the sweep has no numeric outcomes; name features with --columns")
    return np.concatenate(parts, axis=1)


def add_embedding(store: Store, variant: Variant, names: Sequence[str] | None = None) -> None:
    """Add the columns embed_1 and embed_2."""
    where = spectral_embedding(features_of(store, names), variant)
    keys = store.columns()["key"]
    store.add_columns({f"embed_{axis + 1}": dict(zip(keys, where[:, axis].tolist(), strict=True)) for axis in range(2)})
    print(f"{counted(len(keys), 'row')} embedded ({variant}): embed_1, embed_2")


def add_clusters(store: Store, count: int, names: Sequence[str] | None = None) -> None:
    """Add the column cluster, of texts "cluster 1", "cluster 2", …"""
    numbers = cluster(features_of(store, names), count)
    keys = store.columns()["key"]
    texts = [f"cluster {number + 1}" for number in numbers]
    store.add_columns({"cluster": dict(zip(keys, texts, strict=True))})
    print(f"{counted(len(keys), 'row')} in {counted(len(set(texts)), 'cluster')}")


def add_distance(store: Store, key: str, weights: Mapping[str, float], p: float = 2.0, name: str = "distance") -> int:
    """Add a column of weighted p-norm distances to a row (thesis 6.4.2); returns how many rows have one: a row without
    a value of a weighted column has none.

    Parameters
    ----------
    store : the sweep.
    key : of the row that distances are measured from.
    weights : by column; every column counts by its share of its range. "pictures" weighs the pictures: their root mean
        square distance in CIELAB, as a share of the largest one.
    p : of the norm, 1 or more; infinity takes the largest difference.
    name : of the column.
    """
    columns = store.columns()
    keys = columns["key"]
    if key not in keys:
        raise InvalidInputError(
            f"no row has the key {key[:64]!r}; pick a point on the page, or name one of the column 'key'"
        )
    for column, weight in weights.items():
        if isinstance(weight, bool) or not isinstance(weight, int | float) or not 0 <= weight < 1e9:
            raise InvalidInputError(f"the weight of {column!r} is {weight!r}; expected a number from 0")
    row = keys.index(key)
    plain = {column: float(weight) for column, weight in weights.items() if column != PICTURES}
    parts = [feature_matrix(columns, list(plain), plain)] if plain else []
    if PICTURES in weights:
        pictures = picture_features(store, [one.files for one in store.ledger.rows("done")])
        apart = np.sqrt(np.mean((pictures - pictures[row]) ** 2, axis=1))
        parts.append(float(weights[PICTURES]) * apart[:, None] / max(float(apart.max()), 1e-300))
    if not parts or not any(weights.values()):
        raise InvalidInputError("no column has a weight; name at least one, such as lab_a=1")
    known = np.ones(len(keys), bool)
    for column in (column for column, weight in plain.items() if weight):
        found = np.isfinite(as_column(columns[column]))
        if not found[row]:
            raise InvalidInputError(f"the row {key[:64]!r} has no value of {column!r}; pick another row, or column")
        known &= found
    apart = distances_to(np.concatenate(parts, axis=1), row, p)
    measured = [float(each) if is_known else None for each, is_known in zip(apart, known, strict=True)]
    store.label(name, dict(zip(keys, measured, strict=True)))
    return int(known.sum())


def print_sensitivity(store: Store, name: str) -> list[dict[str, Any]]:
    """Print Sobol indices of a column by parameter, over the ranges and choices of the sweep's region."""
    points, values = _known(store, name)
    space, region = store.project.space, store.project.region
    found = sobol_indices(points, values, space.names, spread=partial(region.spread, space))
    if math.isnan(found[0].explained):
        checked = "too few or too similar rows to check the indices on omitted rows: they are unreliable"
    else:
        checked = f"{100 * found[0].explained:.0f} % of the variance predicted on omitted rows"
    print(f"{name}: {counted(len(values), 'row')}, {checked}")
    if region.constraints or region.ball is not None:
        print(
            "  the indices are over the ranges of the region, also where its constraints and its ball exclude settings"
        )
    width = max(len(one.name) for one in found)
    for one in found:
        print(f"  {one.name:{width}} first {_index(one.first, one.first_interval)}   "
              f"total {_index(one.total, one.total_interval)}")  # fmt: skip
    return [asdict(one) for one in found]


def _index(value: float, interval: tuple[float, float]) -> str:
    """An index with its interval; a zero that rounding made negative has no sign."""
    number, low, high = (f"{round(each, 3) + 0.0:6.3f}" for each in (value, *interval))
    return f"{number} [{low}, {high}]"


def proposed_point(store: Store, name: str) -> dict[str, Any]:
    """The point of the sweep's region with the largest expected decrease of a column; none that it has already."""
    points, values = _known(store, name)
    space, known = store.project.space, {_address(row.parameters) for row in store.ledger.rows()}
    contains = store.project.region.membership(space)

    def settled(drawn: NDArray[np.float64]) -> NDArray[np.float64]:
        """Coordinates of new points of the region; a whole number or choice has those of its value."""
        found = [space.values(one) for one in drawn]
        kept = [space.coordinates(one) for one in found if contains(one) and _address(one) not in known]
        return np.array(kept).reshape(len(kept), len(space.names))

    where, _ = propose(points, values, candidates=settled(_candidates(store)), settled=settled)
    return space.values(where)


def _candidates(store: Store) -> NDArray[np.float64]:
    """Coordinates of points all over the region of a sweep, (k, n)."""
    space, region = store.project.space, store.project.region
    kind: DesignKind = "lattice" if len(space.parameters) <= MAX_LATTICE_DIMENSIONS else "sobol"
    seed = 1 + store.project.design.seed % 2**31  # not that of the sweep, whose points are there already
    points: list[Point] = []
    for count in CANDIDATES:
        with suppress(InvalidInputError):  # the region holds fewer points
            points = design_points(space, region, Design(kind, count, seed=seed))[0]
            break
    return np.array([space.coordinates(point) for point in points]).reshape(len(points), len(space.names))


def _address(point: Mapping[str, Value]) -> tuple[tuple[str, Value], ...]:
    return tuple(sorted(point.items()))


def region_of_label(store: Store, column: str, value: str) -> dict[str, Any]:
    """The region around rows that carry a label, as a document's table, with the constraints of the sweep."""
    table = store.columns()
    if column not in table:
        raise UnknownNameError.among("column", column, table)
    rows = [number for number, text in enumerate(table[column]) if str(text) == value]
    if not rows:
        held = list(dict.fromkeys(str(text) for text in table[column] if text is not None))
        raise InvalidInputError(f"no row has {column} = {value!r}; it holds {first_of(held, len(held)) or 'nothing'}")
    points = [{name: table[name][row] for name in store.project.space.names} for row in rows]
    region = bounding_region(store.project.space, points, value)
    return region.limited_as(store.project.region).to_dict()


def _known(store: Store, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points in the unit cube and values of the rows that have one."""
    table = store.columns()
    if name not in table:
        raise UnknownNameError.among("column", name, table)
    values = as_column(table[name])
    if values.dtype.kind != "f":
        raise InvalidInputError(f"the column {name!r} holds texts; a number is needed")
    space = store.project.space
    kept = np.flatnonzero(np.isfinite(values))[:MAX_ROWS]
    points = [space.coordinates({p: table[p][row] for p in space.names}) for row in kept]
    return np.array(points).reshape(len(kept), len(space.names)), values[kept]
