# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of the AOV Output nodes of a material or world, for the AOVs of the view layer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from spectral_core.scene import Paint, Scalar, gray

from .reader import Reader
from .tree import Input, aov_nodes, input_of, wanted_aovs


def aov_outputs(reader: Reader, tree: Any) -> tuple[tuple[str, Paint | Scalar], ...]:
    """Name and value of each AOV of a material; of two nodes with one name, the first."""
    return tuple(
        (name, reader.scalar(place, 0.0) if kind == "VALUE" else reader.paint(place, gray(0.0)))
        for name, kind, place in aov_inputs(reader.translation.depsgraph, tree)
    )


def aov_inputs(depsgraph: Any, tree: Any) -> Iterator[tuple[str, str, Input]]:
    """Name, type and value's socket of each AOV of the view layer that a tree has an output for."""
    wanted, found = wanted_aovs(depsgraph), set[str]()
    for node, groups in aov_nodes(tree) if wanted else ():
        if node.aov_name in wanted and node.aov_name not in found:
            found.add(node.aov_name)
            kind = wanted[node.aov_name]
            yield node.aov_name, kind, input_of(node, "Value" if kind == "VALUE" else "Color", groups)
