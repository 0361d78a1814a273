# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes for nodes: properties of an object, of its instancer, of the view layer; axes of a UV map by name."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..context import stated

PREFIX = "object_attribute:"
UNDISPLACED = "attribute_undisplaced"
"""Input of programs: the position in the object before its displacement."""
OF_STRANDS = "HAIR"
"""Type of object that alone has these attributes: hair."""
POINT_PLACE = "attribute_point_place"
"""Attribute of the balls of a point cloud: the position of the point, in object space."""
POINT_SIZE = "attribute_point_size"
"""Attribute of the balls of a point cloud: the point's radius in object space, its random number in [0, 1], and 1."""
NOTHING = (0.0, 0.0, 0.0, 1.0)
"""Blender's value of what an instance or a particle lacks."""
MISSING = (0.0, 0.0, 0.0, 0.0)
"""Cycles' value of a property that no owner has."""
ALPHA = " alpha"
"""End of the kind of an attribute whose alpha is read."""


def view_layer_attribute(depsgraph: Any, name: str) -> tuple[float, ...]:
    """Value (r, g, b, alpha) of a view layer's attribute; without one, that of the scene or the world."""
    is_render = depsgraph.mode == "RENDER"
    layer = depsgraph.view_layer_eval if is_render else depsgraph.view_layer
    scene = depsgraph.scene_eval if is_render else depsgraph.scene
    return _first((layer, scene, scene.world), name)


def object_attributes(
    obj: Any, instance: Any, reads: frozenset[str], found: Any
) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """The attributes of an object that its materials read, by their names in programs; ``found``: the walk over the
    scene, which keeps the instances of each instancer as points.
    """
    values: list[tuple[str, tuple[float, ...]]] = []
    frame = found.translation.scene.frame_current_final
    for read in sorted(reads):
        if not read.startswith(PREFIX):
            continue
        kind, _, name = read[len(PREFIX) :].partition(":")
        is_alpha, kind = kind.endswith(ALPHA), kind.removesuffix(ALPHA)
        if kind == OF_STRANDS:  # a mesh has no strands: 0, as in Cycles
            continue
        if kind in ("INSTANCE", "PARTICLE"):
            is_place = kind == "INSTANCE"
            values.append((read, _of_instance(name, instance) if is_place else _of_particle(name, instance, frame)))
            continue
        own = stated(obj, found.translation.depsgraph)
        owners = [own, getattr(own, "data", None)]
        if kind == "INSTANCER" and instance.is_instance and instance.parent is not None:
            parent, system = stated(instance.parent, found.translation.depsgraph), instance.particle_system
            owners = [system and system.settings, parent, getattr(parent, "data", None), *owners]
            item, unknown = found.points.value(name, instance)
            stored = None if item is None else _numbers(item)
            if stored is None and unknown and _first(owners, name) is MISSING:
                found.translation.note(obj.name, f"attribute {name!r} of {unknown}; its materials read 0")
            if stored is not None:
                values.append((read, (stored[3],) * 3 if is_alpha else stored))
                continue
        value = _first(owners, name)
        if name == "color" and kind == "OBJECT" and instance.is_instance and own.get(name) is None:
            value = tuple(map(float, color_of(obj, instance)))  # an instance has no color of its own in Blender
        if value is MISSING and _is_not_finite(owners, name):
            found.translation.note(obj.name, f"its property {name!r} is no finite number; its materials read 0")
        values.append((read, (value[3],) * 3 if is_alpha else value))
    return tuple(values)


def _is_not_finite(owners: Any, name: str) -> bool:
    """True if a custom property holds NaN or infinity."""
    for owner in owners:
        value = None if owner is None or not name else owner.get(name)
        try:
            numbers = (
                np.zeros(1)
                if value is None or isinstance(value, (str, bytes))
                else np.ravel(np.asarray(value, dtype=np.float64))
            )
        except (TypeError, ValueError):  # no numbers
            continue
        if not np.isfinite(numbers).all():
            return True
    return False


def _of_instance(name: str, instance: Any) -> tuple[float, ...]:
    """Coordinates of the position of an instance on its instancer; 0 for an object that is no instance, as in
    Cycles.
    """
    if not instance.is_instance:
        return NOTHING
    if name == "UV":
        return (*(float(part) for part in instance.uv), 0.0, 1.0)
    return (*(0.5 * float(part) - 0.5 for part in instance.orco), 1.0)


def _of_particle(name: str, instance: Any, frame: float) -> tuple[float, ...]:
    """The outputs of Particle Info for an instance; for an object that is no particle, as in Cycles, those of particle
    0 without a life.
    """
    system = instance.particle_system if instance.is_instance else None
    index = int(instance.persistent_id[0]) if system is not None else 0
    if name == "Random":
        return (float(hashed_pair(index, 0) / 0xFFFFFFFF), 0.0, 0.0, 1.0)
    if system is None or not 0 <= index < len(system.particles):
        return NOTHING
    particle = system.particles[index]
    vectors = {"Location": "location", "Velocity": "velocity", "Angular Velocity": "angular_velocity"}
    if name in vectors:
        return (*(float(part) for part in getattr(particle, vectors[name])), 1.0)
    numbers = {
        "Index": float(index), "Age": frame - particle.birth_time, "Lifetime": float(particle.lifetime),
        "Size": float(particle.size),
    }  # fmt: skip
    return (numbers.get(name, 0.0), 0.0, 0.0, 1.0)


def _first(owners: Any, name: str) -> tuple[float, ...]:
    for owner in owners:
        if owner is None or not name:
            continue
        value = owner.get(name)
        if value is None:
            try:
                value = owner.path_resolve(name)
                if isinstance(owner.path_resolve(name, False), (bool, int, float)):  # a part, as of location.x
                    continue
            except (ValueError, AttributeError, TypeError):
                continue
        numbers = _numbers(value)
        if numbers is not None:
            return numbers
    return MISSING


def _numbers(value: Any) -> tuple[float, ...] | None:
    """A property as (r, g, b, alpha); None if it is no number; texts and lists of booleans are none, as in Cycles."""
    if isinstance(value, (bool, int, float)):
        flat = np.full(3, float(value))
    elif isinstance(value, (str, bytes)):
        return None
    else:
        try:
            parts = list(value)
            flat = np.asarray(parts, dtype=np.float64).ravel()
        except (TypeError, ValueError):
            return None
        if any(isinstance(part, (str, bytes, bool)) for part in parts):
            return None
    if not 1 <= flat.size <= 4 or not np.isfinite(flat).all():
        return None
    padded = np.array(NOTHING)
    padded[: flat.size] = flat
    return tuple(float(part) for part in padded)


def random_of(obj: Any, instance: Any) -> float:
    """Random number of an instance as in Blender; of a single object as Cycles derives it from its name."""
    if instance.is_instance:
        return float((instance.random_id & 0xFFFFFFFF) / 0xFFFFFFFF)
    word = 0
    for byte in obj.name.encode():
        word = (word * 37 + byte) & 0xFFFFFFFF
    return float(hashed_pair(word, 0) / 0xFFFFFFFF)


def color_of(obj: Any, instance: Any) -> Any:
    """Color (r, g, b, alpha) of an object; of an instance that of its instancer, as in Cycles."""
    return instance.parent.color if instance.is_instance and instance.parent else obj.color


def object_info(obj: Any, instance: Any) -> dict[str, tuple[float, ...]]:
    """Values of the Object Info node for an object, by their names in programs."""
    color = tuple(map(float, color_of(obj, instance)))
    place = (instance.matrix_world[row][3] for row in range(3))
    return {
        "object_location": tuple(map(float, place)), "object_color": color[:3], "object_alpha": color[3:],
        "object_index": (float(obj.pass_index),), "object_random": (random_of(obj, instance),),
    }  # fmt: skip


def root_of(obj: Any) -> Any:
    """The topmost parent of an object, itself without one: the name in a cryptomatte of assets."""
    while obj.parent is not None:
        obj = obj.parent
    return obj


def hashed_pair(first: int, second: int) -> int:
    """Jenkins' lookup3, its final mix, of two 32-bit words: the source of Cycles' random numbers of objects."""
    start = (0xDEADBEEF + (2 << 2) + 13) & 0xFFFFFFFF
    a, b = (start + first) & 0xFFFFFFFF, (start + second) & 0xFFFFFFFF
    c = start
    for one, two, three in ((14, 11, 25), (16, 4, 14)):
        c = ((c ^ b) - _rotated(b, one)) & 0xFFFFFFFF
        a = ((a ^ c) - _rotated(c, two)) & 0xFFFFFFFF
        b = ((b ^ a) - _rotated(a, three)) & 0xFFFFFFFF
    return ((c ^ b) - _rotated(b, 24)) & 0xFFFFFFFF


def _rotated(word: int, bits: int) -> int:
    return ((word << bits) | (word >> (32 - bits))) & 0xFFFFFFFF
