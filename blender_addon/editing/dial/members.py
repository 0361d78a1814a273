# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of a Blender scene by light group, and the writing of their brightness."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from bpy.types import ID, Node, NodeSocket, NodeTree, Object, PropertyGroup, Scene, bpy_prop_collection

from spectral_core.errors import InvalidInputError

from ... import compat
from ...translate.volumes import has_transfer
from .names import name_of

STRENGTHS: dict[str, dict[str, str]] = {
    "EMISSION": {"Strength": "Color"},
    "BACKGROUND": {"Strength": "Color"},
    "BSDF_PRINCIPLED": {"Emission Strength": "Emission Color"},
    "PRINCIPLED_VOLUME": {"Emission Strength": "Emission Color", "Blackbody Intensity": "Blackbody Tint"},
}
"""Sockets with a strength of each type of node, and that of its color."""
WITH_MATERIALS = ("MESH", "CURVE", "SURFACE", "FONT", "META", "VOLUME")
DIMMER = "Light Dial of "
"""Prefix of the name of the node that dims a strength computed by other nodes."""


@dataclass(frozen=True)
class Member:
    """Data of ``SpectralDialMember``. ``owner``: session number of a lamp's or emissive mesh's Object, or of a World;
    the data itself may be deleted while it is recorded, or be another one after an undo.
    """

    group: str
    owner: int
    slot: int
    node: str
    base: float
    socket: str = ""
    name: str = ""
    """Name of the object when it was found; "" for a world."""


def members_of(scene: Scene, objects: Iterable[Object], one_per_light: bool) -> list[Member]:
    """All light sources among ``objects`` and the scene's world, by group. ``objects`` are originals.

    Raises InvalidInputError for emission within a node group, whose strength cannot be set from outside.
    """
    found = []
    for each in objects:
        group = each.name_full if one_per_light else each.lightgroup
        if each.type == "LIGHT" and each.data.energy != 0:
            found.append(Member(group, each.session_uid, -1, "", each.data.energy, name=each.name_full))
        elif each.type in WITH_MATERIALS and not _has_transfer(each):
            for number, slot in enumerate(each.material_slots):
                emissive, name = _emissive(slot.material), each.name_full
                found += [Member(group, each.session_uid, number, *entry, name=name) for entry in emissive]
    world = scene.world
    if world is not None:
        group = getattr(world, "lightgroup", "") or ("World" if one_per_light else "")
        # a lamp of that name has its own bulb, so the second one is numbered, as in the core and in Blender
        taken, name, number = ({member.group for member in found} if one_per_light else set()), group, 0
        while group in taken:
            number += 1
            group = f"{name}.{number:03d}"
        found += [Member(group, world.session_uid, -1, *entry) for entry in _emissive(world)]
    return found


def group_count(scene: Scene, one_per_light: bool) -> int:
    """Number of bulbs of a recording, fast enough for a panel."""
    shown = [each for each in scene.objects if not each.hide_render]
    return len({member.group for member in members_of(scene, shown, one_per_light)})


def _has_transfer(each: Object) -> bool:
    """True for a volume whose transfer function takes the place of its material."""
    return each.type == "VOLUME" and has_transfer(each.data)


def _emissive(owner: ID) -> list[tuple[str, float, str]]:
    """Emissive nodes of a material or world, with their strength and its socket; 1 if other nodes compute it."""
    tree = None if owner is None else compat.node_tree(owner)
    found = []
    for node in () if tree is None else tree.nodes:
        for socket in _strength_sockets(node):
            if socket.is_linked:
                found.append((node.name, _dimmer_value(tree, node, socket), socket.name))
            elif socket.default_value > 0 and not _is_black(node, socket):
                found.append((node.name, socket.default_value, socket.name))
    return found


def _is_black(node: Node, strength: NodeSocket) -> bool:
    color = node.inputs.get(STRENGTHS[node.type][strength.name])
    return color is not None and not color.is_linked and not any(color.default_value[:3])


def _strength_sockets(node: Node) -> list[NodeSocket]:
    found = [node.inputs.get(name) for name in STRENGTHS.get(node.type, ())]
    return [socket for socket in found if socket is not None]


def _dimmer_name(node: Node, socket: NodeSocket) -> str:
    """The name of the node that dims a strength; for a second strength of a node it has the socket's name, too."""
    first = next(iter(STRENGTHS[node.type]))
    return f"{DIMMER}{node.name}" + ("" if socket.name == first else f", {socket.name}")


def _dimmer_value(tree: NodeTree, node: Node, socket: NodeSocket) -> float:
    dimmer = tree.nodes.get(_dimmer_name(node, socket))
    return 1.0 if dimmer is None else dimmer.inputs[1].default_value


def store_members(bulbs: bpy_prop_collection, members: list[Member]) -> int:
    """Store members with the bulbs of their groups; returns the number of those whose data are gone."""
    alive = {each.session_uid: each for each in (*bpy.data.objects, *bpy.data.worlds)}
    for bulb in bulbs:
        bulb.members.clear()
        bulb.lit, bulb.is_dark = 1.0, False
        for member in members:
            if member.group == bulb.name and member.owner in alive:
                kept = bulb.members.add()
                kept.owner, kept.name = alive[member.owner], member.name
                kept.slot, kept.node, kept.socket, kept.base = member.slot, member.node, member.socket, member.base
    return sum(member.owner not in alive for member in members)


def color_bulbs(bulbs: bpy_prop_collection, lights: Sequence[Any]) -> None:
    """Give each bulb the color of its light (an Illuminant); white if the lights of a group differ (None)."""
    from spectral_core.spectra.color import display_rgb_from_linear, linear_rgb_from_xyz
    from spectral_core.spectra.observer import xyz_of

    for bulb, light in zip(bulbs, lights, strict=True):
        linear = np.ones(3) if light is None else np.maximum(linear_rgb_from_xyz(xyz_of(light)), 0.0)
        bulb.color = display_rgb_from_linear(linear / max(float(linear.max()), 1e-9))


def apply_weights(bulbs: Sequence[PropertyGroup], weights: Sequence[float] | np.ndarray) -> int:
    """Write base × weight to all lights and emissive objects of the bulbs; returns the number of written values.

    A lamp or material that an object outside the group also uses is copied first. Raises InvalidInputError, before
    anything is written, for data that was deleted, is linked from another file, or cannot be dimmed separately.
    """
    wanted = [(kept, float(weight)) for bulb, weight in zip(bulbs, weights, strict=True) for kept in bulb.members]
    require_writable(bulbs, weights)
    _keep_apart(wanted)
    for kept, weight in wanted:
        _write(kept, kept.base * weight)
    return len(wanted)


def light_dark_lamps(bulbs: Iterable[PropertyGroup]) -> None:
    """Give lamps that the dial made dark their last power: a dark lamp is not in the scene that is compared."""
    for bulb in bulbs:
        for kept in bulb.members if bulb.is_dark else ():
            if not kept.node:
                _write(kept, kept.base * bulb.lit)


def require_writable(bulbs: Sequence[PropertyGroup], weights: Sequence[float] | np.ndarray) -> None:
    """Raise InvalidInputError if lights of bulbs cannot have these weights."""
    for bulb, weight in zip(bulbs, weights, strict=True):
        if not len(bulb.members) and weight != 1:
            raise InvalidInputError(
                f"no light of this scene is known as {name_of(bulb)!r}: an instance of a light, or emission in a "
                "node group, cannot be dimmed by itself. Make it real, or give it a light group with the others"
            )
    for bulb in bulbs:
        for kept in bulb.members:
            _require_writable(bulb, kept)


def _require_writable(bulb: PropertyGroup, kept: PropertyGroup) -> None:
    owner = kept.owner
    if owner is None:
        raise InvalidInputError(f"a light of the bulb {name_of(bulb)!r} was deleted; undo that, or record again")
    block = block_of(kept)
    if block is None or (kept.node and _socket_of(kept, block) is None):
        raise InvalidInputError(f"{owner.name!r} has changed since it was recorded; record it again")
    if owner.library is not None or block.library is not None:
        raise InvalidInputError(f"{block.name!r} is linked from another file; make it local to dim it")
    if block.override_library is not None:  # Blender accepts the value, and loses it when the file is saved
        raise InvalidInputError(
            f"{block.name!r} is a library override, which does not keep its strength; make it local to dim it"
        )


def block_of(kept: PropertyGroup) -> ID | None:
    """The data-block of the number: the lamp, the material in the slot, or the world."""
    owner = kept.owner
    if isinstance(owner, bpy.types.World):
        return owner
    if kept.slot < 0:
        return owner.data if owner.type == "LIGHT" else None
    return owner.material_slots[kept.slot].material if kept.slot < len(owner.material_slots) else None


def _socket_of(kept: PropertyGroup, block: ID) -> NodeSocket | None:
    """The socket of the number; None if it is gone."""
    node = compat.node_tree(block).nodes.get(kept.node)
    sockets = [] if node is None else _strength_sockets(node)
    return next((each for each in sockets if kept.socket in ("", each.name)), None)


def _keep_apart(wanted: list[tuple[PropertyGroup, float]]) -> None:
    """Give an object its own copy of a lamp or material that is dimmed differently elsewhere."""
    weight_of = {
        (kept.owner, kept.slot): weight for kept, weight in wanted if not isinstance(kept.owner, bpy.types.World)
    }
    for (owner, slot), weight in weight_of.items():
        others = [key for key in _users(owner, slot) if key != (owner, slot)]
        if all(weight_of.get(key) == weight for key in others):
            continue
        if slot < 0:
            owner.data = owner.data.copy()
        else:
            copied = owner.material_slots[slot].material.copy()
            owner.material_slots[slot].link = "OBJECT"
            owner.material_slots[slot].material = copied


def _users(owner: ID, slot: int) -> list[tuple[Any, int]]:
    """All (object, slot) with the same lamp or material."""
    if slot < 0:
        return [(each, -1) for each in bpy.data.objects if each.data == owner.data]
    material = owner.material_slots[slot].material
    return [
        (each, number)
        for each in bpy.data.objects
        for number, other in enumerate(each.material_slots)
        if other.material == material
    ]


def _write(kept: PropertyGroup, value: float) -> None:
    block = block_of(kept)
    assert block is not None  # _require_writable has checked it
    if not kept.node:
        block.energy = value
        return
    tree, socket = compat.node_tree(block), _socket_of(kept, block)
    assert socket is not None  # _require_writable has checked it
    if not socket.is_linked:
        socket.default_value = value
        return
    node = socket.node
    name = _dimmer_name(node, socket)
    dimmer = tree.nodes.get(name)
    if dimmer is None:
        dimmer = tree.nodes.new("ShaderNodeMath")
        dimmer.operation, dimmer.name, dimmer.label = "MULTIPLY", name, "Light Dial"
        dimmer.location = (node.location[0] - 200, node.location[1] - 120)
        source = socket.links[0].from_socket
        tree.links.new(source, dimmer.inputs[0])
        tree.links.new(dimmer.outputs[0], socket)
    dimmer.inputs[1].default_value = value
