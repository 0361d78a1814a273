# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of a side that do not depend on each other: spectra that share free colors belong together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.elastic import unit_of
from spectral_core.palette.qp.quadratic import Quadratic


@dataclass(frozen=True, eq=False)
class Component:
    """One part as a problem of its own; ``blocks`` and ``at``: its spectra and its unknowns in the whole."""

    problem: Quadratic
    blocks: tuple[int, ...]
    at: NDArray[np.intp]


def components(problem: Quadratic) -> list[Component]:
    """The parts of a problem, in the order of their first spectra; one part with all colors if any has no spectrum."""
    from scipy import sparse
    from scipy.sparse.csgraph import connected_components

    groups, count = len(problem.color_lower), len(problem.blocks)
    tied = np.array([_tied(block.ties, groups) for block in problem.blocks]).reshape(count, groups)
    links = sparse.bmat([[None, sparse.csr_matrix(tied)], [sparse.csr_matrix(tied.T), None]]) if groups else None
    labels = np.arange(count) if links is None else connected_components(links, directed=False)[1]
    if len(np.unique(labels)) == 1 or not set(labels[count:]) <= set(labels[:count]):
        return [Component(problem, tuple(range(count)), np.arange(problem.size))]
    known = _tied(problem.known_ties, groups, rows=True)
    return [_part(problem, labels == label, count, known) for label in dict.fromkeys(labels[:count].tolist())]


def _tied(ties: NDArray[np.float64], groups: int, *, rows: bool = False) -> NDArray[np.bool_]:
    """Free colors that any row depends on, (groups,), or each, (rows, groups)."""
    found = (ties.reshape(len(ties), groups, 3) != 0).any(axis=2)
    return np.asarray(found if rows else found.any(axis=0))


def _part(problem: Quadratic, member: NDArray[np.bool_], count: int, known: NDArray[np.bool_]) -> Component:
    blocks = tuple(member[:count].nonzero()[0].tolist())
    colors = member[count:].nonzero()[0]
    columns = (3 * colors[:, None] + np.arange(3)).ravel()
    own = known[:, colors].any(axis=1)
    part = Quadratic(
        tuple(replace(problem.blocks[k], ties=problem.blocks[k].ties[:, columns]) for k in blocks),
        problem.color_lower[colors],
        problem.color_upper[colors],
        problem.known_ties[own][:, columns],
        problem.known_targets[own],
        problem.known_weights[own],
        unit_of(problem),
    )
    ranges = [np.arange(problem.offsets[k], problem.offsets[k + 1]) for k in blocks]
    return Component(part, blocks, np.concatenate([columns, *ranges]))
