# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyframes and drivers of a setting that something else decides: they would change it back at each frame."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from .. import compat


def still(block: Any, path: str) -> None:
    """Mute all that animates a property of a data-block: its drivers, and curves of its action and its NLA strips."""
    animation = block.animation_data
    if animation is None:
        return
    strips = [strip for track in animation.nla_tracks for strip in _all_of(track.strips)]
    for curves in (animation.drivers, *(each for owner in (animation, *strips) for each in compat.curves_of(owner))):
        for curve in curves:
            if curve.data_path == path:
                curve.mute = True


def _all_of(strips: Iterable[Any]) -> Iterator[Any]:
    """NLA strips, and those within strips of several."""
    for strip in strips:
        yield strip
        yield from _all_of(strip.strips)
