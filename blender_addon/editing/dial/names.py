# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that were renamed since the recording: their bulbs have the present names, and the recording stays valid."""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Mapping, Sequence
from itertools import count

import bpy
from bpy.types import PropertyGroup, Scene, bpy_prop_collection


def recorded_names(scene: Scene) -> dict[str, str]:
    """Name in the recording by present name, for the lamps that were renamed since.

    A lamp that has taken the earlier name of a renamed one gets a name that the recording does not have.
    """
    members = [kept for bulb in scene.spectral.dial.bulbs for kept in bulb.members]
    lamps = {kept.owner.name_full: kept.name for kept in members if kept.name and _is_lamp(kept.owner)}
    found = {now: before for now, before in lamps.items() if now != before}
    taken = {*lamps, *lamps.values()}
    for name in list(found.values()):
        if name not in lamps:
            found.setdefault(name, _free(name, taken))
    return found


def names_of_lights(names: Mapping[str, str], lights: Iterable[str]) -> dict[str, str]:
    """``names`` of lamps for those ``lights`` of a translated scene that have another name: instances follow their
    lamp (``Main #2`` was ``Key #2``), and a lamp that has such a name itself (``Key #2``) gets another one.
    """
    if not names:
        return {}
    lamps = {each.name_full for each in bpy.data.objects if each.type == "LIGHT"}
    found = {light: names.get(light, light) if light in lamps else _renamed(light, names) for light in lights}
    renamed = {light: before for light, before in found.items() if before != light}
    taken = set(renamed.values())
    return renamed | {light: _free(light, {*taken, *found}) for light in taken & found.keys() - renamed.keys()}


def _free(name: str, taken: Container[str]) -> str:
    """``name`` with a number that is not taken; ``Key #2`` would be an instance of a recorded lamp."""
    return next(other for other in (f"{name} ({number})" for number in count(2)) if other not in taken)


def _renamed(name: str, names: Mapping[str, str]) -> str:
    """The other name of a lamp or of its instance."""
    lamp = without_number(name)
    return names.get(lamp, lamp) + name[len(lamp) :]


def present_part(part: str, names: Mapping[str, str]) -> str:
    """A recorded part with the present name of its lamp. ``names``: of ``recorded_names``."""
    shown = {f"light {before!r}": f"light {name!r}" for name, before in names.items()}
    lamp = part if part in shown else without_number(part[:-1]) + part[-1:]
    return shown[lamp][:-1] + part[len(lamp) - 1 :] if lamp in shown else part


def dark_parts(scene: Scene, recorded: Iterable[str]) -> list[str]:
    """Names of the recorded parts that are lamps that the dial has made dark, or instances of them, which are not in
    the scene until it lights them again.
    """
    members = [(bulb, kept) for bulb in scene.spectral.dial.bulbs for kept in bulb.members if _is_lamp(kept.owner)]
    dark = {_light_part(kept) for bulb, kept in members if bulb.is_dark and kept.owner.data.energy == 0}
    others = {_light_part(kept) for _, kept in members} - dark
    return [name for name in recorded if name not in others and without_number(name[:-1]) + name[-1:] in dark]


def without_number(name: str) -> str:
    """The name of the object of which another one is an instance: translations number instances (``Key #2``)."""
    return re.sub(r"( #\d+)+$", "", name)


def present_names(names: Mapping[str, str]) -> dict[str, str]:
    """The inverse of ``recorded_names``."""
    return {before: now for now, before in names.items()}


def name_of(bulb: PropertyGroup) -> str:
    """Present name of a bulb for the user: that of the object it was named after, or of its light group."""
    dial = bulb.id_data.spectral.dial
    owners = {kept.owner for kept in bulb.members} if dial.named_by_object else set()
    original = None if not dial.named_by_object or len(bulb.members) else original_of(bulb, dial.bulbs)
    if original is not None:
        return name_of(original) + bulb.name[len(original.name) :]
    if len(owners) == 1 and all(kept.name == bulb.name for kept in bulb.members):
        (owner,) = owners
        if owner is not None:
            return str(owner.name_full)
    return bulb.name or "ungrouped"


def original_of(bulb: PropertyGroup, bulbs: Iterable[PropertyGroup]) -> PropertyGroup | None:
    """The bulb of the light of which a bulb without members is an instance; None if there is none."""
    name = without_number(bulb.name)
    return next((each for each in bulbs if each.name == name and each != bulb), None)


def dark_bulbs_besides(bulbs: bpy_prop_collection, groups: Sequence[str]) -> str:
    """Names of the bulbs that the dial made dark and that are none of the light groups, with commas; "" for none."""
    return ", ".join(name for name in (name_of(bulb) for bulb in bulbs if bulb.is_dark) if name not in groups)


def match_bulbs(bulbs: bpy_prop_collection, groups: Sequence[str]) -> bool:
    """One bulb for each group of a recording: those of the dial if they have these names now; True if they are new."""
    for bulb, name in [(bulb, name_of(bulb)) for bulb in bulbs if bulb.name]:
        bulb.name = name
    if sorted(bulb.name for bulb in bulbs) == sorted(groups):
        for number, name in enumerate(groups):
            bulbs.move([bulb.name for bulb in bulbs].index(name), number)
        return False
    bulbs.clear()
    for group in groups:
        bulbs.add().name = group
    return True


def _light_part(kept: PropertyGroup) -> str:
    return f"light {(kept.name or kept.owner.name_full)!r}"


def _is_lamp(owner: object) -> bool:
    return isinstance(owner, bpy.types.Object) and owner.type == "LIGHT"
