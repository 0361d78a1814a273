# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes that depend on the whole scene: materials, shapes and light paths that together differ from Cycles."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene import (
    Glass,
    Glossy,
    Mesh,
    Metal,
    Principled,
    Scene,
    Sheen,
    Subsurface,
    Surface,
    Translucent,
    leaves,
)

from .context import Translation
from .meshes import OUTPUTS, uv_layer

LEANING_COSINE = 0.7
"""Cosine between a face's normal and a shading normal of its corners below which refraction differs visibly."""
FEW = 0.01
"""Largest share of corners beyond that angle."""


def note_approximations(translation: Translation, scene: Scene) -> None:
    """Add one note per object, light or scene."""
    surfaces = {material.name: material.surface for material in scene.materials}
    meshes = {mesh.name: mesh for mesh in scene.meshes}
    bends = {name for name, surface in surfaces.items() if _refracts(surface)}
    enters = {name for name, surface in surfaces.items() if _enters(surface)}
    leaning: dict[str, tuple[bool, bool]] = {}
    for instance in scene.instances:
        if not (bends | enters).intersection(instance.materials):
            continue
        if instance.mesh not in leaning:
            mesh = meshes[instance.mesh]
            leaning[instance.mesh] = _leans(mesh, LEANING_COSINE), _leans(mesh, 0.0)
        leans, is_turned = leaning[instance.mesh]
        if leans and bends.intersection(instance.materials):
            message = "it is smooth-shaded over hard edges: light refracted there is dimmer than in Cycles"
            translation.note(instance.name, message)
        if is_turned and enters.intersection(instance.materials):
            message = (
                "faces of its smooth-shaded mesh point both outward and inward: translucent, subsurface and sheen "
                "light differs from Cycles there; Mesh > Normals > Recalculate Outside mends the mesh"
            )
            translation.note(instance.name, message)
    film = scene.film
    if film.transparent and film.transparent_glass:
        for name, surface in surfaces.items():
            if _refracts(surface) and any(getattr(leaf, "roughness", 0.0) != 0 for leaf in leaves(surface)):
                message = "Transparent Glass applies to smooth glass; this rough glass covers the background"
                translation.note(name, message)
    if not any(_is_mixed(surface) for surface in surfaces.values()):
        return
    limits = scene.settings.light_paths
    if not (limits.reflective_caustics and limits.refractive_caustics):
        message = "caustics are off: a surface that is partly diffuse keeps the caustics of its glossy part"
        translation.note(translation.scene.name, message)


def _refracts(surface: Surface | None) -> bool:
    return any(
        isinstance(leaf, Glass) or (isinstance(leaf, Principled) and leaf.transmission != 0) for leaf in leaves(surface)
    )


def _enters(surface: Surface | None) -> bool:
    return any(
        isinstance(leaf, (Translucent, Subsurface, Sheen))
        or (isinstance(leaf, Principled) and (leaf.subsurface_weight != 0 or leaf.sheen_weight != 0))
        for leaf in leaves(surface)
    )


def _is_mixed(surface: Surface | None) -> bool:
    """True if a surface scatters both diffusely and like a mirror."""
    kinds = {isinstance(leaf, (Glossy, Metal, Glass)) for leaf in leaves(surface)}
    return len(kinds) == 2 or any(isinstance(leaf, Principled) for leaf in leaves(surface))


def _leans(mesh: Mesh, cosine: float) -> bool:
    """True if interpolated normals are further from those of their faces than an angle of this cosine."""
    if mesh.normals is None:
        return False
    first, second, third = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    faces = np.cross(second - first, third - first)
    size = np.linalg.norm(faces, axis=1)
    kept = size > 0
    normals = mesh.normals[mesh.triangles[kept]].astype(np.float64)
    cosines = np.einsum("tci,ti->tc", normals, faces[kept] / size[kept, None])
    return bool((cosines < cosine).mean() > FEW) if cosines.size else False


def note_missing(translation: Translation, obj: Any, reads: frozenset[str]) -> None:
    """Name the UV maps and attributes that materials read but the mesh lacks: they read as 0, as in Blender."""
    if "uv" in reads and uv_layer(obj.data, "") is None:
        translation.note(obj.name, "it has no UV map for the images on it; they show their corner pixel")
    undeformed = getattr(obj.original, "data", None)
    count = len(getattr(undeformed, "vertices", ())) if obj.original.type == "MESH" else len(obj.data.vertices)
    if "generated" in reads and count != len(obj.data.vertices) and not obj.data.is_editmode:
        translation.note(obj.name, "its generated coordinates are those of the mesh after its modifiers")
    for name in sorted(reads):
        kind, _, attribute = name.partition(":")
        missing = attribute not in obj.data.attributes and attribute not in obj.vertex_groups
        if kind in OUTPUTS and attribute and missing:
            translation.note(obj.name, f"it has no UV map or attribute {attribute!r}; its materials read 0")
