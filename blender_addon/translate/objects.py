# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that stands in a scene: instances of shared meshes, lamps, and what has no place here, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Instance, Light, Material, Mesh, Rays, VolumeObject

from .. import compat
from .context import Translation, overridden
from .ledger import note_changed, note_nodes
from .lighting.lights import translate_light
from .meshes import READS_UV, translate_mesh, uv_layer
from .shading.attributes import object_attributes
from .shading.materials import Dressed, translate_material
from .viewport.kept import Kept
from .visibility import Linking, hidden_from
from .volumes import translate_volume

AS_MESH = ("CURVE", "SURFACE", "FONT", "META")
"""Objects whose faces, where they have any, Blender lists as a mesh instance of its own."""
LEFT_OUT = {
    "CURVES": "hair curves are not rendered; convert them to a mesh to see them",
    "POINTCLOUD": "point clouds are not rendered; instance a mesh on the points to see them",
    "GPENCIL": "grease pencil is not rendered",
    "GREASEPENCIL": "grease pencil is not rendered",
}
UNSEEN = ("EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE")


@dataclass
class Collected:
    """What a walk over the depsgraph has found so far, everything named once."""

    translation: Translation
    meshes: dict[Any, Mesh | None] = field(default_factory=dict)
    dressed: dict[Any, Dressed] = field(default_factory=dict)
    instances: list[Instance] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    volumes: list[VolumeObject] = field(default_factory=list)
    linking: Linking = field(default_factory=Linking)
    originals: list[Any] = field(default_factory=list)
    """Of each instance the object that it comes from."""
    kept: Kept | None = None
    _names: dict[str, int] = field(default_factory=dict)

    @property
    def materials(self) -> tuple[Material, ...]:
        """Each material that is worn, once."""
        return tuple({dressed.material.name: dressed.material for dressed in self.dressed.values()}.values())

    def unique(self, kind: str, name: str) -> str:
        """``name`` for its first use, with a count after it from then on."""
        key = f"{kind} {name}"
        self._names[key] = count = self._names.get(key, 0) + 1
        return name if count == 1 else self.unique(kind, f"{name} #{count}")


def everything(_instance: Any) -> bool:
    """Whether an instance takes part where nothing more is asked."""
    return True


def collect(translation: Translation, shows: Callable[[Any], bool] = everything, kept: Kept | None = None) -> Collected:
    """Walk over every instance that the render shows, and that ``shows`` lets pass; ``kept``: meshes from before."""
    found = Collected(translation, kept=kept)
    for instance in translation.depsgraph.object_instances:
        thing = instance.object
        if not shows(instance):
            continue
        if not instance.show_self and not (instance.is_instance and instance.show_particles):
            continue
        try:
            _collect_one(found, thing, instance)
        except InvalidInputError as error:
            translation.note(thing.name, f"{error}; the object was left out")
    found.instances = [
        replace(item, unlit_by=found.linking.unlit_by(thing), clear_for=found.linking.clear_for(thing))
        for item, thing in zip(found.instances, found.originals, strict=True)
    ]
    _note_hair(found)
    return found


def _collect_one(found: Collected, thing: Any, instance: Any) -> None:
    translation = found.translation
    if thing.type == "LIGHT":
        light = translate_light(translation, found.unique("light", thing.name_full), thing, instance.matrix_world)
        if light is not None:
            found.lights.append(light)
            found.linking.add(light.name, thing.original)
    elif thing.type == "MESH":
        if translation.depsgraph.view_layer_eval.use_solid:
            _collect_mesh(found, thing, instance)
    elif thing.type == "VOLUME":
        if translation.depsgraph.view_layer_eval.use_volumes:
            translate_volume(found, thing, instance)
    elif thing.type not in AS_MESH + UNSEEN:
        translation.note(thing.name, LEFT_OUT.get(thing.type, f"objects of type {thing.type.lower()} are not rendered"))


def _collect_mesh(found: Collected, thing: Any, instance: Any) -> None:
    matrix = np.array(instance.matrix_world, dtype=np.float64)
    if not np.isfinite(matrix).all():
        found.translation.note(thing.name, "its transform is not finite; the object was left out")
        return
    override = overridden(found.translation.depsgraph, "material_override")
    dressed = [_dress(found, override or material) for material in _materials(thing)]
    reads = frozenset().union(*(item.reads for item in dressed))
    mesh = _mesh(found, thing, reads, instance)
    if mesh is None:
        return
    highest = 0 if mesh.material_indices is None else int(mesh.material_indices.max())
    dressed += [dressed[-1]] * (highest + 1 - len(dressed))  # a face past the last slot wears the last, as in Blender
    _note_missing(found, thing, reads)
    note_changed(found.translation, thing.name, getattr(thing, "cycles", None))
    layer, original = found.translation.depsgraph.view_layer, thing.original
    if thing.is_shadow_catcher:
        found.translation.note(thing.name, "it is a shadow catcher, which is rendered as a plain object")
    is_holdout = bool(thing.is_holdout or original.holdout_get(view_layer=layer))
    if is_holdout and not found.translation.scene.render.film_transparent:
        found.translation.note(thing.name, "it is a holdout: black, and a hole only where the film is transparent")
    hidden = hidden_from(thing)
    if original.indirect_only_get(view_layer=layer):
        hidden |= Rays.CAMERA
    found.originals.append(original)
    found.instances.append(
        Instance(
            found.unique("instance", thing.name_full),
            mesh.name,
            matrix,
            tuple(item.material.name for item in dressed),
            original.lightgroup,  # Blender does not tell the evaluated copy of a change
            hidden,
            is_holdout,
            color=tuple(thing.color),
            index=int(thing.pass_index),
            attributes=object_attributes(thing, instance, reads),
            random=_random(thing, instance),
        )
    )


def _random(thing: Any, instance: Any) -> float:
    """Random number of an instance as Blender draws it; of an object by itself as Cycles makes it from its name."""
    if instance.is_instance:
        return float((instance.random_id & 0xFFFFFFFF) / 0xFFFFFFFF)
    word = 0
    for byte in thing.name.encode():
        word = (word * 37 + byte) & 0xFFFFFFFF
    # Jenkins' lookup3, its final mix, on the words (hash, 0)
    a = (0xDEADBEEF + (2 << 2) + 13 + word) & 0xFFFFFFFF
    b = c = (0xDEADBEEF + (2 << 2) + 13) & 0xFFFFFFFF
    for first, second, third in ((14, 11, 25), (16, 4, 14)):
        c = ((c ^ b) - _rotated(b, first)) & 0xFFFFFFFF
        a = ((a ^ c) - _rotated(c, second)) & 0xFFFFFFFF
        b = ((b ^ a) - _rotated(a, third)) & 0xFFFFFFFF
    return float((((c ^ b) - _rotated(b, 24)) & 0xFFFFFFFF) / 0xFFFFFFFF)


def _rotated(word: int, bits: int) -> int:
    return ((word << bits) | (word >> (32 - bits))) & 0xFFFFFFFF


def _materials(thing: Any) -> list[Any]:
    slots = [slot.material for slot in thing.material_slots]
    return slots or list(getattr(thing.data, "materials", ())) or [None]


def _dress(found: Collected, material: Any) -> Dressed:
    key = None if material is None else material.as_pointer()
    if key not in found.dressed and material is not None:
        for item in (material, getattr(material, "cycles", None)):
            note_changed(found.translation, material.name, item)
        note_nodes(found.translation, material.name, compat.node_tree(material))
    if key not in found.dressed:
        found.dressed[key] = translate_material(found.translation, material)
    return found.dressed[key]


def _note_missing(found: Collected, thing: Any, reads: frozenset[str]) -> None:
    """Name the UV maps and attributes that materials ask for and the mesh lacks: they read as 0, as in Blender."""
    if "uv" in reads and uv_layer(thing.data, "") is None:
        found.translation.note(thing.name, "it has no UV map for the images on it; they show their corner pixel")
    undeformed = getattr(thing.original, "data", None)
    count = len(getattr(undeformed, "vertices", ())) if thing.original.type == "MESH" else len(thing.data.vertices)
    if "generated" in reads and count != len(thing.data.vertices):
        found.translation.note(thing.name, "its generated coordinates are those of the mesh after its modifiers")
    for name in sorted(reads):
        kind, _, attribute = name.partition(":")
        if kind == "attribute" and attribute and attribute not in thing.data.attributes:
            found.translation.note(thing.name, f"it has no UV map or attribute {attribute!r}; its materials read 0")


def _mesh(found: Collected, thing: Any, reads: frozenset[str], instance: Any) -> Mesh | None:
    """Mesh of an evaluated object, shared by all that have the same evaluated data."""
    reads = frozenset(name for name in reads if name in READS_UV or name.startswith(("generated", "attribute")))
    key = (thing.data.as_pointer(), reads)
    if key not in found.meshes:
        undeformed = getattr(thing.original, "data", None) if thing.original.type == "MESH" else None
        name = found.unique("mesh", thing.data.name_full)
        make = partial(translate_mesh, name, thing.data, reads, undeformed)
        if found.kept is None:
            found.meshes[key] = make()
        else:
            found.meshes[key] = found.kept.mesh((*key, name), _makers(thing, instance), make)
    return found.meshes[key]


def _makers(thing: Any, instance: Any) -> frozenset[int]:
    """Session numbers of what a mesh is made from; none where it is made anew by geometry nodes or the like."""
    source = thing.original
    data = getattr(source, "data", None)
    blocks = [source, data, instance.parent.original if instance.parent else None]
    return frozenset(block.session_uid for block in blocks if block is not None)


def _note_hair(found: Collected) -> None:
    """Particle hair is no object of its own: ask the objects that grow it."""
    for thing in found.translation.depsgraph.objects:
        for system in getattr(thing, "particle_systems", ()):
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                found.translation.note(thing.name, "particle hair is not rendered; convert it to a mesh to see it")
