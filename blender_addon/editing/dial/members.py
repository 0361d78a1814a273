# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of a Blender scene by light group, with their brightness."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from bpy.types import ID, Node, NodeSocket, NodeTree, Object, ViewLayer, bpy_prop_collection

from ... import compat
from ...translate.volumes import has_transfer

if TYPE_CHECKING:
    from spectral_core.scene import Scene as SpectralScene

STRENGTHS: dict[str, dict[str, str]] = {
    "EMISSION": {"Strength": "Color"},
    "BACKGROUND": {"Strength": "Color"},
    "BSDF_PRINCIPLED": {"Emission Strength": "Emission Color"},
    "PRINCIPLED_VOLUME": {"Emission Strength": "Emission Color", "Blackbody Intensity": "Blackbody Tint"},
}
"""Sockets with a strength of each type of node, and that of its color."""
BELOW_ZERO = ("EMISSION", "BACKGROUND")
"""Nodes that remove light if their strength is below 0; of others such a strength counts as 0."""
WITH_MATERIALS = ("MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES", "POINTCLOUD", "VOLUME")
SEALED = "*"
"""In place of the socket of light that cannot be dimmed: a node group, Volume Coefficients, or, without a node, a whole
material or world, see ``sealed_besides``.
"""
DIMMER = "Light Dial of "
"""Prefix of the name of the node that dims a strength computed by other nodes."""


@dataclass(frozen=True)
class Member:
    """Data of ``SpectralDialMember``. ``owner``: session number of a lamp's or emissive mesh's Object, of a World, or
    of a Material of which all light is sealed; the data itself may be deleted while it is recorded, or be another one
    after an undo.
    """

    group: str
    owner: int
    slot: int
    node: str
    base: float
    socket: str = ""
    name: str = ""
    """Name of the object when it was found; "" for a world or a material."""


def members_of(layer: ViewLayer, objects: Iterable[Object], one_per_light: bool) -> list[Member]:
    """All light sources among ``objects`` and the world of a view layer, by group. ``objects`` are originals."""
    found = []
    emitting: dict[int, bool] = {}
    for each in objects:
        group = each.name_full if one_per_light else each.lightgroup
        if each.type == "LIGHT" and each.data.energy != 0:
            found.append(Member(group, each.session_uid, -1, "", each.data.energy, name=each.name_full))
        elif each.type in WITH_MATERIALS and layer.material_override is None and not _has_transfer(each):
            for number, slot in enumerate(each.material_slots):
                emissive, name = _emissive(slot.material, emitting), each.name_full
                found += [Member(group, each.session_uid, number, *entry, name=name) for entry in emissive]
    world = layer.world_override or layer.id_data.world
    if world is not None:
        group = getattr(world, "lightgroup", "") or ("World" if one_per_light else "")
        # a lamp of that name has its own bulb, so the second one is numbered, as in the core and in Blender
        taken, name, number = ({member.group for member in found} if one_per_light else set()), group, 0
        while group in taken:
            number += 1
            group = f"{name}.{number:03d}"
        found += [Member(group, world.session_uid, -1, *entry) for entry in _emissive(world, emitting)]
    return found


def sealed_besides(
    scene: SpectralScene, members: Sequence[Member], layer: ViewLayer, one_per_light: bool
) -> list[Member]:
    """Sources of light of a translated scene that no member of their group can dim.

    They are materials that no slot of their object holds, as of Set Material in geometry nodes or of a view layer's
    override, and materials and worlds that emit light by no strength, as by a color that is linked to Surface.
    Instances of an object with members in another group are not listed.
    """
    from spectral_core.render.light_groups import emits_from_surface, world_paints
    from spectral_core.render.relight.groups import one_group_per_light

    grouped = one_group_per_light(scene) if one_per_light else scene
    emissive = {material.name for material in grouped.materials if emits_from_surface(material)}
    blocks = {each.name_full: each for each in bpy.data.materials if each.name_full in emissive}
    objects = {each.session_uid: each for each in bpy.data.objects}
    dimmed: dict[str, set[str]] = {}
    for member in members:
        if member.slot >= 0 and member.owner in objects:
            material = objects[member.owner].material_slots[member.slot].material
            for place in (f"group {member.group}", f"object {objects[member.owner].name}", "any"):
                dimmed.setdefault(place, set()).add(material.name_full)
    found = set()
    for instance in grouped.instances:
        own = f"object {instance.shown_as}" if instance.shown_as else "any"
        reached = dimmed.get(f"group {instance.group}", set()) | dimmed.get(own, set())
        found |= {(instance.group, name) for name in set(instance.materials) & blocks.keys() - reached}
    sealed = [Member(group, blocks[name].session_uid, 0, "", 1.0, SEALED) for group, name in sorted(found)]
    worlds = {each.session_uid: each for each in bpy.data.worlds}
    if world_paints(grouped.world) and not any(member.owner in worlds for member in members):
        world = layer.world_override or layer.id_data.world
        sealed += [] if world is None else [Member(grouped.world.group, world.session_uid, -1, "", 1.0, SEALED)]
    return sealed


def group_count(layer: ViewLayer, one_per_light: bool) -> int:
    """Number of bulbs of a recording of a view layer, fast enough for a panel."""
    shown = [each for each in layer.id_data.objects if not each.hide_render]
    return len({member.group for member in members_of(layer, shown, one_per_light)})


def _has_transfer(each: Object) -> bool:
    """True for a volume whose transfer function takes the place of its material."""
    return each.type == "VOLUME" and has_transfer(each.data)


def _emissive(owner: ID, emitting: dict[int, bool]) -> list[tuple[str, float, str]]:
    """Emissive nodes of a material or world, with their strength and its socket; 1 if other nodes compute it.

    ``emitting``: by session number of a node group whether it emits light, as far as known.
    """
    tree = None if owner is None else compat.node_tree(owner)
    found = []
    for node in () if tree is None else tree.nodes:
        for socket in strength_sockets(node):
            if socket.is_linked:
                found.append((node.name, _dimmer_value(tree, node, socket), socket.name))
            elif _shines(node, socket):
                found.append((node.name, socket.default_value, socket.name))
        if _is_sealed(node, emitting):
            found.append((node.name, 1.0, SEALED))
    return found


def _is_sealed(node: Node, emitting: dict[int, bool]) -> bool:
    """True if a node emits light by no strength of its own: a group, or a volume with an emission per color."""
    if node.type == "GROUP" and node.node_tree is not None:
        tree = node.node_tree
        if tree.session_uid not in emitting:
            emitting[tree.session_uid] = any(_is_sealed(each, emitting) or _emits(each) for each in tree.nodes)
        return emitting[tree.session_uid]
    emission = node.inputs.get("Emission Coefficients") if node.type == "VOLUME_COEFFICIENTS" else None
    return emission is not None and (emission.is_linked or any(emission.default_value))


def _emits(node: Node) -> bool:
    sockets = strength_sockets(node)
    return any(each.is_linked or _shines(node, each) for each in sockets)


def _shines(node: Node, strength: NodeSocket) -> bool:
    """True if a node emits or removes light by the number of a strength."""
    value = strength.default_value
    return (value > 0 or (value < 0 and node.type in BELOW_ZERO)) and not _is_black(node, strength)


def _is_black(node: Node, strength: NodeSocket) -> bool:
    color = node.inputs.get(STRENGTHS[node.type][strength.name])
    return color is not None and not color.is_linked and not any(color.default_value[:3])


def strength_sockets(node: Node) -> list[NodeSocket]:
    """Sockets of a node with a strength of its emission."""
    found = [node.inputs.get(name) for name in STRENGTHS.get(node.type, ())]
    return [socket for socket in found if socket is not None]


def dimmer_name(node: Node, socket: NodeSocket) -> str:
    """The name of the node that dims a strength; for a second strength of a node it has the socket's name, too."""
    first = next(iter(STRENGTHS[node.type]))
    return f"{DIMMER}{node.name}" + ("" if socket.name == first else f", {socket.name}")


def _dimmer_value(tree: NodeTree, node: Node, socket: NodeSocket) -> float:
    dimmer = tree.nodes.get(dimmer_name(node, socket))
    return 1.0 if dimmer is None else dimmer.inputs[1].default_value


def store_members(bulbs: bpy_prop_collection, members: list[Member]) -> int:
    """Store members with the bulbs of their groups; returns the number of those whose data are gone."""
    alive = {each.session_uid: each for each in (*bpy.data.objects, *bpy.data.worlds, *bpy.data.materials)}
    for bulb in bulbs:
        bulb.members.clear()
        bulb.lit, bulb.is_dark = 1.0, False
        for member in members:
            if member.group == bulb.name and member.owner in alive:
                kept = bulb.members.add()
                kept.owner, kept.name = alive[member.owner], member.name
                kept.slot, kept.node, kept.socket, kept.base = member.slot, member.node, member.socket, member.base
    return sum(member.owner not in alive for member in members)


def forget_deleted() -> None:
    """Let members forget objects that were deleted in a view or the Outliner: a reference keeps these in the file."""
    members = [m for scene in bpy.data.scenes for bulb in scene.spectral.dial.bulbs for m in bulb.members]
    bindings = [entry.block for scene in bpy.data.scenes for entry in scene.spectral.board.bindings]
    owners = [member.owner for member in members]
    for owner in {each for each in owners if isinstance(each, Object) and not each.users_collection}:
        if owner.users - owner.use_fake_user <= owners.count(owner) + bindings.count(owner):
            for member in members:
                if member.owner == owner and member.id_data.library is None:
                    member.owner = None


def color_bulbs(bulbs: bpy_prop_collection, lights: Sequence[Any]) -> None:
    """Give each bulb the color of its light (an Illuminant); white if the lights of a group differ (None)."""
    from spectral_core.spectra.color import display_rgb_from_linear, linear_rgb_from_xyz
    from spectral_core.spectra.observer import xyz_of

    for bulb, light in zip(bulbs, lights, strict=True):
        linear = np.ones(3) if light is None else np.maximum(linear_rgb_from_xyz(xyz_of(light)), 0.0)
        bulb.color = display_rgb_from_linear(linear / max(float(linear.max()), 1e-9))
