# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing the brightness of a mixture to the lights, emissive objects and worlds of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np
from bpy.types import ID, NodeSocket, PropertyGroup, Scene

from spectral_core.errors import InvalidInputError

from ... import compat
from .members import SEALED, dimmer_name, strength_sockets
from .names import name_of, original_of

ROUNDING = 1e-6
"""Factors this near to 1 are those of the recording."""


def apply_weights(bulbs: Sequence[PropertyGroup], weights: Sequence[float] | np.ndarray) -> int:
    """Write base × weight to all lights and emissive objects of the bulbs; returns the number of written values.

    A lamp or material that an object outside the group also uses is copied first. Raises InvalidInputError, before
    anything is written, for data that was deleted, is linked from another file, or cannot be dimmed separately.
    """
    require_writable(bulbs, weights)
    members = [(kept, float(weight)) for bulb, weight in zip(bulbs, weights, strict=True) for kept in bulb.members]
    wanted = [(kept, weight) for kept, weight in members if kept.socket != SEALED]
    _keep_apart(wanted)
    _keep_worlds_apart(members)
    for kept, weight in wanted:
        _write(kept, kept.base * weight)
    return len(wanted)


@contextmanager
def dark_lamps_lit(bulbs: Iterable[PropertyGroup]) -> Iterator[None]:
    """Give lamps that the dial made dark their last power: a dark lamp is not in the scene that is compared.

    They keep it, unless an error ends the block.
    """
    dark = [(kept, bulb.lit) for bulb in bulbs if bulb.is_dark for kept in bulb.members if not kept.node]
    lamps: list[Any] = [block_of(kept) for kept, _ in dark]
    before = [lamp.energy for lamp in lamps]
    for kept, lit in dark:
        _write(kept, kept.base * lit)
    try:
        yield
    except BaseException:
        for lamp, energy in zip(lamps, before, strict=True):
            lamp.energy = energy
        raise


@contextmanager
def dark_worlds_lit(bulbs: Iterable[PropertyGroup]) -> Iterator[None]:
    """Within it worlds that the dial made dark have their last strength: a dark one has no colors."""
    found = [(kept, bulb.lit) for bulb in bulbs if bulb.is_dark for kept in bulb.members]
    dark = [(k, lit) for k, lit in found if isinstance(k.owner, bpy.types.World) and k.socket != SEALED]
    for kept, lit in dark:
        _write(kept, kept.base * lit)
    try:
        yield
    finally:
        for kept, _ in dark:
            _write(kept, 0.0)


def _dims(weight: float) -> bool:
    """True if a factor is not that of the recording; at the center of the dial it is 1 within rounding."""
    return abs(weight - 1.0) > ROUNDING


def require_writable(bulbs: Sequence[PropertyGroup], weights: Sequence[float] | np.ndarray) -> None:
    """Raise InvalidInputError if lights of bulbs cannot have these weights."""
    _require_like_originals(bulbs, weights)
    for bulb, weight in zip(bulbs, weights, strict=True):
        for kept in bulb.members:
            block = _require_writable(bulb, kept)
            require_power(kept.base * float(weight), kept.owner.name)
            if kept.socket == SEALED and not kept.node and _dims(weight):
                raise InvalidInputError(_of_no_strength(bulb, block))
            if kept.socket == SEALED and _dims(weight):
                raise InvalidInputError(
                    f"{block.name!r} emits light in its node {kept.node!r}, a node group or Volume Coefficients, which "
                    f"cannot be dimmed; ungroup the node, or leave {name_of(bulb)!r} at its recorded brightness"
                )


def _require_like_originals(bulbs: Sequence[PropertyGroup], weights: Sequence[float] | np.ndarray) -> None:
    """Raise InvalidInputError if a bulb that has no light of its own is not as bright as Apply would leave it."""
    weight_of = {bulb.name: float(weight) for bulb, weight in zip(bulbs, weights, strict=True)}
    for bulb in bulbs:
        if len(bulb.members):
            continue
        original = original_of(bulb, bulbs)
        wanted = 1.0 if original is None else weight_of[original.name]
        if abs(weight_of[bulb.name] - wanted) <= ROUNDING * max(1.0, abs(wanted)):
            continue
        if original is not None:
            raise InvalidInputError(
                f"{bulb.name!r} is an instance of {name_of(original)!r}, and an instance of a light cannot be dimmed "
                f"by itself: it is as bright as the light. The dial has the factors {weight_of[bulb.name]:.3g} and "
                f"{wanted:.3g}. Make it real and record again, or place the two bulbs at the same position"
            )
        raise InvalidInputError(
            f"no light of this scene is known as {name_of(bulb)!r}: an instance of a light, or the emission of a "
            "view layer's material override, cannot be dimmed by itself. Make it real, or give it a light group "
            "with the others"
        )


def _of_no_strength(bulb: PropertyGroup, block: ID) -> str:
    """Message about a material or world whose light cannot be dimmed, see ``sealed_besides``."""
    if isinstance(block, bpy.types.World):
        cause, remedy = "has no Background or Emission node", "give it one"
    else:
        cause = "is in no slot of an object that shows it (geometry nodes or a material override assign it), or has no "
        cause, remedy = cause + "Emission node", "put it into a slot, or give it one"
    return (
        f"{block.name!r} emits light, and {cause}, so it cannot be dimmed; {remedy}, or leave {name_of(bulb)!r} at its "
        "recorded brightness"
    )


def require_power(value: float, name: str) -> float:
    """A power or strength that Blender can store, in single precision. Raises InvalidInputError for NaN and Inf.

    ``name``: name of the light. A script may store NaN in a setting of the dial.
    """
    if not abs(value) <= np.finfo(np.float32).max:
        raise InvalidInputError(
            f"{name!r} would get the power {value:g}; expected a number up to 3.4e38. Set Intensity and the recorded "
            "powers of the dial to smaller finite numbers, or record again"
        )
    return value


def _require_writable(bulb: PropertyGroup, kept: PropertyGroup) -> ID:
    """The data-block to write to."""
    owner = kept.owner
    if owner is None:
        raise InvalidInputError(f"a light of the bulb {name_of(bulb)!r} was deleted; undo that, or record again")
    block = block_of(kept)
    if block is None or _is_gone(kept, block):
        raise InvalidInputError(f"{owner.name!r} has changed since it was recorded; record it again")
    if owner.library is not None or block.library is not None:
        raise InvalidInputError(f"{block.name!r} is linked from another file; make it local to dim it")
    if block.override_library is not None:  # Blender accepts the value, and loses it when the file is saved
        raise InvalidInputError(
            f"{block.name!r} is a library override, which does not keep its strength; make it local to dim it"
        )
    return block


def _is_gone(kept: PropertyGroup, block: ID) -> bool:
    if kept.socket == SEALED:
        return bool(kept.node) and compat.node_tree(block).nodes.get(kept.node) is None
    return bool(kept.node) and _socket_of(kept, block) is None


def block_of(kept: PropertyGroup) -> ID | None:
    """The data-block of the number: the lamp, the material in the slot or of all slots, or the world."""
    owner = kept.owner
    if isinstance(owner, (bpy.types.World, bpy.types.Material)):
        return owner
    if kept.slot < 0:
        return owner.data if owner.type == "LIGHT" else None
    return owner.material_slots[kept.slot].material if kept.slot < len(owner.material_slots) else None


def _socket_of(kept: PropertyGroup, block: ID) -> NodeSocket | None:
    """The socket of the number; None if it is gone."""
    node = compat.node_tree(block).nodes.get(kept.node)
    sockets = [] if node is None else strength_sockets(node)
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


def _keep_worlds_apart(wanted: list[tuple[PropertyGroup, float]]) -> None:
    """Give a scene its own copy of a world that is dimmed here and lights other scenes, too."""
    copies: dict[ID, ID] = {}
    for kept, weight in wanted:
        world, scene = kept.owner, kept.id_data
        if not isinstance(world, bpy.types.World) or not (_dims(weight) or world in copies):
            continue
        places = [place for each in bpy.data.scenes for place in _places_of(each, world)]
        if world not in copies and any(place.id_data != scene for place, _ in places):
            copies[world] = world.copy()
            for place, name in _places_of(scene, world):
                setattr(place, name, copies[world])
    for kept, _ in wanted:
        kept.owner = copies.get(kept.owner, kept.owner)


def _places_of(scene: Scene, world: ID) -> list[tuple[Any, str]]:
    """Scene and view layers, with the property that names this world."""
    layers = [(layer, "world_override") for layer in scene.view_layers if layer.world_override == world]
    return [*([(scene, "world")] if scene.world == world else []), *layers]


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
    name = dimmer_name(node, socket)
    dimmer = tree.nodes.get(name)
    if dimmer is None:
        dimmer = tree.nodes.new("ShaderNodeMath")
        dimmer.operation, dimmer.name, dimmer.label = "MULTIPLY", name, "Light Dial"
        dimmer.location = (node.location[0] - 200, node.location[1] - 120)
        source = socket.links[0].from_socket
        tree.links.new(source, dimmer.inputs[0])
        tree.links.new(dimmer.outputs[0], socket)
    dimmer.inputs[1].default_value = value
