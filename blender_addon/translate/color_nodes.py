# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that compute colors and numbers from others."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.spectra.catalogue import blackbody
from spectral_core.spectra.spectrum import Illuminant

from . import operations
from .fields import Field, Mixed, combine, gray_of, mean_color
from .nodes import Input, Output
from .reader import Reader, evaluator

MIX_SUFFIX = {"RGBA": "Color", "FLOAT": "Float", "VECTOR": "Vector", "ROTATION": "Rotation"}


@evaluator("RGB", "VALUE")
def _plain(reader: Reader, output: Output) -> Field:
    return reader.constant(Input(output.socket, output.groups))


@evaluator("MIX", "MIX_RGB")
def _mix(reader: Reader, output: Output) -> Field:
    """Mix node, also the one before Blender 3.4 that old files bring along."""
    node = output.node
    if node.type == "MIX_RGB":
        factor, first, second = reader.fields(output, "Fac", "Color1", "Color2")
        clamps = node.use_clamp
    else:
        suffix = MIX_SUFFIX[node.data_type]
        factor_kind = "Vector" if node.data_type == "VECTOR" and node.factor_mode == "NON_UNIFORM" else "Float"
        factor, first, second = reader.fields(output, f"Factor_{factor_kind}", f"A_{suffix}", f"B_{suffix}")
        clamps = node.data_type == "RGBA" and node.clamp_result
    mode = node.blend_type if node.type == "MIX_RGB" or node.data_type == "RGBA" else "MIX"
    if node.type == "MIX_RGB" or node.clamp_factor:
        factor = combine(lambda f: np.clip(f, 0, 1), [factor])
    if mode == "MIX":
        mixed = reader.mix(factor, first, second)
    elif mode in operations.BLEND:
        mixed = reader.apply(lambda f, a, b: operations.blend(mode, f, a, b), [factor, first, second])
    else:
        reader.note(f"the blend mode {mode.title()!r} of {output.label!r} is not understood; the colors were mixed")
        mixed = reader.mix(factor, first, second)
    return combine(lambda c: np.clip(c, 0, 1), [mixed]) if clamps and not isinstance(mixed, Mixed) else mixed


@evaluator("INVERT")
def _invert(reader: Reader, output: Output) -> Field:
    return reader.apply(lambda f, c: (1 - f) * c + f * (1 - c), reader.fields(output, "Fac", "Color"))


@evaluator("GAMMA")
def _gamma(reader: Reader, output: Output) -> Field:
    power = lambda c, g: np.where(c > 0, np.power(np.maximum(c, 1e-30), g), c)  # noqa: E731
    return reader.apply(power, reader.fields(output, "Color", "Gamma"))


@evaluator("BRIGHTCONTRAST")
def _bright_contrast(reader: Reader, output: Output) -> Field:
    return reader.apply(operations.bright_contrast, reader.fields(output, "Color", "Bright", "Contrast"))


@evaluator("HUE_SAT")
def _hue_saturation(reader: Reader, output: Output) -> Field:
    names = ("Color", "Hue", "Saturation", "Value", "Fac")
    return reader.apply(operations.hue_saturation, reader.fields(output, *names))


@evaluator("MATH")
def _math(reader: Reader, output: Output) -> Field:
    inputs = [gray_of(reader.field(Input(socket, output.groups))) for socket in output.node.inputs]
    inputs += [0.0] * (3 - len(inputs))
    function = operations.MATH.get(output.node.operation)
    if function is None:
        reader.note(f"the operation {output.node.operation.title()!r} of {output.label!r} is not understood")
        return inputs[0]
    result = reader.apply(function, inputs)
    return combine(lambda v: np.clip(v, 0, 1), [result]) if output.node.use_clamp else result


@evaluator("CLAMP")
def _clamp(reader: Reader, output: Output) -> Field:
    def clamp(value: Any, low: Any, high: Any) -> Any:
        if output.node.clamp_type == "RANGE":
            low, high = np.minimum(low, high), np.maximum(low, high)
        return np.minimum(np.maximum(value, low), high)

    return reader.apply(clamp, reader.fields(output, "Value", "Min", "Max"))


@evaluator("MAP_RANGE")
def _map_range(reader: Reader, output: Output) -> Field:
    node = output.node
    if node.data_type != "FLOAT" or node.interpolation_type == "STEPPED":
        reader.note(f"{output.label!r} is understood for numbers and without steps only")
    names = ("Value", "From Min", "From Max", "To Min", "To Max")
    return reader.apply(
        lambda v, *limits: operations.map_range(v, limits, clamp=node.clamp, steps=node.interpolation_type),
        reader.fields(output, *names),
    )


@evaluator("VALTORGB")
def _color_ramp(reader: Reader, output: Output) -> Field:
    ramp = output.node.color_ramp
    table = np.array([ramp.evaluate(position)[:] for position in np.linspace(0, 1, 1025)])
    colors = table[:, 3:] if output.socket.name == "Alpha" else reader.translation.linear_rgb(table)

    def look_up(factor: Any) -> Any:
        index = np.clip(factor[..., 0], 0, 1) * 1024
        return np.stack([np.interp(index, np.arange(1025), column) for column in colors.T], axis=-1)

    return reader.apply(look_up, reader.fields(output, "Fac"))


@evaluator("CURVE_RGB", "CURVE_FLOAT")
def _curves(reader: Reader, output: Output) -> Field:
    mapping = output.node.mapping
    mapping.update()
    is_number = output.node.type == "CURVE_FLOAT"
    grid = np.linspace(0, 1, 257)
    tables = [np.array([mapping.evaluate(curve, x) for x in grid]) for curve in mapping.curves]

    def bend(factor: Any, color: Any) -> Any:
        if is_number:
            bent = np.interp(color, grid, tables[0])
        else:
            combined = np.interp(np.broadcast_to(color, (*color.shape[:-1], 3)), grid, tables[3])
            bent = np.stack([np.interp(combined[..., i], grid, tables[i]) for i in range(3)], axis=-1)
        return (1 - factor) * color + factor * bent

    factor = "Fac" if output.input("Fac") is not None else "Factor"
    return reader.apply(bend, reader.fields(output, factor, "Value" if is_number else "Color", missing=1.0))


@evaluator("RGBTOBW")
def _black_and_white(reader: Reader, output: Output) -> Field:
    return gray_of(reader.fields(output, "Color")[0])


@evaluator("SEPARATE_COLOR", "SEPRGB", "SEPXYZ", "SEPARATE_XYZ")
def _separate(reader: Reader, output: Output) -> Field:
    node = output.node
    index = list(node.outputs).index(output.socket)
    mode = getattr(node, "mode", "RGB")
    if mode == "HSL":
        reader.note(f"{output.label!r} in HSL is not understood; it was read as HSV")
    turn = operations.hsv_from_rgb if mode in ("HSV", "HSL") else (lambda c: c)
    value = reader.field(Input(node.inputs[0], output.groups))
    return reader.apply(lambda c: turn(np.broadcast_to(c, (*c.shape[:-1], 3)))[..., index : index + 1], [value])


@evaluator("COMBINE_COLOR", "COMBRGB", "COMBXYZ", "COMBINE_XYZ")
def _combine(reader: Reader, output: Output) -> Field:
    parts = [gray_of(reader.field(Input(socket, output.groups))) for socket in list(output.node.inputs)[:3]]
    turn = operations.rgb_from_hsv if getattr(output.node, "mode", "RGB") in ("HSV", "HSL") else (lambda c: c)
    return reader.apply(lambda *c: turn(np.concatenate(np.broadcast_arrays(*c), axis=-1)), parts)


@evaluator("BLACKBODY")
def _blackbody(reader: Reader, output: Output) -> Field:
    """Planck's law itself, as an illuminant: it is normalized to the luminance of white wherever it is used."""
    kelvin = float(mean_color(reader.fields(output, "Temperature")[0])[0])
    known = min(max(kelvin, 800.0), 12000.0)  # where Blender's own table ends
    spectrum: Illuminant = blackbody(known)
    return spectrum


@evaluator("FRESNEL", "LAYER_WEIGHT")
def _fresnel(reader: Reader, output: Output) -> Field:
    """How it reflects on the average over directions: the share changes with the angle, a factor here cannot."""
    reader.note(f"{output.label!r} varies with the viewing angle; its mean over all directions was used")
    if output.node.type == "FRESNEL":
        return operations.fresnel_mean(float(mean_color(reader.fields(output, "IOR")[0])[0]))
    weight = float(mean_color(reader.fields(output, "Blend")[0])[0])
    if output.socket.name == "Fresnel":
        return operations.fresnel_mean(1 / max(1 - weight, 1e-5))
    return min(max(weight, 0.0), 1.0)


@evaluator("LIGHT_PATH")
def _light_path(reader: Reader, output: Output) -> Field:
    """Tricks that show the camera one thing and the light another: what the camera sees is taken."""
    reader.note(f"{output.label!r} tells rays apart, which this engine does not; what the camera sees was used")
    return 1.0 if output.socket.name == "Is Camera Ray" else 0.0
