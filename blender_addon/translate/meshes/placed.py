# SPDX-License-Identifier: GPL-3.0-or-later
"""The instances of a scene's meshes. What all instances of an object share is read once: there may be thousands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import chain
from math import isfinite
from operator import sub
from typing import TYPE_CHECKING, Any

import numpy as np

from spectral_core.scene import Instance, Mesh

from ..context import makers_of, whole
from ..displacement.moved import displaced
from ..ledger import note_changed
from ..passes import read_by_passes
from ..placed_media import in_mesh
from ..shading.attributes import color_of, object_attributes, random_of, root_of
from ..viewport.kept import kept_or_made
from ..visibility import note_volume, seen_as, shown_by, terminator_of
from . import velocities
from .lacking import note_missing
from .triangles import READS_UV, object_mesh

if TYPE_CHECKING:
    from ..objects import Collected
    from ..shading.materials import TranslatedMaterial

AFFINE = (0.0, 0.0, 0.0, 1.0)
"""Last row of a matrix that moves, turns and scales."""
MaterialsOf = Callable[[Any], "list[TranslatedMaterial]"]


@dataclass(frozen=True, slots=True)
class Shared:
    """What the instances of an evaluated object have in common; ``fields``: of ``Instance``.

    ``varies``: True if the mesh or a material depends on the place of the instance.
    """

    mesh: Mesh
    materials: list[TranslatedMaterial]
    reads: frozenset[str]
    fields: dict[str, Any]
    varies: bool


def place_mesh(found: Collected, obj: Any, instance: Any, materials_of: MaterialsOf) -> None:
    """Add an instance of a mesh to the ``found`` objects; a note if its matrix is not finite."""
    rows = tuple(map(tuple, instance.matrix_world))
    if not all(map(isfinite, chain(*rows))):
        found.translation.note(obj.name, "its transform is not finite; the object was left out")
        return
    if max(map(abs, map(sub, rows[3], AFFINE))) > 1e-5:
        message = "Blender gives its instances no place, as it has a scale of 0 along an axis; they were left out"
        found.translation.note(obj.name, message)
        return
    original = obj.original
    source = (original.session_uid, obj.data.as_pointer())
    if source not in found.shared:
        found.shared[source] = _shared(found, obj, instance, materials_of)
    shared = found.shared[source]
    if shared is None:
        return
    mesh, materials, reads = shared.mesh, shared.materials, shared.reads
    if shared.varies:
        mesh = displaced(found, obj, instance, mesh, materials)
        # slots with one material share its medium: several would be equal grids, and take turns in the kept parts
        different = {id(item): item for item in materials}
        made = {key: in_mesh(found, obj, instance, mesh, item, (rows,)) for key, item in different.items()}
        materials = [made[id(item)] for item in materials]
    name = found.unique("instance", obj.name_full)
    fields = shared.fields | {
        "name": name,
        "mesh": mesh.name,
        "color": tuple(color_of(obj, instance)),
        "attributes": object_attributes(obj, instance, reads, found),
        **seen_as(instance, found.translation.depsgraph),
    }
    if all(item.material.surface is None for item in materials):
        fields["is_holdout"] = False  # as in Cycles, only a surface is one
    make = partial(_instance, found, obj, instance, mesh, materials, reads, fields)
    found.trace.places[original.session_uid] = len(found.instances)
    found.linking.add(name, original)
    if instance.is_instance:
        found.enter(make(), original, shown_by(instance))
        return
    names = tuple(item.material.name for item in materials)
    state = (rows, names, reads, tuple(fields.values()), mesh)
    makers = frozenset((original.session_uid, original.data.session_uid))
    key = ("instance", original.session_uid)
    found.enter(kept_or_made(found.kept, found.translation, key, makers, state, make), original)


def _shared(found: Collected, obj: Any, instance: Any, materials_of: MaterialsOf) -> Shared | None:
    """The common part of an object's instances; None if its mesh has no faces."""
    materials = materials_of(obj)
    reads = frozenset().union(*(item.reads for item in materials))
    shown = read_by_passes(found.translation.depsgraph)
    mesh = _mesh(found, obj, reads | shown | velocities.velocity_read(found, obj.data), instance)
    if mesh is None:
        return None
    fields = {
        "group": obj.original.lightgroup,  # Blender does not notify the evaluated copy of a change
        "index": int(obj.pass_index),
        "shown_as": obj.name,
        "asset": root_of(obj.original).name,
        **terminator_of(obj, whole(obj, found.translation.depsgraph)),
    }
    varies = any(item.displacement or item.filling is not None for item in materials)
    return Shared(mesh, materials, reads, fields, varies)


def _instance(
    found: Collected, obj: Any, instance: Any, mesh: Mesh, materials: list[TranslatedMaterial], reads: frozenset[str],
    fields: dict[str, Any],
) -> Instance:  # fmt: skip
    """The instance of a mesh, and the notes on its object."""
    highest = 0 if mesh.material_indices is None else int(mesh.material_indices.max())
    # a face beyond the last slot has the last material, as in Blender
    materials = materials + [materials[-1]] * (highest + 1 - len(materials))
    key = (obj.original.session_uid, obj.data.as_pointer())
    if not instance.is_instance or key not in found.noted:  # a kept part must have the notes of its own
        _note(found, obj, reads)
    if instance.is_instance:
        found.noted.add(key)
    if any(item.material.medium is not None for item in materials):
        note_volume(found.translation, obj.name, fields)
    matrix, names = np.array(instance.matrix_world, dtype=np.float64), tuple(item.material.name for item in materials)
    return Instance(world_from_object=matrix, materials=names, random=random_of(obj, instance), **fields)


def _note(found: Collected, obj: Any, reads: frozenset[str]) -> None:
    note_missing(found.translation, obj, reads)
    note_changed(found.translation, obj.name, getattr(whole(obj, found.translation.depsgraph), "cycles", None))
    if obj.mode == "SCULPT" and any(each.type == "MULTIRES" for each in obj.modifiers):
        found.translation.note(
            obj.name, "its multiresolution levels are shown after Sculpt Mode; here the base mesh is"
        )
    if any(getattr(modifier, "use_adaptive_subdivision", False) for modifier in obj.modifiers):  # from Blender 5.0 on
        message = "adaptive subdivision is not simulated; the mesh has the levels of its Subdivision Surface modifier"
        found.translation.note(obj.name, message)
    if obj.is_shadow_catcher and not found.is_render:
        message = "it is a shadow catcher in renders of F12 and spectral-scene, a plain object in the viewport"
        found.translation.note(obj.name, message)


def _mesh(found: Collected, obj: Any, reads: frozenset[str], instance: Any) -> Mesh | None:
    """Mesh of an evaluated object, shared by all objects with the same evaluated data."""
    wanted = READS_UV | {velocities.READ}
    reads = frozenset(name for name in reads if name in wanted or name.startswith(("generated", "attribute")))
    key = (obj.data.as_pointer(), reads)
    if key not in found.meshes:
        data = obj.original.data if obj.data.is_editmode else obj.data  # without a name of its own in Edit Mode
        name = found.unique("mesh", data.name_full)
        make = partial(object_mesh, name, obj, reads)
        if found.kept is None:
            found.meshes[key] = make()
        else:
            makers = makers_of(obj, instance)  # another mesh may use the same memory later
            whole = (*key, name, makers)
            found.kept_meshes.add(whole)
            found.meshes[key] = found.kept.mesh(whole, makers, make)
        found.settle_names()
    return found.meshes[key]
