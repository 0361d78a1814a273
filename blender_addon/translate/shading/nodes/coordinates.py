# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that read the shaded point: coordinates, geometry, attributes, view, normals."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene.shading.geometry import FILTER_WIDTH, shifted_by

from ...camera import space_from_world
from ...meshes.measures import READ
from ...meshes.triangles import OF_CYCLES, OF_UV_MAP
from ...questions import distance_of_world
from ..attributes import ALPHA, NOTHING, POINT_PLACE, POINT_SIZE, view_layer_attribute
from ..fields import Value
from ..reader import NEUTRAL, Reader, evaluator
from ..tangents.nodes import is_meshless, tangent_of_geometry
from ..tree import Input, Output, linked

MOST_PROBES = 16
"""Rays that Ambient Occlusion or Bevel sends from one hit: samples of a pixel add to them, more cost time alone."""


def normal_of(reader: Reader, place: Input | None) -> Value:
    """A Normal socket: its link, else the surface's normal."""
    if place is None or linked(place) is None:
        return reader.point("normal")
    return reader.as_value(reader.field(place))


@evaluator("TEX_COORD")
def _coordinates(reader: Reader, output: Output) -> Any:
    name = output.socket.name
    if output.node.from_instancer and name in ("Generated", "UV"):
        return reader.point(f"object_attribute:INSTANCE:{name}")
    if name in ("Generated", "UV", "Window"):
        if name == "Window":
            _note_window(reader)
        return reader.point(name.lower())
    if name == "Normal":
        # Bump follows the interpolated normals of a smooth-shaded mesh, as in Cycles
        there = "normal_there" if reader.shift and reader.raised is None else "normal"
        return reader.emit("transformed", reader.point(there), settings=("NORMAL", "WORLD", "OBJECT"))
    if name == "Camera":
        return reader.emit("transformed", reader.point("position"), settings=("POINT", "WORLD", "CAMERA"))
    if name == "Reflection":
        return reader.emit("reflection", reader.point("incoming"), reader.point("normal"))
    target = output.node.object
    if target is None:
        return reader.emit("transformed", reader.point("position"), settings=("POINT", "WORLD", "OBJECT"))
    reader.translation.reads_elsewhere = True
    matrix = np.array(target.evaluated_get(reader.translation.depsgraph).matrix_world, dtype=np.float64)
    if not np.isfinite(matrix).all() or np.linalg.matrix_rank(matrix) < 4:
        return np.zeros(3)
    inverse = np.linalg.inv(matrix)
    turned = reader.emit("affine", reader.point("position"), *inverse[:3, :3])
    return reader.emit("vector_math", turned, inverse[:3, 3], 0.0, 0.0, settings=("ADD",))


def _note_window(reader: Reader) -> None:
    """Note cameras whose Window coordinates are those of no frame, or of one place in it."""
    camera = reader.translation.scene.camera
    kind = camera.data.type if camera is not None and camera.type == "CAMERA" else ""
    if kind == "PANO":
        reader.note("Window coordinates are not those of the panorama's picture, as they are in Cycles; use Camera")
    elif kind == "ORTHO" and reader.in_world:
        reader.note(
            "an orthographic camera sees one place of its Window coordinates, and in Cycles the whole frame; put the "
            "pattern on a plane behind the scene"
        )


@evaluator("UVMAP")
def _uv_map(reader: Reader, output: Output) -> Any:
    if output.node.from_instancer:
        return reader.point("object_attribute:INSTANCE:UV")
    name = output.node.uv_map
    kind = OF_UV_MAP if name in OF_CYCLES else "attribute"
    return reader.point(f"{kind}:{name}" if name else "uv")


@evaluator("NEW_GEOMETRY")
def _geometry(reader: Reader, output: Output) -> Any:
    name = output.socket.name
    if name in ("Position", "Normal", "True Normal", "Incoming"):
        return reader.point(name.lower().replace(" ", "_"))
    if name == "Tangent":
        if reader.in_world:
            reader.note(
                "the Tangent of Geometry is no number in a world; Cycles is black where it counts, here it is 0"
            )
        return np.zeros(3) if is_meshless(reader) else tangent_of_geometry(reader)
    if name == "Backfacing":
        return reader.point("backfacing", 1)
    if name == "Parametric":
        if reader.shift:
            reader.note("a bump by Parametric coordinates differs from Cycles")
        return reader.point("parametric")
    measured = {"Pointiness": "pointiness", "Random Per Island": "island"}
    if name in measured:
        return reader.emit("component", reader.point(f"{READ}{measured[name]}"), settings=(0,))
    reader.note(f"{name!r} of {output.label!r} is not computed; {NEUTRAL} was used")
    return NEUTRAL


@evaluator("OBJECT_INFO")
def _object_info(reader: Reader, output: Output) -> Any:
    name = output.socket.name
    if name in ("Location", "Color"):
        return reader.point(f"object_{name.lower()}")
    numbers = {"Alpha": "object_alpha", "Object Index": "object_index", "Random": "object_random"}
    if name in numbers:
        return reader.point(numbers[name], 1)
    if name == "Material Index":
        return float(reader.material_index)
    reader.note(f"{name!r} of {output.label!r} is not read; 0 was used")
    return 0.0


@evaluator("CAMERA")
def _camera_data(reader: Reader, output: Output) -> Any:
    with reader.shifted(0):  # this node has no slope in Cycles: a bump by it is flat
        position = reader.point("position")
    place = reader.emit("transformed", position, settings=("POINT", "WORLD", "CAMERA"))
    camera = reader.translation.scene.camera
    if reader.in_world and camera is not None:  # Cycles takes the direction for a point here
        moved = space_from_world(camera, reader.translation.render)[:3, 3]
        place = reader.emit("vector_math", place, moved, 0.0, 0.0, settings=("ADD",))
    if output.socket.name == "View Vector":
        return reader.emit("normalize", place)
    if output.socket.name == "View Z Depth":
        return reader.emit("component", place, settings=(2,))
    return reader.emit("vector_number", place, place, settings=("LENGTH",))


@evaluator("ATTRIBUTE", "VERTEX_COLOR")
def _attribute(reader: Reader, output: Output) -> Any:
    node = output.node
    name = getattr(node, "attribute_name", "") or getattr(node, "layer_name", "")
    kind = getattr(node, "attribute_type", "GEOMETRY")
    if kind == "VIEW_LAYER":
        reader.translation.reads_elsewhere = True
        return _component(output, view_layer_attribute(reader.translation.depsgraph, name))
    if kind != "GEOMETRY":
        if output.socket.name == "Alpha":
            return reader.emit("component", reader.point(f"object_attribute:{kind}{ALPHA}:{name}"), settings=(0,))
        value = reader.point(f"object_attribute:{kind}:{name}")
        return reader.emit("mean", value) if output.socket.type == "VALUE" else value
    if name in ALWAYS_THERE:
        return _always_there(reader, output, name)
    if not name and node.type == "ATTRIBUTE":  # the active color is what Color Attribute alone reads without a name
        return _component(output, NOTHING)
    if output.socket.name == "Alpha":
        kind = "attribute_alpha_color" if node.type == "VERTEX_COLOR" else "attribute_alpha"
        return reader.point(f"{kind}:{name}", 1)
    if output.socket.type == "VALUE":
        return reader.point(f"attribute_factor:{name}", 1)
    return reader.point(f"attribute:{name}")


ALWAYS_THERE = {
    "uv": "uv", "generated": "generated", "pointiness": f"{READ}pointiness", "random_per_island": f"{READ}island"
}  # fmt: skip
"""Names of attributes by which the node Attribute finds data of Cycles' own, even if the mesh has an attribute of such
a name: the inputs of programs with these data. Color Attribute finds nothing by them.
"""


def _always_there(reader: Reader, output: Output, attribute: str) -> Any:
    """An output of an attribute of ``ALWAYS_THERE``."""
    if output.node.type == "VERTEX_COLOR":
        reader.note(
            f"in Cycles, {output.label!r} finds no color {attribute!r}, a name of other data; 0 was used: rename it"
        )
        return 0.0
    name = ALWAYS_THERE[attribute]
    if output.socket.name == "Alpha":
        return 1.0
    if output.socket.type != "VALUE":
        return reader.point(name)
    if name == "generated":
        return reader.emit("mean", reader.point(name))
    return reader.emit("component", reader.point(name), settings=(0,))


def _component(output: Output, value: tuple[float, ...]) -> Any:
    """Value of an output for a constant attribute, (r, g, b, alpha)."""
    if output.socket.name == "Alpha":
        return value[3]
    return float(np.mean(value[:3])) if output.socket.type == "VALUE" else np.array(value[:3])


@evaluator("AMBIENT_OCCLUSION")
def _ambient_occlusion(reader: Reader, output: Output) -> Any:
    node, place = output.node, output.input("Distance")
    distance = reader.read(output, "Distance", 1.0)
    if place is not None and linked(place) is None and output.value("Distance") == 0:  # then the world's own
        distance = reader.literal(reader.translation.ask(distance_of_world))
    settings = (min(int(node.samples), MOST_PROBES), bool(node.inside), bool(node.only_local))
    share = reader.emit("occlusion", normal_of(reader, output.input("Normal")), distance, settings=settings)
    if output.socket.type != "RGBA":
        return share
    return reader.emit("vector_math", reader.read(output, "Color", np.ones(3)), share, 0.0, 0.0, settings=("MULTIPLY",))


@evaluator("BEVEL")
def _bevel(reader: Reader, output: Output) -> Any:
    normal, radius = reader.point("normal"), reader.read(output, "Radius", 0.05)
    bent = reader.emit("bevel", normal, radius, settings=(min(int(output.node.samples), MOST_PROBES),))
    place = output.input("Normal")
    if place is None or linked(place) is None:
        return bent
    turn = reader.emit("vector_math", bent, normal, 0.0, 0.0, settings=("SUBTRACT",))
    total = reader.emit("vector_math", normal_of(reader, place), turn, 0.0, 0.0, settings=("ADD",))
    return reader.emit("normalize", total)


@evaluator("WIREFRAME")
def _wireframe(reader: Reader, output: Output) -> Any:
    settings = (bool(output.node.use_pixel_size),)
    return reader.emit("wireframe", reader.read(output, "Size", 0.01), settings=settings)


@evaluator("POINT_INFO")
def _point_info(reader: Reader, output: Output) -> Any:
    """Outputs of a point cloud's points; 0 on what is none."""
    radius, random, is_point = (reader.emit("component", reader.point(POINT_SIZE), settings=(k,)) for k in range(3))
    name = output.socket.name
    if name == "Random":
        return random
    if name == "Radius":  # of a stretched object, that of the diagonal
        part = reader.emit("math", radius, 3**-0.5, 0.0, settings=("MULTIPLY",))
        across = reader.emit("transformed", part, settings=("VECTOR", "OBJECT", "WORLD"))
        return reader.emit("vector_number", across, across, settings=("LENGTH",))
    place = reader.emit("transformed", reader.point(POINT_PLACE), settings=("POINT", "OBJECT", "WORLD"))
    return reader.emit("vector_math", place, is_point, 0.0, 0.0, settings=("MULTIPLY",))


@evaluator("PARTICLE_INFO")
def info(reader: Reader, output: Output) -> Any:
    kind = output.node.type.partition("_")[0]
    value = reader.point(f"object_attribute:{kind}:{output.socket.name}")
    return value if output.socket.type in ("RGBA", "VECTOR") else reader.emit("component", value, settings=(0,))


@evaluator("VOLUME_INFO")
def _volume_info(reader: Reader, output: Output) -> Any:
    value = reader.point(f"attribute:{output.socket.name.lower()}")
    return value if output.socket.type == "RGBA" else reader.emit("component", value, settings=(0,))


@evaluator("FRESNEL")
def _fresnel(reader: Reader, output: Output) -> Any:
    normal = normal_of(reader, output.input("Normal"))
    return reader.emit(
        "fresnel", reader.read(output, "IOR", 1.5), normal, reader.point("incoming"), reader.point("backfacing", 1)
    )


@evaluator("LAYER_WEIGHT")
def _layer_weight(reader: Reader, output: Output) -> Any:
    normal, incoming = normal_of(reader, output.input("Normal")), reader.point("incoming")
    blend = reader.read(output, "Blend", 0.5)
    if output.socket.name == "Fresnel":
        return reader.emit("layer_fresnel", blend, normal, incoming, reader.point("backfacing", 1))
    return reader.emit("layer_facing", blend, normal, incoming)


KEPT = ("NORMAL", "HUE_SAT", "MAP_RANGE", "VECTOR_ROTATE", "VECT_TRANSFORM")
"""Nodes whose results Cycles computes at each hit, even of constants."""


def _is_folded(reader: Reader, place: Input | None) -> bool:
    """True if Cycles computes an input ahead of the render, which counts as no link to a Bump node without a slope."""
    source = linked(place)
    return source is not None and source.node.type not in KEPT and normal_of(reader, place).constant is not None


@evaluator("BUMP")
def _bump(reader: Reader, output: Output) -> Any:
    normal = normal_of(reader, output.input("Normal"))
    height = output.input("Height")
    if height is None or reader.as_value(reader.field(height)).constant is not None:
        return reader.point("normal") if _is_folded(reader, output.input("Normal")) else normal
    heights, steps = [], []
    width = float(getattr(output.node.inputs.get("Filter Width"), "default_value", FILTER_WIDTH))
    for axis in range(3):
        with reader.shifted(shifted_by(axis, round(width, 3)) if axis else 0):
            heights.append(reader.as_value(reader.field(height)))
            steps.append(reader.point("step_x" if axis == 1 else "step_y"))
    sign = -1.0 if output.node.invert else 1.0
    distance = reader.emit("math", reader.read(output, "Distance", 1.0), sign, 0.0, settings=("MULTIPLY",))
    return reader.emit("bump", normal, reader.read(output, "Strength", 1.0), distance, *heights, *steps[1:])
