# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a material's AOV Output nodes, for the AOVs of the view layer."""

from __future__ import annotations

from typing import Any

from spectral_core.scene import Paint, Scalar, gray

from .reader import Reader
from .tree import Input


def aov_outputs(reader: Reader, tree: Any) -> tuple[tuple[str, Paint | Scalar], ...]:
    """Name and value of each AOV; of two nodes with one name, the first. A note names nodes in groups."""
    if tree is None:
        return ()
    wanted = {aov.name: aov.type for aov in reader.translation.depsgraph.view_layer_eval.aovs if aov.is_valid}
    found: dict[str, Paint | Scalar] = {}
    for node in tree.nodes:
        if wanted and node.type == "GROUP" and node.node_tree is not None and _writes(node.node_tree):
            reader.note(f"the group {node.name!r} writes to an AOV; only nodes outside of groups do so here")
        if node.type != "OUTPUT_AOV" or node.mute or node.aov_name not in wanted or node.aov_name in found:
            continue
        if wanted[node.aov_name] == "VALUE":
            found[node.aov_name] = reader.scalar(Input(node.inputs["Value"]), 0.0)
        else:
            found[node.aov_name] = reader.paint(Input(node.inputs["Color"]), gray(0.0))
    return tuple(found.items())


def _writes(tree: Any) -> bool:
    return any(node.type == "OUTPUT_AOV" for node in tree.nodes)
