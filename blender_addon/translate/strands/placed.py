# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and points in the scene: an instance for each, of its own mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from spectral_core.scene import STRAND_AXIS, Instance, Mesh, Principled, Subsurface, leaves

from ..context import stated
from ..meshes.tangents import SPACE
from ..meshes.triangles import READS_UV, stored_in
from ..meshes.velocities import velocity_read
from ..passes import read_by_passes
from ..shading.attributes import OF_STRANDS, PREFIX, color_of, object_attributes, random_of, root_of
from ..shading.materials import TranslatedMaterial
from ..visibility import seen_as, shown_by
from . import curves_mesh, particle_mesh, points_mesh
from .carried import content_of, radii_of
from .ends import has_open_ends

FLAT = 1e-30
"""Volume of an object's unit cube below which positions in the object are not defined."""


def place_strands(found: Any, obj: Any, instance: Any, materials: list[TranslatedMaterial], random: float) -> None:
    """Add hair curves, or a point cloud, to the ``found`` objects."""
    reads: frozenset[str] = velocity_read(found, obj.data).union(*(item.reads for item in materials))
    mesh = _mesh(found, obj, reads | read_by_passes(found.translation.depsgraph))
    if mesh is not None:
        _note_left_out(found, obj)
        _note_unread(found, obj, reads, mesh)
        _note_other_light(found, obj, materials)
        if obj.type == "CURVES":
            _note_open_ends(found, obj, mesh)
        if obj.type == "POINTCLOUD" and _is_stretched(instance):
            found.translation.note(obj.name, "its points are stretched; Cycles shades them with the normals of balls")
        modes = obj.data.attributes.get("normal_mode")
        if STRAND_AXIS in reads and modes is not None and any(item.value for item in modes.data):
            found.translation.note(obj.name, "its cross-sections follow normals of least twist, not those of its modes")
        _enter(found, instance, obj.name_full, mesh, materials)
        attributes = object_attributes(obj, instance, reads, found)
        found.instances[-1] = _with(found.instances[-1], random, attributes)


def _is_stretched(instance: Any) -> bool:
    """True if the matrix of an instance does not keep angles."""
    axes = np.array(instance.matrix_world, dtype=np.float64)[:3, :3]
    squares = axes.T @ axes
    return not np.allclose(squares, squares[0, 0] * np.eye(3), atol=0.02 * abs(squares[0, 0]))


def _mesh(found: Any, obj: Any, reads: frozenset[str]) -> Mesh | None:
    """Mesh of evaluated hair curves or of a point cloud, shared by all objects with the same evaluated data."""
    key = (obj.data.as_pointer(), reads)
    if key not in found.meshes:
        name = found.unique("mesh", obj.data.name_full)
        make = partial(curves_mesh if obj.type == "CURVES" else points_mesh, name, obj.data, reads)
        if found.kept is None:
            found.meshes[key] = make()
        else:
            whole = (obj.original.session_uid, name, reads)
            found.kept_meshes.add(whole)
            found.meshes[key] = found.kept.strands(whole, content_of(obj.data, reads), make)
        found.settle_names()
    mesh: Mesh | None = found.meshes[key]
    return mesh


def place_hair(found: Any, instance: Any, materials_of: Callable[[Any], list[TranslatedMaterial]]) -> None:
    """Add the particle hair of an object, which is no separate object, wherever the object or an instance of it is."""
    translation, obj = found.translation, instance.object
    for system in obj.particle_systems:
        settings = system.settings
        if settings.type != "HAIR" or settings.render_type != "PATH" or stated(obj, translation.depsgraph).hide_render:
            continue
        if not translation.depsgraph.view_layer_eval.use_strand:
            continue
        if not found.is_render:
            translation.note(obj.name, "particle hair is in renders of F12 and spectral-scene, not in the viewport")
            continue
        if abs(obj.matrix_world.determinant()) < FLAT:
            translation.note(obj.name, "it has no size along one of its axes; its particle hair is left out")
            continue
        name = f"{obj.name_full} {system.name}"
        materials = materials_of(obj)
        material = materials[min(max(settings.material - 1, 0), len(materials) - 1)]
        if name not in found.meshes:
            in_render, reads = translation.depsgraph.mode == "RENDER", read_by_passes(translation.depsgraph)
            unique = found.unique("mesh", name)
            found.meshes[name] = particle_mesh(unique, obj, system, is_render=in_render, reads=material.reads | reads)
        mesh = found.meshes[name]
        if mesh is None:
            continue
        if settings.kink == "SPIRAL" and len(system.child_particles):
            translation.note(obj.name, "the spirals at the ends of its hair differ a little from those of Cycles")
        _note_open_ends(found, obj, mesh)
        _note_unread(found, obj, material.reads, mesh)
        _note_other_light(found, obj, [material])
        _enter(found, instance, name, mesh, [material])
        attributes = object_attributes(obj, instance, material.reads, found)
        found.instances[-1] = _with(found.instances[-1], random_of(obj, instance), attributes)


def _enter(found: Any, instance: Any, name: str, mesh: Mesh, materials: list[TranslatedMaterial]) -> None:
    obj = instance.object
    found.enter(
        Instance(
            found.unique("instance", name),
            mesh.name,
            np.array(instance.matrix_world, dtype=np.float64),
            tuple(item.material.name for item in materials),
            obj.original.lightgroup,
            color=tuple(color_of(obj, instance)),
            index=int(obj.pass_index),
            shown_as=obj.name,
            asset=root_of(obj.original).name,
            **seen_as(instance, found.translation.depsgraph),
        ),
        obj.original,
        shown_by(instance),
    )


def _with(instance: Instance, random: float, attributes: Any) -> Instance:
    return replace(instance, random=random, attributes=attributes)


def _note_open_ends(found: Any, obj: Any, mesh: Mesh) -> None:
    """Note strands whose ends are wide."""
    if has_open_ends(mesh):
        message = (
            "wide strands of its hair are open at their ends, where Cycles closes them; let their radius fall to 0"
        )
        found.translation.note(obj.name, message)


def _note_left_out(found: Any, obj: Any) -> None:
    """Note the points of hair or of a point cloud that have no place or size."""
    places = stored_in(obj.data.attributes["position"], exact=True)
    assert places is not None
    is_whole = np.isfinite(radii_of(obj.data)) & np.isfinite(places).all(axis=1)
    count = int(np.count_nonzero(~is_whole))
    if count:
        which = (
            "1 of its points has a position or radius that is"
            if count == 1
            else (f"{count:,} of its points have positions or radii that are")
        )
        found.translation.note(obj.name, f"{which} not finite; the hair or balls at such points are left out")


def _note_unread(found: Any, obj: Any, reads: frozenset[str], mesh: Mesh) -> None:
    """Note the attributes that materials read but hair or points do not have."""
    there = {attribute.name for attribute in mesh.attributes} | ({"uv"} if mesh.uvs is not None else set())
    for read in sorted(reads - there):
        if read.startswith(SPACE):  # as in Cycles, normal maps have no effect on hair
            continue
        if read in READS_UV or read.startswith(("generated", "attribute", PREFIX + OF_STRANDS)):
            what = read.partition(":")[2] or read
            found.translation.note(obj.name, f"{what!r} of its hair or points is not translated; its materials read 0")


def _note_other_light(found: Any, obj: Any, materials: list[TranslatedMaterial]) -> None:
    """Note what Cycles shades in another way on hair and points than on meshes."""
    closures = [closure for item in materials for closure in leaves(item.material.surface)]
    if any(isinstance(c, Subsurface) or (isinstance(c, Principled) and c.subsurface_weight != 0) for c in closures):
        advice = "Cycles renders it black on hair and dim on points; give them a material without subsurface scattering"
        found.translation.note(obj.name, f"its hair or points scatter light below the surface as a mesh does. {advice}")
    if any("parametric" in item.reads for item in materials):
        words = "the Parametric coordinates of its hair or points are those of their triangles; Cycles has others"
        found.translation.note(obj.name, words)
