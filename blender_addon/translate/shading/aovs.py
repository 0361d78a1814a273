# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a material's AOV Output nodes, for the AOVs of the view layer."""

from __future__ import annotations

from typing import Any

from spectral_core.scene import Paint, Scalar, gray

from .reader import Reader
from .tree import aov_nodes, input_of, wanted_aovs


def aov_outputs(reader: Reader, tree: Any) -> tuple[tuple[str, Paint | Scalar], ...]:
    """Name and value of each AOV; of two nodes with one name, the first."""
    wanted = wanted_aovs(reader.translation.depsgraph)
    found: dict[str, Paint | Scalar] = {}
    for node, groups in aov_nodes(tree) if wanted else ():
        if node.aov_name not in wanted or node.aov_name in found:
            continue
        if wanted[node.aov_name] == "VALUE":
            found[node.aov_name] = reader.scalar(input_of(node, "Value", groups), 0.0)
        else:
            found[node.aov_name] = reader.paint(input_of(node, "Color", groups), gray(0.0))
    return tuple(found.items())
