# SPDX-License-Identifier: GPL-3.0-or-later
"""What strands and points carry for materials: attributes of curves and clouds, UVs and colors of a hair's root."""

from __future__ import annotations

from collections.abc import Iterator
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import linear_from_display_rgb, luminance_from_linear_rgb

from ..meshes import velocities
from ..meshes.triangles import OF_CYCLES, OF_UV_MAP, OUTPUTS, output_of, stored_in, uv_layer, values_of
from ..shading.attributes import POINT_PLACE, POINT_SIZE, hashed_pair

Array = NDArray[np.float64]

ROOT_UV = "surface_uv_coordinate"
"""Attribute of hair curves with the UV of each root on the surface that they grow on; Cycles reads it as their UV."""

HAIR_RADIUS, POINT_RADIUS = 0.005, 0.01
"""Radii in Cycles, in meters, of hair and of points without an attribute ``radius``."""


def content_of(data: Any, reads: frozenset[str]) -> bytes:
    """A digest of hair curves or a point cloud, which is equal if the same mesh is made of them.

    Blender reports another geometry of them when a number of their material is edited, and to make the mesh takes a
    hundred times as long. ``reads``: the inputs of their materials.
    """
    names = {"position", "radius", ROOT_UV} | {_stored(read)[1] for read in reads}
    found = blake2b(digest_size=16)
    for attribute in data.attributes:
        values = stored_in(attribute) if attribute.name in names else None
        if values is not None:
            found.update(f"{attribute.name}:{attribute.domain}:{attribute.data_type}:{len(values)}:".encode())
            found.update(values.tobytes())
    if hasattr(data, "curves"):
        found.update(lengths_of(data).tobytes())
    return found.digest()


def lengths_of(curves: Any) -> NDArray[np.int32]:
    """Number of points of each strand."""
    lengths = np.empty(len(curves.curves), np.int32)
    curves.curves.foreach_get("points_length", lengths)
    return lengths


def radii_of(data: Any) -> NDArray[np.float32]:
    """Radii (n,) of the points of hair curves or of a cloud, meters in the object's space.

    As in Cycles, those of curves count for all of their points, and other numbers are converted as in Blender: the mean
    of a vector, the luminance of a color. Infinite radii are NaN: what follows from NaN is NaN, and left out.
    """
    is_hair = hasattr(data, "curves")
    attribute = data.attributes.get("radius")
    is_number = attribute is not None and attribute.data_type != "QUATERNION"
    stored = stored_in(attribute, exact=True) if is_number else None
    if stored is None:
        return np.full(len(data.points), HAIR_RADIUS if is_hair else POINT_RADIUS, np.float32)
    with np.errstate(invalid="ignore"):  # sums of infinite numbers
        radii = luminance_from_linear_rgb(stored[:, :3]) if stored.shape[1] == 4 else stored.mean(axis=1)
    if attribute.domain == "CURVE":
        radii = np.repeat(radii, lengths_of(data))
    return np.where(np.isfinite(radii), radii, np.nan).astype(np.float32)


def of_points(
    cloud: Any, reads: frozenset[str], places: NDArray[Any], radii: NDArray[Any]
) -> Iterator[tuple[str, Array]]:
    """Inputs that are attributes of a point cloud, and their values (n, 3)."""
    if POINT_PLACE in reads:
        yield POINT_PLACE, places.reshape(-1, 3)
    if POINT_SIZE in reads:
        random = [hashed_pair(number, 0) / 0xFFFFFFFF for number in range(len(radii))]
        yield POINT_SIZE, np.column_stack([radii, random, np.ones(len(radii))])
    for read in sorted(reads):
        kind, name = _stored(read)
        found = cloud.attributes.get(name) if kind in OUTPUTS else None
        values = values_of(found, kind) if found is not None and found.domain == "POINT" else None
        if values is not None:
            yield read, values


def of_curves(curves: Any, reads: frozenset[str], lengths: NDArray[Any], points: Array) -> dict[str, Array]:
    """Inputs that are attributes of hair curves, and their values (n, 3) at all points (n, 3)."""
    carried = {}
    for read in sorted(reads):
        kind, name = _stored(read)
        if read == "generated":  # they have no texture space, so that Cycles takes the position in the object
            carried[read] = points
            continue
        if kind == "uv" and not name:
            kind, name = "attribute", ROOT_UV
        found = curves.attributes.get(name) if kind in OUTPUTS else None
        values = values_of(found, kind) if found is not None else None
        if found is not None and values is not None:
            carried[read] = values if found.domain == "POINT" else np.repeat(values, lengths, axis=0)
    return carried


def _stored(read: str) -> tuple[str, str]:
    """The output and the name of the attribute that an input reads; no output if programs do not find the name."""
    if read == velocities.READ:
        return "attribute", velocities.NAME
    kind, _, name = read.partition(":")
    return "" if kind in OUTPUTS and kind != OF_UV_MAP and name in OF_CYCLES else kind, name


def on_emitter(
    obj: Any, system: Any, numbers: list[int], reads: frozenset[str], roots: Array
) -> Iterator[tuple[str, Array]]:
    """Inputs that the hair of an evaluated object takes from the mesh at its roots, and their values (s, 3).

    ``numbers``: the hairs (s) of the particle system; ``roots``: their first points (s, 3) in the object.
    """
    modifier = next((item for item in obj.modifiers if getattr(item, "particle_system", None) == system), None)
    if modifier is None:
        return
    mesh, particles = obj.data, system.particles
    colors = list(mesh.vertex_colors.keys())

    def read_all(read: Any, layer: str, index: int, width: int) -> Array:
        last = len(particles) - 1
        given = [
            read(modifier, particle=particles[min(number, last)], particle_no=number, **{layer: index})
            for number in numbers
        ]
        return np.array(given, dtype=np.float64).reshape(-1, width)

    for read in sorted(reads):
        kind, _, name = read.partition(":")
        if read == "generated":
            center, half = (np.array(value[:]) for value in (mesh.texspace_location, mesh.texspace_size))
            yield read, (roots - center) / (2 * np.where(half == 0, 1.0, half)) + 0.5
            continue
        is_hidden = kind != OF_UV_MAP and name in OF_CYCLES
        has_map = kind == "uv" or (kind in OUTPUTS and not is_hidden and name in mesh.uv_layers)
        layer = uv_layer(mesh, name) if has_map else None
        if layer is not None:
            uvs = read_all(system.uv_on_emitter, "uv_no", mesh.uv_layers.find(layer.name), 2)
            uvs = np.column_stack([uvs, np.zeros(len(uvs))])
            yield read, uvs if kind == "uv" else output_of(uvs, 2, kind)
        elif kind in OUTPUTS and not is_hidden and (name in colors or (not name and colors)):
            at = colors.index(name) if name in colors else max(0, mesh.vertex_colors.active_index)
            found = linear_from_display_rgb(read_all(system.mcol_on_emitter, "vcol_no", at, 3))
            yield read, output_of(np.column_stack([found, np.ones(len(found))]), 4, kind)
