# SPDX-License-Identifier: GPL-3.0-or-later
"""Constants that Blender itself computes, from 5.0 on, before Cycles reads the nodes."""

from __future__ import annotations

from .... import compat
from ..tree import Input, Output

COMPUTED = frozenset(
    f"ShaderNode{name}"
    for name in (
        "Blackbody", "Clamp", "CombineXYZ", "FloatCurve", "Gamma", "MapRange", "Math", "Mix", "MixRGB", "RGBCurve",
        "RadialTiling", "SeparateXYZ", "TexBrick", "TexChecker", "TexGabor", "TexGradient", "TexMagic", "TexNoise",
        "TexVoronoi", "TexWave", "TexWhiteNoise", "ValToRGB", "Value", "VectorCurve", "VectorMath", "VectorRotate",
    )
)  # fmt: skip
"""Types of the nodes whose results of constants Blender computes; the others, such as Color, are left to Cycles."""


def computed_by_blender(*places: Input | None) -> bool:
    """True if Blender computes a node of such inputs, provided that all of them are constants."""
    if not compat.computes_constants():
        return False
    waiting, seen = [place for place in places if place is not None], set()
    while waiting:
        source = waiting.pop().source()
        if not isinstance(source, Output):
            continue
        node = source.node
        if node.bl_idname not in COMPUTED:
            return False
        key = (node.as_pointer(), *(group.as_pointer() for group in source.groups))
        if key not in seen:
            seen.add(key)
            waiting += [Input(socket, source.groups) for socket in node.inputs if socket.enabled]
    return True
