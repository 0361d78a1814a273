# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture nodes: images, and patterns that are computed at the hit point."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import SpectralError

from .... import compat
from ....properties.texture import NODE
from ...questions import StateOfFile
from ..fields import Value
from ..image_files import MISSING
from ..images import alpha_is_read, image_of_node, tiles_of_node
from ..reader import NEUTRAL, Reader, evaluator
from ..texture import file_of, spectral_image_of
from ..tree import Output

PICTURES = ("TEX_IMAGE", "TEX_ENVIRONMENT", "TEX_SKY")
"""Textures whose panel acts on a Vector that is the same everywhere, too; that of patterns does not, in Cycles."""


def place_of(reader: Reader, output: Output, implicit: str) -> Value:
    """Coordinates of a texture node: its Vector, else its implicit ones, through its Texture Mapping panel."""
    socket = output.input("Vector")
    if socket is None or socket.source() == socket:
        place = reader.point(implicit)
    else:  # an input of a group that nothing is linked to has its own value, as in Cycles
        place = reader.as_value(reader.field(socket))
        if place.constant is not None and output.node.type not in PICTURES:
            return place
    return _through_panel(reader, output.node, place)


def _through_panel(reader: Reader, node: Any, place: Value) -> Value:
    """The Texture Mapping of the sidebar. Its limits have no effect in Cycles, so they have none here."""
    panel = getattr(node, "texture_mapping", None)
    if panel is None:
        return place
    matrix = _panel_matrix(panel)
    if not np.array_equal(matrix, np.eye(4)):
        place = reader.emit("affine", place, *matrix[:3, :3])
        place = reader.emit("vector_math", place, matrix[:3, 3], 0.0, 0.0, settings=("ADD",))
    # Cycles normalizes directions, unless the panel changes nothing
    if panel.vector_type == "NORMAL" and (any(panel.translation) or not np.array_equal(matrix, np.eye(4))):
        place = reader.emit("vector_math", place, 0.0, 0.0, 0.0, settings=("NORMALIZE",))
    return place


def is_moved_by_panel(node: Any) -> bool:
    """True if the Texture Mapping of the sidebar changes a texture's coordinates."""
    return not np.array_equal(_panel_matrix(node.texture_mapping), np.eye(4))


def _panel_matrix(panel: Any) -> NDArray[np.float64]:
    """The affine map (4, 4) of a Texture Mapping panel (Cycles' ``TextureMapping::compute_transform``)."""
    scale = np.array(panel.scale[:], dtype=np.float64)
    matrix = np.eye(4)
    matrix[:3, :3] = _rotation(np.array(panel.rotation[:], dtype=np.float64)) @ np.diag(scale)
    if panel.vector_type in ("POINT", "TEXTURE"):
        matrix[:3, 3] = panel.translation[:]
    if panel.vector_type in ("TEXTURE", "NORMAL") and np.linalg.matrix_rank(matrix) == 4:
        matrix = np.linalg.inv(matrix)
        matrix = matrix.T if panel.vector_type == "NORMAL" else matrix
    axes = np.zeros((4, 4))
    axes[3, 3] = 1
    for row, name in enumerate(("mapping_x", "mapping_y", "mapping_z")):
        chosen = getattr(panel, name)
        if chosen != "NONE":
            axes[row, "XYZ".index(chosen)] = 1
    return np.asarray(matrix @ axes)


@evaluator("CUSTOM GROUP")
def _spectral_texture(reader: Reader, output: Output) -> Any:
    """The extension's own node; nodes of other add-ons are unsupported."""
    if output.node.bl_idname != NODE:
        return reader.unknown(output)
    try:
        if output.node.filepath:
            reader.translation.ask(StateOfFile(str(file_of(output.node))))
        return spectral_image_of(output.node)
    except SpectralError as error:
        reader.note(f"Spectral Texture {output.node.name!r}: {error}; a neutral gray was used")
        return np.full(3, NEUTRAL)


@evaluator("TEX_IMAGE")
def _image(reader: Reader, output: Output) -> Any:
    node = output.node
    is_alpha = output.socket.name == "Alpha"
    if node.image is not None and node.image.source == "TILED" and node.projection != "BOX":
        return _tiled(reader, output)
    texture = image_of_node(reader.translation, output, reader.owner)
    if texture is None:
        return 1.0 if is_alpha else np.array(MISSING)
    unassociates = alpha_is_read(reader.translation, output) and texture.pixels.shape[2] == 4
    place = place_of(reader, output, "uv")
    if node.projection == "BOX":
        normal = reader.emit("transformed", reader.point("normal"), settings=("NORMAL", "WORLD", "OBJECT"))
        blend = float(node.projection_blend)
        found = reader.emit("image_box", place, normal, settings=(unassociates, blend), data=texture)
        return reader.emit("component", found, settings=(0,)) if is_alpha else found
    if node.projection in ("SPHERE", "TUBE"):
        place = reader.emit("round_coordinates", place, settings=(node.projection,))
    found = reader.emit("image_color", place, settings=(unassociates,), data=texture)
    return reader.emit("component", found, settings=(0,)) if is_alpha else found  # alpha is an image of one channel


def _tiled(reader: Reader, output: Output) -> Any:
    """A UDIM set: each tile where its coordinates are, magenta elsewhere, as in Cycles."""
    node, is_alpha = output.node, output.socket.name == "Alpha"
    place = place_of(reader, output, "uv")
    if node.projection in ("SPHERE", "TUBE"):
        place = reader.emit("round_coordinates", place, settings=(node.projection,))
    groups = tiles_of_node(reader.translation, output)
    known = tuple(number for numbers, _ in groups for number in numbers)
    outside = reader.emit("outside_tiles", place, settings=known)
    total = reader.emit(
        "vector_math", np.array((1.0, 1.0, 1.0) if is_alpha else MISSING), outside, 0.0, 0.0, settings=("MULTIPLY",)
    )
    for numbers, texture in groups:
        unassociates = alpha_is_read(reader.translation, output) and texture.pixels.shape[2] == 4
        part = reader.emit("image_tiles", place, settings=(unassociates, *numbers), data=texture)
        total = reader.emit("vector_math", total, part, 0.0, 0.0, settings=("ADD",))
    return reader.emit("component", total, settings=(0,)) if is_alpha else total


def mapping_matrix(reader: Reader, mapping: Output) -> NDArray[np.float64]:
    """Affine map (4, 4) of a point or direction by a Mapping node."""
    location = reader.vector(mapping.input("Location"), 0.0)
    turn = _rotation(reader.vector(mapping.input("Rotation"), 0.0))
    stretch = np.diag(reader.vector(mapping.input("Scale"), 1.0))
    kind = mapping.node.vector_type
    matrix = np.eye(4)
    if kind == "TEXTURE":  # the texture itself is moved, so a point moves in the other direction
        scale = np.diag(stretch)
        inverse = np.diag(np.divide(1.0, scale, out=np.zeros(3), where=scale != 0)) @ turn.T
        matrix[:3, :3], matrix[:3, 3] = inverse, -inverse @ location
    elif kind == "NORMAL":
        scale = np.diag(stretch)
        matrix[:3, :3] = turn @ np.diag(np.divide(1.0, scale, out=np.zeros(3), where=scale != 0))
    else:
        matrix[:3, :3] = turn @ stretch
        matrix[:3, 3] = location if kind == "POINT" else 0.0
    return matrix


def _rotation(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Euler XYZ as Blender applies it: about x, then y, then z."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


@evaluator("MAPPING")
def _mapping(reader: Reader, output: Output) -> Any:
    inputs = (reader.read(output, name, fallback) for name, fallback in MAPPING_INPUTS)
    return reader.emit("mapping", *inputs, settings=(output.node.vector_type,))


MAPPING_INPUTS = (("Vector", np.zeros(3)), ("Location", np.zeros(3)), ("Rotation", np.zeros(3)), ("Scale", np.ones(3)))
"""Inputs of the Mapping node; a type of mapping without a location has no such socket."""


@evaluator("TEX_NOISE")
def _noise(reader: Reader, output: Output) -> Any:
    node = output.node
    kind = getattr(node, "noise_type", "FBM")
    names = (("W", 0), ("Scale", 5), ("Detail", 2), ("Roughness", 0.5), ("Lacunarity", 2), ("Offset", 0), ("Gain", 1))
    values = [reader.read(output, name, float(value)) for name, value in (*names, ("Distortion", 0))]
    settings = (kind, bool(getattr(node, "normalize", True)), node.noise_dimensions)
    operation = "noise_color" if output.socket.type == "RGBA" else "noise"
    return reader.emit(operation, place_of(reader, output, "generated"), *values, settings=settings)


@evaluator("TEX_WHITE_NOISE")
def _white_noise(reader: Reader, output: Output) -> Any:
    operation = "white_noise_color" if output.socket.type == "RGBA" else "white_noise"
    place = reader.read(output, "Vector")  # unlike other textures it has no implicit coordinates
    return reader.emit(operation, place, reader.read(output, "W"), settings=(output.node.noise_dimensions,))


WITH_METRIC = ("F1", "F2", "SMOOTH_F1")
"""Features of a Voronoi Texture that have a metric."""
LEAST_EXPONENT = 0.02
"""Minkowski exponent below which distances between cells exceed single precision: 4 to the power of 1 / exponent."""
VORONOI_OUTPUTS = {"Distance": "voronoi_distance", "Color": "voronoi_color", "Position": "voronoi_position"}


@evaluator("TEX_VORONOI")
def _voronoi(reader: Reader, output: Output) -> Any:
    node = output.node
    names = (("W", 0), ("Scale", 5), ("Detail", 0), ("Roughness", 0.5), ("Lacunarity", 2), ("Smoothness", 1))
    more = (("Exponent", 0.5), ("Randomness", 1))
    values = [reader.read(output, name, float(value)) for name, value in (*names, *more)]
    exponent = reader.as_value(values[6]).constant
    has_exponent = node.distance == "MINKOWSKI" and node.voronoi_dimensions != "1D" and node.feature in WITH_METRIC
    if has_exponent and exponent is not None and float(np.max(exponent)) < LEAST_EXPONENT:
        words = f"distances of a Minkowski exponent of {float(np.max(exponent)):.3g} exceed the largest numbers"
        reader.note(f"{output.label!r}: {words}, and differ from Cycles; use at least {LEAST_EXPONENT:g}")
    settings = (node.feature, node.distance, bool(getattr(node, "normalize", False)), node.voronoi_dimensions)
    if node.feature == "N_SPHERE_RADIUS":
        operation = "voronoi_radius"
    elif node.feature == "DISTANCE_TO_EDGE":
        operation = "voronoi_edge"
    else:
        operation = VORONOI_OUTPUTS.get(output.socket.name, "voronoi_w")
    return reader.emit(operation, place_of(reader, output, "generated"), *values, settings=settings)


@evaluator("TEX_WAVE")
def _wave(reader: Reader, output: Output) -> Any:
    node = output.node
    names = (("Scale", 5), ("Distortion", 0), ("Detail", 2), ("Detail Scale", 1), ("Detail Roughness", 0.5))
    values = [reader.read(output, name, float(value)) for name, value in (*names, ("Phase Offset", 0))]
    direction = node.bands_direction if node.wave_type == "BANDS" else node.rings_direction
    place = place_of(reader, output, "generated")
    return reader.emit("wave", place, *values, settings=(node.wave_type, direction, node.wave_profile))


@evaluator("TEX_MAGIC")
def _magic(reader: Reader, output: Output) -> Any:
    values = [reader.read(output, name, value) for name, value in (("Scale", 5.0), ("Distortion", 1.0))]
    place = place_of(reader, output, "generated")
    color = reader.emit("magic", place, *values, settings=(int(output.node.turbulence_depth), compat.is_before_5_2()))
    return color if output.socket.type == "RGBA" else reader.emit("mean", color)


@evaluator("TEX_GABOR")
def _gabor(reader: Reader, output: Output) -> Any:
    names = (("Scale", 5), ("Frequency", 2), ("Anisotropy", 1), ("Orientation 2D", 0.25 * np.pi))
    values = [reader.read(output, name, float(value)) for name, value in names]
    direction = reader.read(output, "Orientation 3D", np.array((1.0, 1.0, 0.0)))
    settings, place = (2 if output.node.gabor_type == "2D" else 3,), place_of(reader, output, "generated")
    found = reader.emit("gabor", place, *values, direction, settings=settings)
    part = ("Value", "Phase", "Intensity").index(output.socket.name)
    return reader.emit("component", found, settings=(part,))


@evaluator("TEX_GRADIENT")
def _gradient(reader: Reader, output: Output) -> Any:
    return reader.emit("gradient", place_of(reader, output, "generated"), settings=(output.node.gradient_type,))


@evaluator("ShaderNodeRadialTiling")
def _radial_tiling(reader: Reader, output: Output) -> Any:
    names = (("Vector", np.zeros(3)), ("Sides", 5.0), ("Roundness", 0.0))
    values = [reader.read(output, name, fallback) for name, fallback in names]
    sides, roundness = (None if value.constant is None else float(value.constant[0]) for value in values[1:])
    if sides is not None and sides <= 2.0 and (roundness is None or 0.0 < roundness < 1.0):
        words = f"at most 2 sides with a roundness of {'a link' if roundness is None else format(roundness, '.3g')}"
        reader.note(f"{output.label!r}: {words} exceed the largest numbers in Cycles; use 0 or 1")
    if output.socket.name == "Segment Coordinates":
        return reader.emit("radial_tiling", *values, settings=(bool(output.node.normalize),))
    found = reader.emit("radial_segment", *values)
    part = ("Segment ID", "Segment Width", "Segment Rotation").index(output.socket.name)
    return reader.emit("component", found, settings=(part,))


@evaluator("TEX_CHECKER")
def _checker(reader: Reader, output: Output) -> Any:
    share = reader.emit("checker", place_of(reader, output, "generated"), reader.read(output, "Scale", 5.0))
    if output.socket.type != "RGBA":
        return share
    first, second = (reader.field(place) for name in ("Color1", "Color2") if (place := output.input(name)))
    return reader.mix(share, second, first)


@evaluator("TEX_BRICK")
def _brick(reader: Reader, output: Output) -> Any:
    node = output.node
    names = (("Scale", 5), ("Mortar Size", 0.02), ("Mortar Smooth", 0.1), ("Bias", 0), ("Brick Width", 0.5))
    values = [reader.read(output, name, float(value)) for name, value in (*names, ("Row Height", 0.25))]
    settings = (float(node.offset), int(node.offset_frequency), float(node.squash), int(node.squash_frequency))
    place = place_of(reader, output, "generated")
    mortar = reader.emit("brick", place, *values, settings=settings)
    if output.socket.type != "RGBA":
        return mortar
    tint = reader.emit("brick_tint", place, *values, settings=settings)
    return reader.emit(
        "brick_color", tint, mortar, *(reader.read(output, name) for name in ("Color1", "Color2", "Mortar"))
    )


PATTERNS = ("TEX_MUSGRAVE", "TEX_POINTDENSITY", "SCRIPT")


@evaluator(*PATTERNS)
def _pattern(reader: Reader, output: Output) -> Any:
    reader.note(f"the pattern {output.label!r} is not drawn; a neutral gray was used")
    return np.full(3, NEUTRAL) if output.socket.type == "RGBA" else NEUTRAL
