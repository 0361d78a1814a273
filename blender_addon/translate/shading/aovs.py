# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a material's AOV Output nodes, for the AOVs of the view layer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from spectral_core.scene import Paint, Scalar, gray

from .reader import Reader
from .tree import Input


def aov_outputs(reader: Reader, tree: Any) -> tuple[tuple[str, Paint | Scalar], ...]:
    """Name and value of each AOV; of two nodes with one name, the first."""
    wanted = {aov.name: aov.type for aov in reader.translation.depsgraph.view_layer_eval.aovs if aov.is_valid}
    found: dict[str, Paint | Scalar] = {}
    for node, groups in _outputs(tree) if wanted else ():
        if node.aov_name not in wanted or node.aov_name in found:
            continue
        if wanted[node.aov_name] == "VALUE":
            found[node.aov_name] = reader.scalar(Input(node.inputs["Value"], groups), 0.0)
        else:
            found[node.aov_name] = reader.paint(Input(node.inputs["Color"], groups), gray(0.0))
    return tuple(found.items())


def _outputs(tree: Any, groups: tuple[Any, ...] = ()) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """The active AOV Output nodes of a tree, then those of its groups, and the group nodes around each."""
    nodes = [] if tree is None else [node for node in tree.nodes if not node.mute]
    yield from ((node, groups) for node in nodes if node.type == "OUTPUT_AOV")
    for node in nodes:
        if node.type == "GROUP" and all(node.node_tree != group.node_tree for group in groups):
            yield from _outputs(node.node_tree, (*groups, node))
