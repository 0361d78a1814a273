# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes that depend on the whole scene: materials, shapes and light paths that together differ from Cycles."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene.units import SMALLEST_RADIUS, at_origin, typical_size
from spectral_core.scene import (
    AddSurface,
    Glass,
    Glossy,
    Holdout,
    Mesh,
    Metal,
    Principled,
    Scene,
    Sheen,
    Subsurface,
    SumSurface,
    Surface,
    Translucent,
    Transparent,
    emissions_of,
    leaves,
)
from spectral_core.scene.leaves import INNER, parts_of

from .context import Translation
from .faces.coincident import coincident, doubled, edges
from .faces.overlapping import overlapping
from .faces.volumes import volumes_in_one_place
from .lighting.linked_shadows import note_linked_shadows_beside_mirrors
from .lighting.rough_glass import note_lamps_beside_rough_glass

Array = NDArray[np.float64]

FLAT = 1e-12
"""Volume of an instance of a unit cube, relative to its longest edge cubed, at which it is flat for Cycles."""
FEW = 0.01
"""Largest share of corners whose normals point to the other side of their faces."""


def note_approximations(translation: Translation, scene: Scene, *, compares_faces: bool) -> None:
    """Add one note per object, light or scene; those on faces that coincide only if ``compares_faces``."""
    surfaces = {material.name: material.surface for material in scene.materials}
    meshes = {mesh.name: mesh for mesh in scene.meshes}
    enters = {name for name, surface in surfaces.items() if _enters(surface)}
    turned: dict[str, bool] = {}
    for instance in scene.instances if enters else ():
        if not enters.intersection(instance.materials):
            continue
        if instance.mesh not in turned:
            turned[instance.mesh] = _is_turned(meshes[instance.mesh])
        if turned[instance.mesh]:
            message = (
                "faces of its smooth-shaded mesh point both outward and inward: translucent, subsurface and sheen "
                "light differs from Cycles there; Mesh > Normals > Recalculate Outside mends the mesh"
            )
            translation.note(instance.shown_as or instance.name, message)
    if compares_faces:
        passes = enters | {
            name for name, surface in surfaces.items() if _refracts(surface) or _is_seen_through(surface)
        }
        rendered = _as_rendered(scene)
        _note_faces(translation, rendered, meshes, passes)
        _note_volumes_in_one_place(translation, rendered, meshes)
    _note_flattened(translation, scene)
    _note_holes(translation, scene)
    note_lamps_beside_rough_glass(translation, scene)
    note_linked_shadows_beside_mirrors(translation, scene)
    _note_clear_catchers(translation, scene, {name for name, each in surfaces.items() if _is_seen_through(each)})
    _note_shadows_of_volumes(translation, scene)
    _note_emission_with_shadow_links(
        translation, scene, {name for name, each in surfaces.items() if any(emissions_of(each))}
    )
    for name, surface in surfaces.items():
        if _adds_metals(surface):
            message = (
                "Add Shader adds metals; where they reflect more light than arrives, the picture differs from Cycles"
            )
            translation.note(name, f"{message}; use Mix Shader")
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


def _as_rendered(scene: Scene) -> Scene:
    """The scene with its instances where the renderer has them, which moves far scenes and scales small ones: faces
    coincide within the distance from which its rays start.
    """
    near, _ = at_origin(scene)
    size = typical_size(near)
    if not 0.0 < size < SMALLEST_RADIUS:
        return near
    larger = np.diag([1.0 / size] * 3 + [1.0])
    instances = (replace(item, world_from_object=larger @ item.world_from_object) for item in near.instances)
    return replace(near, instances=tuple(instances))


def _note_holes(translation: Translation, scene: Scene) -> None:
    """Note holdouts and shadow catchers of a scene with volumes."""
    media = [material.medium for material in scene.materials]
    if scene.world.medium is None and all(medium is None for medium in media):
        return
    cuts = {m.name for m in scene.materials if any(isinstance(leaf, Holdout) for leaf in leaves(m.surface))}
    for instance in scene.instances:
        if instance.is_holdout or cuts.intersection(instance.materials):
            message = (
                "it is a holdout, and cuts out the light and the alpha of volumes in front of it; Cycles keeps them"
            )
            translation.note(instance.shown_as or instance.name, message)
        if instance.is_shadow_catcher:
            message = "it is a shadow catcher that does not catch the shadows of volumes; in Cycles it catches them"
            translation.note(instance.shown_as or instance.name, message)


def _note_clear_catchers(translation: Translation, scene: Scene, clear: set[str]) -> None:
    """Note shadow catchers through which other objects are seen; ``clear``: materials that are partly transparent."""
    for instance in scene.instances:
        if instance.is_shadow_catcher and clear.intersection(instance.materials):
            message = "it is a shadow catcher with transparent parts: objects are seen through them, unlike in Cycles"
            translation.note(instance.shown_as or instance.name, message)


def _note_shadows_of_volumes(translation: Translation, scene: Scene) -> None:
    """Note objects with volumes whose shadow linking leaves out a lamp."""
    filled = {material.name for material in scene.materials if material.medium is not None}
    for instance in scene.instances:
        if instance.clear_for and filled.intersection(instance.materials):
            lamps = ", ".join(map(repr, instance.clear_for))
            message = (
                f"its volume takes light of {lamps} away, although Shadow Linking excludes the object as a blocker"
            )
            translation.note(instance.shown_as or instance.name, message)


def _note_volumes_in_one_place(translation: Translation, scene: Scene, meshes: dict[str, Mesh]) -> None:
    """Note volumes that share faces, and volumes of several phase functions and colors that overlap."""
    for one, other, shares_faces, differs in volumes_in_one_place(scene, meshes):
        name, second = (item.shown_as or item.name for item in (one, other))
        if shares_faces:
            message = (
                f"faces of its volume coincide with those of {second!r}: Cycles loses one of the two volumes behind "
                "them, here both add up; move the object by a thousandth of its size"
            )
            translation.note(name, message)
        if differs:
            message = (
                f"its volume overlaps that of {second!r}, which scatters other colors into other directions: here each "
                "color has its own shares of the two, Cycles gives all colors the same shares"
            )
            translation.note(name, message)


def _note_emission_with_shadow_links(translation: Translation, scene: Scene, emits: set[str]) -> None:
    """Note objects of materials that emit, whose shadow linking leaves out other objects, beside lamps."""
    linked = {name for instance in scene.instances for name in instance.clear_for} if scene.lights else set()
    for instance in scene.instances if linked else ():
        if instance.name in linked and emits.intersection(instance.materials):
            message = "its emission has shadow linking: beside lamps, Cycles loses a part of its light, here it is kept"
            translation.note(instance.shown_as or instance.name, message)


def _note_flattened(translation: Translation, scene: Scene) -> None:
    """Note instances of a mesh with several that have a scale of 0 along an axis."""
    counts = Counter(item.mesh for item in scene.instances)
    several = [item for item in scene.instances if counts[item.mesh] > 1]
    if not several:
        return
    matrices = np.stack([item.world_from_object[:3, :3] for item in several])
    lengths = np.linalg.norm(matrices, axis=1).max(axis=1)
    for item in itertools.compress(several, np.abs(np.linalg.det(matrices)) <= FLAT * lengths**3):
        message = "it is flat, with a scale of 0: Cycles does not show instances of such a scale, here they are shown"
        translation.note(item.shown_as or item.name, f"{message}; give it a scale of 0.001")


def _adds_metals(surface: Surface | None) -> bool:
    """True if one sum of a surface has metals on both sides."""
    has_metal: dict[int, bool] = {}
    stack = [(surface, False)]
    while stack:  # each node after its sides: a tree may be thousands of mixes deep
        item, are_sides_known = stack.pop()
        if not isinstance(item, INNER):
            has_metal[id(item)] = isinstance(item, Metal)
        elif are_sides_known:
            sides = [has_metal[id(inner)] for inner in parts_of(item)]
            if isinstance(item, AddSurface) and all(sides):
                return True
            if isinstance(item, SumSurface) and sum(sides) > 1:
                metals = (weight for (weight, _), is_metal in zip(item.parts, sides, strict=True) if is_metal)
                return sum(weight.constant for weight in metals) > 1
            has_metal[id(item)] = any(sides)
        else:
            stack += [(item, True), *((inner, False) for inner in parts_of(item))]
    return False


def _note_faces(translation: Translation, scene: Scene, meshes: dict[str, Mesh], passes: set[str]) -> None:
    """Note faces that lie on each other; ``passes``: names of the materials that light passes through."""
    shown = {item.name: item.shown_as or item.name for item in scene.instances}

    def note(name: str, other: str, words: str) -> None:
        """Once for an object, however many instances of it have such faces."""
        here = "each other" if name == other else f"faces of {shown[other]!r}"
        if name != other and shown[name] == shown[other]:
            here = "those of another instance of it"
        translation.note(shown[name], words.format(here))

    for name, other in coincident(scene, meshes, passes):
        lost = "Cycles loses light between them, here it is kept; move the object by a thousandth of its size"
        note(name, other, f"faces of it coincide with {{}}: {lost}")
    darkens = "Cycles darkens them by chance; here they look like a single face"
    twice = dict(doubled(scene, meshes))
    for name, other in twice.items():
        remedy = "remove one of the two, as with Mesh > Merge by Distance"
        note(name, other, f"faces of it are the same as {{}}: {darkens}; {remedy}")
    for name, other in overlapping(scene, meshes):
        if name not in twice:
            remedy = "move one of the two by a ten-thousandth of its size"
            note(name, other, f"faces of it overlap {{}} in one plane: {darkens}; {remedy}")


def _refracts(surface: Surface | None) -> bool:
    return any(
        isinstance(leaf, Glass) or (isinstance(leaf, Principled) and leaf.transmission != 0) for leaf in leaves(surface)
    )


def _is_seen_through(surface: Surface | None) -> bool:
    return any(
        isinstance(leaf, Transparent) or (isinstance(leaf, Principled) and leaf.alpha != 1.0)
        for leaf in leaves(surface)
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


def _is_turned(mesh: Mesh) -> bool:
    """True if interpolated normals point to the other side of their faces."""
    if mesh.normals is None:
        return False
    faces = np.cross(*edges(mesh.positions[mesh.triangles].astype(np.float64)))
    size = np.linalg.norm(faces, axis=1)
    kept = size > 0
    normals = mesh.normals[mesh.triangles[kept]].astype(np.float64)
    cosines = np.einsum("tci,ti->tc", normals, faces[kept] / size[kept, None])
    return bool((cosines < 0.0).mean() > FEW) if cosines.size else False
