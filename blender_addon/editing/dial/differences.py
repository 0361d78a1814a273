# SPDX-License-Identifier: GPL-3.0-or-later
"""Text on the differences between the recorded parts of a scene and those of now."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .rendered_parts import FILM, FORM, SETTINGS

HIDDEN = "hidden"
"""Value in place of the hash of a part that is rendered but hidden in the viewport, so that it cannot be compared."""
WORLD, SUNS = "the world", "the sun of the sky"
"""Parts that every scene has. A dark sky has no sun, so that its suns are one part, which may be empty."""
NAMED = 3
"""Changed parts that are named; others are counted."""


def _fill_up(recorded: dict[str, str], now: dict[str, str]) -> None:
    """Let forms that were added or removed count as changed; a recording of an earlier version has no such parts."""
    if SUNS not in recorded:
        now.pop(SUNS, None)
    if FILM not in recorded:
        for name in [name for name in now if name in SETTINGS or name.startswith(FORM)]:
            del now[name]
    for name in {*recorded, *now}:
        if name.startswith(FORM):
            recorded.setdefault(name, "")
            now.setdefault(name, "")


def told(recorded: dict[str, str], now: dict[str, str]) -> str:
    """Text on the differences between the hashes of parts by name; it fills up both."""
    _fill_up(recorded, now)
    found = [f"{name} was removed" for name, before in recorded.items() if name not in now and before != HIDDEN]
    found += [f"{name} was added" for name, after in now.items() if name not in recorded and after != HIDDEN]
    both = [name for name in recorded if HIDDEN not in (recorded[name], now.get(name, HIDDEN))]
    found += [f"{name} was changed" for name in both if recorded[name] != now[name]]
    rest = f", and {len(found) - NAMED} more" if len(found) > NAMED else ""
    return f"{', '.join(found[:NAMED])}{rest}" if found else ""


def world_varies(parts: Mapping[str, Any]) -> bool:
    """True if the world of a scene's parts shines in several colors: an image, a pattern, a sky, or another color for
    the camera.
    """
    from spectral_core.render.light_groups import has_several_colors
    from spectral_core.scene import Color
    from spectral_core.spectra.spectrum import Spectrum

    world = parts[WORLD]
    is_plain = all(isinstance(p.color, Color | Spectrum) for p in world.parts)
    return bool(parts[SUNS]) or has_several_colors(world) or not is_plain
