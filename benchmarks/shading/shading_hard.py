# SPDX-License-Identifier: GPL-3.0-or-later
"""Hard cases of node trees: extreme numbers through every Math and Vector Math operation, and unusual node trees.

Each operation reads three attributes that hold zeros, ones, negative, huge, tiny and broken numbers in all pairs; its
values are compared with what Cycles renders of the same faces, number for number. A value that is no finite number
counts as 0, as in a picture. The scenes are rendered: values that are not finite and notes on lost samples are counted,
and the mean is compared with Cycles'.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks.render.checks.shading_grid import grid_of_faces, rendered_values

NUMBERS = (0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 2.0, -2.0, 3.7, -3.7, 1e-6, -1e-6, 1e-30, 1e6, -1e6, 1e30)
BROKEN = (float("nan"), float("inf"), -float("inf"))
CLOSE = 2e-3
"""Relative difference below which two values are the same: Cycles' own approximations of powers and sines."""


def run(options: Options) -> dict[str, Any]:
    """Print a line per operation and per scene, and return the counts."""
    import bpy

    import blender_addon
    from benchmarks.render.render_features import quiet

    blender_addon.register_once()
    kinds = {
        kind: [item.identifier for item in getattr(bpy.types, kind).bl_rna.properties["operation"].enum_items]
        for kind in ("ShaderNodeMath", "ShaderNodeVectorMath")
    }
    values = differing = 0
    rows: dict[str, Any] = {}
    for kind, operations in kinds.items():
        for operation in operations[:: 6 if options.quick else 1]:
            with quiet():
                theirs, mine = _compared(kind, operation)
            differs = _differ(theirs, mine)
            rows[f"{kind[10:]} {operation}"] = {"values": int(differs.size), "differing": int(differs.sum())}
            values, differing = values + differs.size, differing + int(differs.sum())
            if differs.any():
                print(f"{kind[10:]:12} {operation:18} {differs.sum():4} of {differs.size} values differ")
    print(f"{len(rows)} operations, {values} values: {differing} differ from Cycles")
    from benchmarks.render.cases.shading_hard import SCENES, pixels_of

    scenes: dict[str, Any] = {}
    for name, build in SCENES.items():
        with quiet():
            ours, cycles, lost = pixels_of(build)
        bad = int((~np.isfinite(ours)).sum()) + lost
        scenes[name] = {"not_finite": bad, "mean": float(np.nan_to_num(ours).mean()), "cycles": float(cycles.mean())}
        print(f"{name:34} {bad} pixels not finite; mean {scenes[name]['mean']:.4f}, Cycles {cycles.mean():.4f}")
    return {
        "operations": rows,
        "values": values,
        "differing": differing,
        "scenes": scenes,
        "holds": {
            "at least 99 % of the values are Cycles'": differing <= 0.01 * values,
            "every pixel of every scene is finite": all(row["not_finite"] == 0 for row in scenes.values()),
            "every scene is as bright as in Cycles, to 3 %": all(
                abs(row["mean"] - row["cycles"]) <= 0.03 * max(row["cycles"], 0.02) for row in scenes.values()
            ),
        },
    }


def _inputs() -> NDArray[np.float32]:
    """(n, 3) numbers for three inputs: all pairs for the first two."""
    pairs = [(a, b) for a in NUMBERS for b in NUMBERS]
    rows = [(a, b, NUMBERS[k % len(NUMBERS)]) for k, (a, b) in enumerate(pairs)]
    rows += [(broken, 1.0, 2.0) for broken in BROKEN] + [(1.0, broken, 2.0) for broken in BROKEN]
    size = math.ceil(math.sqrt(len(rows)))
    rows += [(1.0, 1.0, 1.0)] * (size * size - len(rows))
    return np.array(rows, dtype=np.float32)


def _compared(kind: str, operation: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values (n, k) of an operation in Cycles and here."""
    import bpy

    from blender_addon.translate.context import Translation
    from blender_addon.translate.shading import surfaces  # noqa: F401
    from blender_addon.translate.shading.reader import Reader
    from blender_addon.translate.shading.tree import Input

    inputs = _inputs()
    size = math.isqrt(len(inputs))
    grid_of_faces(inputs, size)
    material = bpy.data.materials["Numbers"]
    tree = material.node_tree
    node = tree.nodes.new(kind)
    node.operation = operation
    free = [socket for socket in node.inputs if socket.enabled]
    for k, socket in enumerate(free):
        attribute = tree.nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = f"n{k % 3}"
        tree.links.new(attribute.outputs["Fac" if socket.type == "VALUE" else "Vector"], socket)
    output = next(socket for socket in node.outputs if socket.enabled)
    tree.links.new(output, tree.nodes["Emission"].inputs["Color"])
    theirs = rendered_values(size)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    reader = Reader(Translation.of(depsgraph, bpy.data), "Numbers", on_surface=True)
    place = Input(material.evaluated_get(depsgraph).node_tree.nodes["Emission"].inputs["Color"])
    program = reader.paint(place, None).program  # type: ignore[union-attr,arg-type]
    clean = np.nan_to_num(inputs)  # numbers that are not finite become 0 in a translated mesh

    def read(name: str, _shift: int) -> Any:
        column = clean[:, int(name[-1])]
        return column if name.startswith("attribute_factor") else (column, column, column)

    with np.errstate(all="ignore"):
        mine = np.asarray(program.evaluate(read, np.float32), dtype=np.float64).reshape(len(inputs), -1)
    whole = np.isfinite(inputs).all(1)
    mine = np.broadcast_to(mine, (len(inputs), 3))
    return theirs[whole], np.where(np.isfinite(mine), mine, 0.0)[whole]


def _differ(theirs: NDArray[np.float64], mine: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which rows differ by more than single precision and Cycles' approximations explain."""
    held = [np.clip(values, -1e30, 1e30) for values in (theirs, mine)]
    size = np.maximum(np.abs(held[0]), np.abs(held[1]))
    return np.asarray((np.abs(held[0] - held[1]) > CLOSE * size + 1e-6).any(1))
