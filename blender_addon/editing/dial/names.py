# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that were renamed since the recording: their bulbs have the present names, and the recording stays valid."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

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
            number = next(k for k in range(2, len(taken) + 3) if f"{name} #{k}" not in taken)
            found.setdefault(name, f"{name} #{number}")
    return found


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
    if len(owners) == 1 and all(kept.name == bulb.name for kept in bulb.members):
        (owner,) = owners
        if owner is not None:
            return str(owner.name_full)
    return bulb.name or "ungrouped"


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
