# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that a sweep may vary in a .blend file, by full data paths: numbers, switches, choices from a list."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.types import PropertyGroup

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.parameters import is_column_name

from ..board.paths import Number, block_at, place_in, renamed

SWITCH = ("off", "on")
"""The values of a switch; a document may also use 0 and 1."""


_VECTORS = ("TRANSLATION", "DIRECTION", "VELOCITY", "ACCELERATION", "EULER", "XYZ", "XYZ_LENGTH", "COORDINATES")
_PLACING = ("location", "rotation_", "scale")
"""How the properties begin that place an object or a bone."""
_COMPONENTS = {"COLOR": "rgba", "COLOR_GAMMA": "rgba", "QUATERNION": "wxyz", **dict.fromkeys(_VECTORS, "xyz")}
"""Letters of the components of a property, by its subtype."""


@dataclass(frozen=True)
class Setting:
    """A property that a sweep sets. ``choices``: its values if it is no number, as a table shows them.

    ``numbers``: a custom property with a list stores a number for each of its choices.
    """

    path: str
    place: Number
    choices: tuple[str, ...] = ()
    numbers: tuple[int, ...] = ()

    @property
    def is_whole(self) -> bool:
        """True if it is a whole number."""
        return not self.choices and isinstance(self.place.element(), int)

    def require_kind(self, kind: str) -> None:
        """Raise InvalidInputError if a parameter of this kind has values that the setting cannot have."""
        if kind == "real" and self.is_whole:
            raise InvalidInputError(f"{self.path} is a whole number; give its parameter kind = 'integer'")
        if kind == "real" and self.choices:
            raise InvalidInputError(
                f"{self.path} is no number; give its parameter choices, of those that it offers: "
                f"{', '.join(self.choices)}"
            )

    def checked(self, value: Any) -> Any:
        """The value in the property's type. Raises InvalidInputError for an impossible value."""
        if not self.choices:
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                if self.is_whole and value != round(value):
                    raise InvalidInputError(f"{self.path} is a whole number; it cannot be {value!r}")
                return float(value)
            raise InvalidInputError(f"{self.path} is a number; it cannot be {value!r}")
        if self.choices == SWITCH and value in (0, 1, "0", "1", "false", "true"):
            return value in (1, "1", "true")
        if value not in self.choices:
            raise InvalidInputError(f"{self.path} cannot be {value!r}; it offers {', '.join(self.choices)}")
        if self.numbers:
            return self.numbers[self.choices.index(value)]
        return value == "on" if self.choices == SWITCH else value

    @property
    def is_angle(self) -> bool:
        """True if Blender shows it in degrees; its value is in radians."""
        place = self.place
        if place.is_custom:
            return not self.choices and place.ui().get("subtype") == "ANGLE"
        return place.owner.bl_rna.properties[place.name].unit == "ROTATION"

    def write(self, value: Any) -> None:
        """Set it. Raises InvalidInputError for an impossible value."""
        given, place = self.checked(value), self.place
        try:
            if not self.choices:
                place.write(given)
            elif place.index is not None:
                values = place.owner[place.name] if place.is_custom else getattr(place.owner, place.name)
                values[place.index] = given
            elif place.is_custom:
                place.owner[place.name] = given
            else:
                setattr(place.owner, place.name, given)
        except (TypeError, AttributeError) as error:
            raise InvalidInputError(f"{self.path} cannot be set to {value!r}: {error}") from error
        # Blender does not evaluate what only renders read, such as the levels of modifiers, before it is asked to
        place.owner.id_data.update_tag()

    def require_taken(self, depsgraph: Any, value: Any) -> None:
        """Raise InvalidInputError if the evaluated file does not have the new value.

        Keyframes, drivers and constraints override the value, and a property may have limits.
        """
        block, rest = block_at(self.path)
        seen = place_in(block.evaluated_get(depsgraph), rest)
        if seen is None:
            return
        wanted, found = self.checked(value), seen.element()
        same = abs(wanted - found) <= 1e-6 * max(1.0, abs(wanted)) if isinstance(found, float) else wanted == found
        if not same:
            raise InvalidInputError(
                f"{self.path} was set to {value!r}, but keyframes, a driver, a constraint or its limits make it "
                f"{found!r}; remove them, sweep what drives it, or narrow its range"
            )

    def matrix(self, depsgraph: Any) -> tuple[float, ...] | None:
        """Where the evaluated object or bone stands, if this is a part of its place; else None."""
        block, rest = block_at(self.path)
        if self.place.is_custom or not self.place.name.removeprefix("delta_").startswith(_PLACING):
            return None
        seen = place_in(block.evaluated_get(depsgraph), rest)
        owner = None if seen is None else seen.owner
        if isinstance(owner, bpy.types.Object):
            return tuple(number for row in owner.matrix_world for number in row)
        if isinstance(owner, bpy.types.PoseBone):
            return tuple(number for row in owner.matrix for number in row)
        return None

    def require_animatable(self) -> None:
        """Raise InvalidInputError if keyframes of the property would change nothing."""
        place = self.place
        if is_of_palette(self.path):
            raise InvalidInputError(
                f"{self.path} is a setting of the palette, which is not solved anew for each frame; apply single points"
            )
        if not (place.is_custom or place.owner.bl_rna.properties[place.name].is_animatable):
            raise InvalidInputError(f"{self.path} cannot be animated in Blender; remove it from the sweep first")

    def keyframe(self, frame: int) -> None:
        """Insert a keyframe of the present value. Raises InvalidInputError if the property cannot be animated."""
        self.require_animatable()
        place = self.place
        path = f'["{bpy.utils.escape_identifier(place.name)}"]' if place.is_custom else place.name
        try:
            place.owner.keyframe_insert(path, index=-1 if place.index is None else place.index, frame=frame)
        except (TypeError, RuntimeError) as error:
            raise InvalidInputError(f"{self.path} cannot be animated: {error}") from error


def setting_at(path: str) -> Setting:
    """The setting at a full data path. Raises InvalidInputError if there is none that a sweep can vary."""
    block, rest = block_at(path)
    place = place_in(block, rest)
    element = None if place is None else place.element()
    if place is not None and isinstance(element, bool):
        return Setting(path, place, SWITCH)
    if place is not None and isinstance(element, (int, float)):
        listed = place.ui().get("items") or () if place.is_custom else ()
        return Setting(path, place, tuple(item[0] for item in listed), tuple(item[4] for item in listed))
    if place is not None and isinstance(element, str) and not place.is_custom:
        known = place.owner.bl_rna.properties[place.name]
        offered = tuple(item.identifier for item in known.enum_items) if known.type == "ENUM" else ()
        if len(offered) > 1:
            return Setting(path, place, offered)
        if known.type == "ENUM":
            raise InvalidInputError(f"{path!r} offers values that depend on the file, which a sweep cannot list")
    raise InvalidInputError(
        f"{path!r} cannot be varied by a sweep; expected a number, one component of a vector or color, a switch, "
        "or a choice from a list"
    )


def follow_names(sweep: PropertyGroup) -> None:
    """Update the path of every swept setting to its data-block, which may be renamed."""
    for entry in sweep.parameters:
        _follow_name(entry)


def _follow_name(entry: PropertyGroup) -> None:
    found = None
    with contextlib.suppress(InvalidInputError):  # deleted or renamed
        found = block_at(entry.name)[0]
    if entry.block is None:
        entry.block = found
    elif found != entry.block:
        entry.name = renamed(entry.name, entry.block)


def swept_setting(entry: PropertyGroup) -> Setting:
    """The setting of a parameter of a scene's sweep.

    Raises InvalidInputError if it was deleted, or is of another scene, which a render of this one does not read.
    """
    _follow_name(entry)
    setting, block, scene = setting_at(entry.name), entry.block, entry.id_data
    if isinstance(block, bpy.types.Object) and not block.users_collection:  # only the sweep still holds it
        raise InvalidInputError(
            f"the parameter {entry.label!r} is {entry.name}, and that object was deleted from every collection; "
            "remove the parameter from the sweep"
        )
    if isinstance(block, bpy.types.Scene) and block != scene and not setting.place.is_custom:
        raise InvalidInputError(
            f"the parameter {entry.label!r} is {entry.name}, a setting of another scene than {scene.name!r}; remove "
            "the parameter from the sweep, and add this scene's own setting"
        )
    return setting


def is_of_palette(path: str) -> bool:
    """True if this is a setting of a palette, whose spectra the scene gets only after a solve."""
    return ".spectral.palette." in path


def follow_palette(paths: Iterable[str]) -> None:
    """Solve and apply the palette of the scene in the context if one of the settings is of a palette.

    Raises InvalidInputError if there is no solution.
    """
    if not any(map(is_of_palette, paths)):
        return
    try:
        bpy.ops.spectral.palette_solve()
        bpy.ops.spectral.palette_apply()
    except RuntimeError as error:
        raise InvalidInputError(f"the palette: {str(error).strip().removeprefix('Error: ')}") from error


def column_name(setting: Setting, taken: list[str]) -> str:
    """A column name: the data-block, the property or the node's socket, and the component of a vector or color."""
    place = setting.place
    words = [*re.findall(r'"([^"]*)"', setting.path)[:1], _shown_name(place)]
    if place.index is not None:
        subtype = "" if place.is_custom else place.owner.bl_rna.properties[place.name].subtype
        letters = _COMPONENTS.get(subtype, "")
        words.append(letters[place.index] if place.index < len(letters) else str(place.index))
    name = re.sub(r"\W+", "_", "_".join(words)).strip("_").lower() or "value"
    name = name if is_column_name(name) else f"p_{name}"
    return name if name not in taken else next(f"{name}_{k}" for k in range(2, 1000) if f"{name}_{k}" not in taken)


def _shown_name(place: Number) -> str:
    """The name that the artist sees: of a socket, of an input of a geometry nodes modifier, or of the property."""
    owner = place.owner
    if isinstance(owner, bpy.types.NodeSocket):
        return str(owner.name)
    if place.is_custom and isinstance(owner, bpy.types.NodesModifier) and owner.node_group is not None:
        sockets = [item for item in owner.node_group.interface.items_tree if item.item_type == "SOCKET"]
        return next((str(socket.name) for socket in sockets if socket.identifier == place.name), place.name)
    if not place.is_custom and place.name == "value":  # such an input from Blender 5.2 on
        return str(owner.bl_rna.properties[place.name].name)
    return place.name
