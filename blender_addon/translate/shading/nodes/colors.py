# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that compute colors, numbers and vectors from others."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from spectral_core.scene.shading.arithmetic import MATH
from spectral_core.scene.shading.colors import CHANNELS, WHOLE
from spectral_core.scene.shading.vectors import VECTOR_MATH, VECTOR_NUMBERS
from spectral_core.spectra.catalogue import blackbody
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import observer

from ..fields import Value, color_of_spectrum, mean_color
from ..reader import Reader, evaluator
from ..tree import Input, Output
from ..walks.constants import computed_by_blender

MIX_SUFFIX = {"RGBA": "Color", "FLOAT": "Float", "VECTOR": "Vector", "ROTATION": "Rotation"}


@evaluator("RGB", "VALUE")
def _plain(reader: Reader, output: Output) -> Any:
    return reader.constant(Input(output.socket, output.groups))


@evaluator("MIX", "MIX_RGB")
def _mix(reader: Reader, output: Output) -> Any:
    """Mix node, also the version before Blender 3.4 in old files."""
    node = output.node
    if node.type == "MIX_RGB":
        names, data_type = ("Fac", "Color1", "Color2"), "RGBA"
        clamps, clamps_factor, mode = node.use_clamp, True, node.blend_type
    else:
        data_type = node.data_type
        suffix = MIX_SUFFIX[data_type]
        uneven = data_type == "VECTOR" and node.factor_mode == "NON_UNIFORM"
        names = (f"Factor_{'Vector' if uneven else 'Float'}", f"A_{suffix}", f"B_{suffix}")
        clamps, clamps_factor = data_type == "RGBA" and node.clamp_result, node.clamp_factor
        mode = node.blend_type if data_type == "RGBA" else "MIX"
    factor = reader.read(output, names[0])
    is_vector = names[0] == "Factor_Vector"
    if clamps_factor:
        factor = (
            reader.emit("clamped_color", factor)
            if is_vector
            else reader.emit("clamp", factor, 0.0, 1.0, settings=("MINMAX",))
        )
    if data_type == "FLOAT":
        return reader.emit("mix_number", factor, reader.read(output, names[1]), reader.read(output, names[2]))
    if data_type in ("VECTOR", "ROTATION"):
        return reader.emit("mix_vector", factor, reader.read(output, names[1]), reader.read(output, names[2]))
    first, second = (reader.field(place) for name in names[1:] if (place := output.input(name)))
    if mode == "MIX" and not clamps:
        return reader.mix(factor, first, second)
    if mode not in CHANNELS and mode not in WHOLE:
        reader.note(f"the blend mode {mode.title()!r} of {output.label!r} is not supported; the colors were mixed")
        mode = "MIX"
    mixed = reader.emit("blend", factor, first, second, settings=(mode,))
    return reader.emit("clamped_color", mixed) if clamps else mixed


@evaluator("INVERT")
def _invert(reader: Reader, output: Output) -> Any:
    return reader.emit("invert", reader.read(output, "Fac", 1.0), reader.read(output, "Color"))


@evaluator("GAMMA")
def _gamma(reader: Reader, output: Output) -> Any:
    return reader.emit("gamma", reader.read(output, "Color"), reader.read(output, "Gamma", 1.0))


@evaluator("BRIGHTCONTRAST")
def _bright_contrast(reader: Reader, output: Output) -> Any:
    return reader.emit("bright_contrast", *(reader.read(output, name) for name in ("Color", "Bright", "Contrast")))


@evaluator("HUE_SAT")
def _hue_saturation(reader: Reader, output: Output) -> Any:
    names = ("Hue", "Saturation", "Value", "Fac", "Color")
    return reader.emit("hue_saturation", *(reader.read(output, name, 1.0) for name in names))


@evaluator("MATH")
def _math(reader: Reader, output: Output) -> Any:
    inputs = [reader.as_value(reader.field(Input(socket, output.groups))) for socket in output.node.inputs][:3]
    inputs += [reader.literal(0.0)] * (3 - len(inputs))
    if output.node.operation not in MATH:
        reader.note(f"the operation {output.node.operation.title()!r} of {output.label!r} is not supported")
        return inputs[0]
    result = reader.emit("math", *inputs, settings=(output.node.operation,))
    return reader.emit("clamp", result, 0.0, 1.0, settings=("MINMAX",)) if output.node.use_clamp else result


@evaluator("VECT_MATH")
def _vector_math(reader: Reader, output: Output) -> Any:
    mode = output.node.operation
    sockets = [Input(socket, output.groups) for socket in output.node.inputs]
    vectors = [reader.as_value(reader.field(place)) for place in sockets if place.socket.type == "VECTOR"][:3]
    vectors += [reader.literal(np.zeros(3))] * (3 - len(vectors))
    if mode in VECTOR_NUMBERS:
        number = reader.emit("vector_number", vectors[0], vectors[1], settings=(mode,))
        return number if output.socket.type == "VALUE" else reader.literal(np.zeros(3))
    if mode not in VECTOR_MATH:
        reader.note(f"the operation {mode.title()!r} of {output.label!r} is not supported")
        return vectors[0]
    scale = next((reader.as_value(reader.field(place)) for place in sockets if place.socket.type == "VALUE"), 0.0)
    result = reader.emit("vector_math", *vectors, scale, settings=(mode,))
    return result if output.socket.type == "VECTOR" else reader.literal(0.0)


@evaluator("VECTOR_ROTATE")
def _rotate(reader: Reader, output: Output) -> Any:
    node = output.node
    vector, center = reader.read(output, "Vector"), reader.read(output, "Center")
    if node.rotation_type == "EULER_XYZ":
        return reader.emit(
            "rotate_euler", vector, center, reader.read(output, "Rotation"), settings=(bool(node.invert),)
        )
    axes = {"X_AXIS": (1.0, 0, 0), "Y_AXIS": (0, 1.0, 0), "Z_AXIS": (0, 0, 1.0)}
    axis = axes.get(node.rotation_type)
    angle = reader.emit("math", reader.read(output, "Angle"), -1.0 if node.invert else 1.0, 0.0, settings=("MULTIPLY",))
    return reader.emit("rotate", vector, center, reader.read(output, "Axis") if axis is None else np.array(axis), angle)


@evaluator("VECT_TRANSFORM")
def _transform(reader: Reader, output: Output) -> Any:
    node = output.node
    settings = (node.vector_type, node.convert_from, node.convert_to)
    vector = reader.read(output, "Vector")
    return vector if settings[1] == settings[2] else reader.emit("transformed", vector, settings=settings)


@evaluator("NORMAL")
def _normal(reader: Reader, output: Output) -> Any:
    direction = np.array(output.node.outputs[0].default_value[:], dtype=np.float64)
    length = np.linalg.norm(direction)
    direction = direction / length if length > 0.0 else direction  # scripts may store any length
    if output.socket.type == "VECTOR":
        return direction
    return reader.emit("normal_dot", direction, reader.read(output, "Normal"))


@evaluator("CLAMP")
def _clamp(reader: Reader, output: Output) -> Any:
    values = (reader.read(output, name) for name in ("Value", "Min", "Max"))
    return reader.emit("clamp", *values, settings=(output.node.clamp_type,))


@evaluator("MAP_RANGE")
def _map_range(reader: Reader, output: Output) -> Any:
    node = output.node
    settings = (node.interpolation_type, bool(node.clamp))
    if node.data_type == "FLOAT_VECTOR":
        names = ("Vector", "From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3", "To_Max_FLOAT3", "Steps_FLOAT3")
        return reader.emit("map_range_vector", *(reader.read(output, name) for name in names), settings=settings)
    names = ("Value", "From Min", "From Max", "To Min", "To Max", "Steps")
    return reader.emit("map_range", *(reader.read(output, name, 4.0) for name in names), settings=settings)


@evaluator("VALTORGB")
def _color_ramp(reader: Reader, output: Output) -> Any:
    ramp = output.node.color_ramp
    count = 4096 if ramp.interpolation == "CONSTANT" else 256  # fine enough to represent a step
    table = np.array([ramp.evaluate(position)[:] for position in np.linspace(0, 1, count)])
    factor = reader.read(output, "Fac")
    if output.socket.name == "Alpha":
        return reader.emit("ramp_number", factor, data=np.ascontiguousarray(table[:, 3:]))
    return reader.emit("ramp_color", factor, data=np.ascontiguousarray(reader.translation.linear_rgb(table)))


@evaluator("CURVE_RGB", "CURVE_VEC", "CURVE_FLOAT")
def _curves(reader: Reader, output: Output) -> Any:
    kind = output.node.type
    mapping = output.node.mapping
    mapping.update()
    share = "Fac" if output.input("Fac") is not None else "Factor"
    name = {"CURVE_FLOAT": "Value", "CURVE_VEC": "Vector"}.get(kind, "Color")
    factor, value = reader.read(output, share, 1.0), reader.read(output, name)
    places = (output.input(share), output.input(name))
    if factor.constant is not None and (own := value.constant) is not None and computed_by_blender(*places):
        moved = _moved_as_in_blender(kind, mapping, np.resize(own, 1 if kind == "CURVE_FLOAT" else 3))
        return reader.emit("mix_number" if kind == "CURVE_FLOAT" else "mix_vector", factor, value, moved)
    ends = [point.location[0] for curve in mapping.curves for point in (curve.points[0], curve.points[-1])]
    low, high = min(ends), max(ends)
    settings = (low, high if high > low else low + 1.0, mapping.extend == "EXTRAPOLATED")
    grid = np.linspace(*settings[:2], 257)
    first = [grid] * len(mapping.curves)
    if kind == "CURVE_RGB":  # a channel's own curve acts on the values of the combined one, in one table as in Cycles
        first = [np.array([mapping.evaluate(mapping.curves[3], x) for x in grid])] * 3
    tables = [
        np.array([mapping.evaluate(curve, x) for x in places])
        for curve, places in zip(mapping.curves, first, strict=False)
    ]
    if kind == "CURVE_FLOAT":
        return reader.emit("curve", factor, value, settings=settings, data=tables[0][:, None])
    return reader.emit("curves", factor, value, settings=settings, data=np.stack(tables[:3], axis=1))


def _moved_as_in_blender(kind: str, mapping: Any, value: np.ndarray) -> np.ndarray:
    """Constants on their curves: exact, not by a table of Cycles; the clipping of a Float Curve counts."""
    if kind == "CURVE_RGB":
        value = np.array([mapping.evaluate(mapping.curves[3], part) for part in value])
    moved = np.array([mapping.evaluate(curve, part) for curve, part in zip(mapping.curves, value, strict=False)])
    is_clipped = kind == "CURVE_FLOAT" and mapping.use_clip
    return np.clip(moved, mapping.clip_min_y, mapping.clip_max_y) if is_clipped else moved


@evaluator("RGBTOBW")
def _black_and_white(reader: Reader, output: Output) -> Any:
    return reader.emit("luminance", reader.read(output, "Color"))


@evaluator("SEPARATE_COLOR", "SEPRGB", "SEPHSV", "SEPXYZ", "SEPARATE_XYZ")
def _separate(reader: Reader, output: Output) -> Any:
    node = output.node
    index = list(node.outputs).index(output.socket)
    mode = "HSV" if node.type == "SEPHSV" else getattr(node, "mode", "RGB")
    value = reader.as_value(reader.field(Input(node.inputs[0], output.groups)))
    if mode in ("HSV", "HSL"):
        value = reader.emit("to_hsv" if mode == "HSV" else "to_hsl", value)
    return reader.emit("component", value, settings=(index,))


@evaluator("COMBINE_COLOR", "COMBRGB", "COMBHSV", "COMBXYZ", "COMBINE_XYZ")
def _combine(reader: Reader, output: Output) -> Any:
    node = output.node
    parts = [reader.as_value(reader.field(Input(socket, output.groups))) for socket in list(node.inputs)[:3]]
    mode = "HSV" if node.type == "COMBHSV" else getattr(node, "mode", "RGB")
    joined = reader.emit("joined", *parts)
    return reader.emit("to_rgb" if mode == "HSV" else "from_hsl", joined) if mode in ("HSV", "HSL") else joined


KELVIN = (800.0, 12000.0)
"""Range of Blender's own table of temperatures."""


@cache
def _temperatures() -> np.ndarray:
    """Colors (n, 4) of black bodies of luminance 1 over KELVIN."""
    rows = [[*np.maximum(color_of_spectrum(blackbody(kelvin)), 0.0), 1.0] for kelvin in np.linspace(*KELVIN, 257)]
    return np.array(rows)


@cache
def _monochrome() -> np.ndarray:
    """Colors (81, 4) of single wavelengths from 380 to 780 nm, at Cycles' scale."""
    viewer = observer()
    nm = np.linspace(380, 780, 81)
    xyz = np.stack([np.interp(nm, viewer.wavelengths_nm, row) for row in viewer.cmfs], axis=-1)
    return np.concatenate([np.maximum(xyz @ RGB_FROM_XYZ.T / 2.52, 0.0), np.ones((81, 1))], axis=1)


@evaluator("WAVELENGTH")
def _wavelength(reader: Reader, output: Output) -> Any:
    place = reader.emit(
        "math", reader.read(output, "Wavelength", 500.0), 1 / 400, -380 / 400, settings=("MULTIPLY_ADD",)
    )
    return reader.emit("ramp_color", place, data=_monochrome())


def planckian(reader: Reader, kelvin: Value) -> Value:
    """Color of a black body of luminance 1, by its temperature."""
    low, high = KELVIN
    place = reader.emit("math", kelvin, 1.0 / (high - low), -low / (high - low), settings=("MULTIPLY_ADD",))
    return reader.emit("ramp_color", place, data=_temperatures())


@evaluator("BLACKBODY")
def _blackbody(reader: Reader, output: Output) -> Any:
    """Planck's law itself, as an illuminant: its users normalize it to the luminance of white."""
    value: Value = reader.read(output, "Temperature")
    if value.constant is None and reader.on_surface:
        return planckian(reader, value)
    kelvin = float(mean_color(value)[0])
    if value.constant is None:
        reader.note(f"{output.label!r}: a temperature that varies is shown with its mean")
    return blackbody(min(max(kelvin, 800.0), 12000.0))  # the range of Blender's own table ends here


FARTHEST = 3.4028234663852886e38
"""Length of a ray from a sun or the world."""


@evaluator("LIGHT_PATH")
def _light_path(reader: Reader, output: Output) -> Any:
    """Type of the ray that hits the surface."""
    name = output.socket.name
    if name == "Portal Depth":
        reader.note(f"{name!r} of {output.label!r} is 0 here, also for rays that have passed a Ray Portal")
        return 0.0
    if name == "Ray Length" and reader.is_far:
        return FARTHEST
    return reader.point(f"ray:{name}", 1)
