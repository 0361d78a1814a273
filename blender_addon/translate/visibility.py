# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility of objects, lamps and worlds to rays, and light linking, from Blender's settings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Rays

from .context import Translation, stated, whole

FLAGS = {
    "visible_camera": Rays.CAMERA, "visible_diffuse": Rays.DIFFUSE, "visible_glossy": Rays.GLOSSY,
    "visible_transmission": Rays.TRANSMISSION, "visible_volume_scatter": Rays.VOLUME, "visible_shadow": Rays.SHADOW,
}  # fmt: skip
WORLD_FLAGS = {
    "camera": Rays.CAMERA, "diffuse": Rays.DIFFUSE, "glossy": Rays.GLOSSY, "transmission": Rays.TRANSMISSION,
    "scatter": Rays.VOLUME,
}  # fmt: skip


MOST_SHIFT = 1.99
"""Shading Offset from which Cycles leaves the terminator where it is."""


def cycles_settings(owner: Any, name: str, fallback: Any) -> Any:
    """A setting of Cycles in ``owner.cycles``; ``fallback`` if this Blender has no Cycles."""
    return getattr(getattr(owner, "cycles", None), name, fallback)


def terminator_of(obj: Any, owner: Any) -> dict[str, float]:
    """Fields of an instance: Geometry Offset and Shading Offset of the shadow terminator of an object.

    ``owner``: ``whole`` of the object.
    """
    try:  # a generator over the names takes three times as long, for each object of an edited material
        lift, shift = obj.shadow_terminator_geometry_offset, obj.shadow_terminator_shading_offset
    except AttributeError:
        lift = cycles_settings(owner, "shadow_terminator_geometry_offset", 0.1)
        shift = cycles_settings(owner, "shadow_terminator_offset", 0.0)
    lift, shift = max(float(lift), 0.0), max(float(shift), 0.0)
    return {"terminator_cosine": min(lift, 1.0), "terminator_shift": shift if shift < MOST_SHIFT else 0.0}


def hidden_from(obj: Any) -> Rays:
    """Types of rays that an object's ray visibility switches off."""
    return _bits(obj, FLAGS)


def shown_by(instance: Any) -> Any:
    """What shows an instance of the depsgraph, as an empty with a collection; None for an object that shows itself."""
    return instance.parent if instance.is_instance else None


def seen_as(instance: Any, depsgraph: Any) -> dict[str, Any]:
    """Fields of an instance: the rays that it is hidden from, and whether it is a holdout or a shadow catcher.

    As in Cycles, an instance is a holdout or only indirect if what shows it (an empty with a collection, say) is one,
    a holdout if that is both; it is hidden from the rays that either of the two is hidden from, and is a shadow catcher
    if either is.
    """
    obj, parent = instance.object, shown_by(instance)
    owner = obj if parent is None else parent
    hidden, own = hidden_from(obj) | hidden_from(owner), stated(owner, depsgraph)
    layer = depsgraph.view_layer_eval if depsgraph.mode == "RENDER" else depsgraph.view_layer
    is_holdout = bool(owner.is_holdout or own.holdout_get(view_layer=layer))
    if own.indirect_only_get(view_layer=layer) and not is_holdout:
        hidden |= Rays.CAMERA
    return {
        "hidden_from": hidden,
        "is_holdout": is_holdout,
        "is_shadow_catcher": bool(obj.is_shadow_catcher or owner.is_shadow_catcher),
    }


def note_volume(translation: Translation, subject: str, seen: dict[str, Any]) -> None:
    """Name the settings of an object that have no effect on its volume; ``seen``: as ``seen_as`` gives it."""
    if seen["is_shadow_catcher"]:
        translation.note(subject, "it is a shadow catcher, and its volume is none")


def world_hidden_from(world: Any) -> Rays:
    """Types of rays that a world's ray visibility switches off."""
    return _bits(getattr(world, "cycles_visibility", None), WORLD_FLAGS)


def _bits(owner: Any, flags: dict[str, Rays]) -> Rays:
    bits = Rays.NONE
    for name, kind in flags.items():
        if not getattr(owner, name, True):
            bits |= kind
    return bits


class Culling:
    """Which objects Simplify leaves out of renders: those beyond the camera's view, or far from it, by their boxes."""

    def __init__(self, translation: Translation, *, is_render: bool) -> None:
        scene, depsgraph = translation.scene, translation.depsgraph
        render, camera, own = translation.render, scene.camera, scene.render
        usable = own.use_simplify and not own.use_multiview and camera is not None and camera.type == "CAMERA"
        usable = usable and camera.data.type in ("PERSP", "ORTHO")
        self._depsgraph = depsgraph
        self.margin = float(cycles_settings(scene, "camera_cull_margin", 0.0))
        self.distance = float(cycles_settings(scene, "distance_cull_margin", 0.0))
        self._by_view = usable and bool(cycles_settings(scene, "use_camera_cull", False))
        self._by_distance = usable and self.distance != 0.0 and bool(cycles_settings(scene, "use_distance_cull", False))
        if self.is_used and not is_render:
            translation.note(scene.name, "Simplify culls objects in renders; the 3D view shows all")
            self._by_view = self._by_distance = False
        if self.is_used:
            camera = camera.evaluated_get(depsgraph)
            self._place = camera.matrix_world.normalized()
            self._data, self._view = camera.data, np.array(self._place.inverted())
            size = {"x": render.resolution_x, "y": render.resolution_y}
            aspect = {"scale_x": render.pixel_aspect_x, "scale_y": render.pixel_aspect_y}
            self._projection = np.array(camera.calc_matrix_camera(depsgraph, **size, **aspect))

    @property
    def is_used(self) -> bool:
        """True if the scene leaves out any objects."""
        return self._by_view or self._by_distance

    def leaves_out(self, obj: Any, world_from_object: Any) -> bool:
        """True if an instance of an object is left out, by all of the rules that it is subject to."""
        if not self.is_used:
            return False
        owner = whole(obj, self._depsgraph)
        rules = [
            test
            for is_on, name, test in (
                (self._by_view, "use_camera_cull", self._is_beyond),
                (self._by_distance, "use_distance_cull", self._is_far),
            )
            if is_on and cycles_settings(owner, name, False)
        ]
        if not rules or obj.type == "LIGHT":
            return False
        corners = np.c_[np.array([corner[:] for corner in obj.bound_box]), np.ones(8)]
        corners = corners @ np.array(world_from_object).T
        return all(test(corners) for test in rules)

    def _is_beyond(self, corners: NDArray[np.float64]) -> bool:
        """True if a box is behind the camera, or on one side of its picture."""
        seen = corners @ self._view.T
        near, far = self._data.clip_start, self._data.clip_end
        depth = -seen[:, 2] - near  # Cycles compares its projected depth with the margin
        depth = depth * far / (far - near) if self._data.type == "PERSP" else depth / (far - near)
        if np.all(depth < -self.margin):
            return True
        clip = seen @ self._projection.T
        with np.errstate(divide="ignore", invalid="ignore"):
            place = 0.5 + 0.5 * clip[:, :2] / clip[:, 3:]
        place = np.where(depth[:, None] < 0.0, 1.0 - place, place)
        return bool(np.any(place.min(0) >= 1.0 + self.margin) or np.any(place.max(0) <= -self.margin))

    def _is_far(self, corners: NDArray[np.float64]) -> bool:
        """True if no point of a box is as near to the camera as the distance."""
        own = np.array(self._place.translation)
        nearest = np.clip(own, corners[:, :3].min(0), corners[:, :3].max(0))
        return bool(np.linalg.norm(own - nearest) > self.distance)


class Linking:
    """Light and shadow linking of the lamps of a scene: illuminated objects, and occluders."""

    def __init__(self) -> None:
        self._receivers: dict[str, tuple[set[Any], set[Any]]] = {}
        self._blockers: dict[str, tuple[set[Any], set[Any]]] = {}

    @property
    def is_used(self) -> bool:
        """True if any lamp is linked to some objects only."""
        return bool(self._receivers or self._blockers)

    def add(self, light: str, lamp_object: Any) -> None:
        """Read the collections of a lamp object's linking."""
        linking = getattr(lamp_object, "light_linking", None)
        for name, table in (("receiver_collection", self._receivers), ("blocker_collection", self._blockers)):
            collection = getattr(linking, name, None)
            if collection is not None:
                table[light] = _members(collection)

    def unlit_by(self, obj: Any, shown_by: Any = None) -> tuple[str, ...]:
        """Names of the lights that do not illuminate an object (an original one), or an instance ``shown_by`` one."""
        return _outside(self._receivers, obj, shown_by)

    def clear_for(self, obj: Any, shown_by: Any = None) -> tuple[str, ...]:
        """Names of the lights for which an object, or an instance ``shown_by`` another, casts no shadow."""
        return _outside(self._blockers, obj, shown_by)


def _members(collection: Any) -> tuple[set[Any], set[Any]]:
    """Session numbers of the objects that a linking collection includes, and of those that it excludes.

    Of an object that is in it several times the last entry counts, as in Blender: objects come after collections.
    """
    is_out: dict[Any, bool] = {}
    for child, entry in zip(collection.children, collection.collection_children, strict=False):
        state = entry.light_linking.link_state == "EXCLUDE"
        is_out.update((obj.original.session_uid, state) for obj in child.all_objects)
    for obj, entry in zip(collection.objects, collection.collection_objects, strict=False):
        is_out[obj.original.session_uid] = entry.light_linking.link_state == "EXCLUDE"
    excluded = {number for number, state in is_out.items() if state}
    return set(is_out) - excluded, excluded


def _outside(linked: dict[str, tuple[set[Any], set[Any]]], obj: Any, shown_by: Any) -> tuple[str, ...]:
    """Lights that leave an object out. If no light names an instance's object, its instancer counts."""
    number = obj.original.session_uid
    if shown_by is not None and not any(number in side for sides in linked.values() for side in sides):
        number = shown_by.original.session_uid
    return tuple(
        light
        for light, (included, excluded) in linked.items()
        if number in excluded or (included and number not in included)
    )
