# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures of random settings against Cycles, value by value: near 0, at negative coordinates and at 1e5.

Each texture node gets random modes and inputs (``--seed N``, drawn and printed otherwise; ``--draws N`` of each node)
and is evaluated at random points around each center, by Cycles on faces that emit it and by the shading program. The
error of a texture is the mean absolute difference over the mean magnitude where that is above 1. One point in
200 may lie on the other side of a jump of the texture.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.render.checks.shading_grid import grid_of_faces, rendered_values

OPTIONS = ("--seed N", "--draws N")
CENTERS = {"around 0": 0.0, "negative": -37.4, "at 1e5": 1e5}
REACH = 4.0
"""Half the edge of the cube of points around each center."""
SIDE = 24
WANTED = 1e-3
NODES = ("Noise", "Voronoi", "Wave", "Magic", "Gabor", "Gradient", "Checker", "Brick", "WhiteNoise")
FAR = 1e4
"""Coordinates from which sines (of waves and magic) and octaves have no digits left in single precision, in Cycles
either: they depend on what a compiler fuses. There noise has no distortion, and the lacunarity is 2, which is exact.
"""
AT_JUMPS = 0.005
"""Share of points that may fall on the other side of a jump of the texture, by rounding, and are left out."""
PERIODIC = ("Wave", "Magic")
RANGES = {
    "Scale": (0.5, 9), "Detail": (0, 6), "Roughness": (0, 1), "Lacunarity": (1.2, 3), "Distortion": (0, 2),
    "Frequency": (1, 4), "Exponent": (0.5, 8), "Smoothness": (0, 1), "Randomness": (0, 1), "Offset": (-0.3, 0.8),
    "Gain": (0.5, 2), "Phase Offset": (-3, 3), "Detail Scale": (0.5, 3), "Detail Roughness": (0, 1),
    "Brick Width": (0.2, 0.8), "Row Height": (0.1, 0.5), "Mortar Size": (0, 0.06), "Mortar Smooth": (0, 1),
    "Anisotropy": (0, 1), "Orientation": (-2, 2), "Bias": (-0.5, 0.5),
}  # fmt: skip


def run(options: Options) -> dict[str, Any]:
    """Print a line per node and center, and return the errors."""
    import blender_addon
    from benchmarks.render.render_features import quiet

    blender_addon.register_once()
    seed = options.whole("--seed", random.SystemRandom().randrange(10**6))
    draws = options.whole("--draws", 1 if options.quick else 8)
    print(f"seed {seed}, {draws} random settings of each of {len(NODES)} nodes, {SIDE**2} points each")
    rows: dict[str, Any] = {}
    for kind in NODES:
        for name, center in CENTERS.items():
            found = []
            for number in range(draws):
                with quiet():
                    found.append(_error(kind, center, random.Random(f"{seed} {kind} {number}")))
            worst = max(found, key=lambda pair: pair[0])
            mean = float(np.mean([error for error, _ in found]))
            rows[f"{kind}, {name}"] = {"mean": mean, "worst": worst[0], "settings": worst[1], "textures": draws}
            told = f"  ({worst[1]})" if worst[0] > WANTED else ""
            print(f"{kind:11} {name:9} mean error {mean:.1e}, worst texture {worst[0]:.1e}{told}", flush=True)
    judged = {key: row for key, row in rows.items() if key not in {f"{kind}, at 1e5" for kind in PERIODIC}}
    return {
        "seed": seed,
        "rows": rows,
        "holds": {
            f"every texture has a mean error below {WANTED:g} (at 1e5 without waves, magic, distortion)": all(
                row["worst"] < WANTED for row in judged.values()
            )
        },
    }


def _error(kind: str, center: float, rng: random.Random) -> tuple[float, str]:
    """Mean error of one texture of random settings, and the settings."""
    import bpy

    from blender_addon.translate.context import Translation
    from blender_addon.translate.shading import surfaces  # noqa: F401
    from blender_addon.translate.shading.reader import Reader
    from blender_addon.translate.shading.tree import Input

    points = np.array([[center + rng.uniform(-REACH, REACH) for _ in range(3)] for _ in range(SIDE**2)], np.float32)
    grid_of_faces(points, SIDE)
    material = bpy.data.materials["Numbers"]
    tree = material.node_tree
    node = tree.nodes.new(f"ShaderNodeTex{kind}" if kind != "WhiteNoise" else "ShaderNodeTexWhiteNoise")
    told = _drawn(node, rng)
    if center > FAR:
        for name, value in (("Distortion", 0.0), ("Lacunarity", 2.0)):
            if kind in ("Noise", "Voronoi") and name in node.inputs:
                node.inputs[name].default_value = value
    vector = tree.nodes.new("ShaderNodeCombineXYZ")
    for k in range(3):
        attribute = tree.nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = f"n{k}"
        tree.links.new(attribute.outputs["Fac"], vector.inputs[k])
        further = node.inputs.get("W")
        if k == 0 and further is not None and further.enabled:
            tree.links.new(attribute.outputs["Fac"], further)
    place = node.inputs.get("Vector")  # a texture of one dimension has none
    if place is not None and place.enabled:
        tree.links.new(vector.outputs[0], place)
    output = rng.choice([socket for socket in node.outputs if socket.enabled])
    tree.links.new(output, tree.nodes["Emission"].inputs["Color"])
    theirs = rendered_values(SIDE)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    reader = Reader(Translation.of(depsgraph, bpy.data), "Numbers", on_surface=True)
    program = reader.paint(  # type: ignore[union-attr]
        Input(material.evaluated_get(depsgraph).node_tree.nodes["Emission"].inputs["Color"]),
        None,  # type: ignore[arg-type]
    ).program

    def read(name: str, _shift: int) -> Any:
        if not name.startswith("attribute"):  # coordinates that a texture of one dimension does not use
            return (np.zeros(len(points), np.float32),) * 3
        return points[:, int(name[-1])]

    with np.errstate(all="ignore"):
        mine = np.asarray(program.evaluate(read, np.float32), dtype=np.float64).reshape(len(points), -1)
    differences = np.sort(np.abs(np.broadcast_to(mine, theirs.shape) - theirs).max(axis=1))
    smooth = differences[: len(differences) - int(AT_JUMPS * len(differences))]
    error = float(smooth.mean() / max(1.0, float(np.abs(theirs).mean())))
    return error, f"{output.name}: {told}"


def _drawn(node: Any, rng: random.Random) -> str:
    """Random modes and inputs of a texture node, in words."""
    import bpy

    plain = {item.identifier for item in bpy.types.ShaderNode.bl_rna.properties}
    told = []
    for item in node.bl_rna.properties:
        if item.identifier in plain or item.is_readonly:
            continue
        if item.type == "ENUM":
            value: Any = rng.choice([choice.identifier for choice in item.enum_items])
        elif item.type == "BOOLEAN":
            value = rng.random() < 0.5
        elif item.type == "INT":
            value = rng.randint(1, 5)
        elif item.type == "FLOAT" and not item.is_array:
            value = rng.uniform(0.4, 2)
        else:
            continue
        setattr(node, item.identifier, value)
        told.append(f"{item.identifier} {value}")
    for socket in node.inputs:
        if socket.enabled and socket.name in RANGES and socket.type == "VALUE":
            socket.default_value = rng.uniform(*RANGES[socket.name])
            told.append(f"{socket.name} {socket.default_value:.3g}")
        elif socket.enabled and socket.type == "RGBA":
            socket.default_value = [rng.random() for _ in range(3)] + [1.0]
    return ", ".join(told)
