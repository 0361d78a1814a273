# SPDX-License-Identifier: GPL-3.0-or-later
"""Common inputs of shader nodes: main colors, normals, tangents, indices of refraction, colors of metals, radii."""

from __future__ import annotations

import numpy as np

from spectral_core.scene import FILM_THICKNESS_NM, IOR, Color, Computed, Paint, Scalar, SubsurfaceModel, gray
from spectral_core.scene.shading import OnRaised, Raised
from spectral_core.spectra.metal import colors_of_metal

from .. import spectra
from .fields import mean_color
from .reader import Reader
from .tangents.nodes import round_tangent
from .tree import Input, Output, linked


def main_color(reader: Reader, output: Output, fallback: float, name: str = "Color") -> Paint:
    """Main color of a shader node: its spectrum, else its socket."""
    spectrum = spectra.spectrum_of(reader.translation, output.node)
    return spectrum if spectrum is not None else reader.paint(output.input(name), gray(fallback))


def direction_at(reader: Reader, output: Output, name: str) -> Computed | None:
    """The link of a normal or tangent socket; None if there is none."""
    place = output.input(name)
    if place is None or linked(place) is None:
        return Raised(reader.raised.program(3)) if reader.raised is not None and name == "Normal" else None
    program = reader.as_value(reader.field(place)).program(3)
    if reader.raised is not None and name == "Normal":
        return OnRaised(program, Raised(reader.raised.program(3)))
    return Computed(program)


def lobe_tangent(reader: Reader, output: Output, anisotropy: Scalar) -> Computed | None:
    """Direction of an anisotropic lobe: the link, else around the object's Z axis, as in Cycles."""
    if anisotropy == 0:
        return None
    return direction_at(reader, output, "Tangent") or Computed(round_tangent(reader).program(3))


SUBSURFACE_MODELS: dict[str, SubsurfaceModel] = {"RANDOM_WALK_SKIN": "random_walk_skin", "BURLEY": "burley"}
"""Methods of light below the surface other than Random Walk."""


def model_of(method: str) -> SubsurfaceModel:
    """The model of light below the surface by Blender's name."""
    return SUBSURFACE_MODELS.get(method, "random_walk")


def radius_of(reader: Reader, output: Output, name: str) -> tuple[float, float, float] | Computed:
    """Radii of red, green and blue."""
    value = reader.read(output, name, np.array((1.0, 0.2, 0.1)))
    if value.constant is None:
        return Computed(value.program(3))
    red, green, blue = (float(part) for part in np.broadcast_to(mean_color(value), (3,)))
    return max(red, 0.0), max(green, 0.0), max(blue, 0.0)


def ior(reader: Reader, place: Input | None, fallback: float) -> float:
    """Index of refraction: one number, within the range of a dielectric."""
    value = reader.number(place, fallback)
    return min(max(value, IOR[0]), IOR[1])


def varying_ior(reader: Reader, place: Input | None, fallback: float) -> float | Computed:
    """Index of refraction, which may vary over the surface."""
    found = held(reader.scalar(place, fallback), IOR)
    return found if isinstance(found, Computed) else ior(reader, place, fallback)


def thin_film(reader: Reader, output: Output) -> dict[str, Scalar]:
    """Thickness in nm and index of refraction of the film on a surface; empty if the thickness is 0 everywhere."""
    thickness = reader.scalar(output.input("Thin Film Thickness"), 0.0)
    if isinstance(thickness, float) and thickness <= 0:
        return {}
    index = reader.scalar(output.input("Thin Film IOR"), 1.33)
    return {"thin_film_thickness": held(thickness, FILM_THICKNESS_NM), "thin_film_ior": held(index, IOR)}


def held(value: Scalar, limits: tuple[float, float]) -> Scalar:
    """A number within the limits that Blender's socket has as well; a texture is held at the hit."""
    return min(max(value, limits[0]), limits[1]) if isinstance(value, float) else value


EDGE_ROOM = 1e-3
"""Excess of an edge's color over [0, 1] that no picture shows."""


def conductor_colors(index: np.ndarray, extinction: np.ndarray) -> tuple[Paint, Paint, float]:
    """Colors that represent an index and extinction per channel, by Gulbrandsen 2014: facing and edge; scale of the
    latter, which is 2 for metals of little extinction.
    """
    facing, edge = colors_of_metal(index, extinction)
    scale = 2.0 if edge.max() > 1.0 + EDGE_ROOM else 1.0
    return Color(facing), Color(np.clip(edge / scale, 0.0, 1.0)), scale
