# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes that ``render --passes`` requests by their names."""

from __future__ import annotations

import argparse
from typing import Any

from spectral_core.errors import UnknownNameError

from . import _blend

Tick = tuple[str, bool]
"""Check box of a view layer, and whether it is one of Cycles'."""


def ticks(arguments: argparse.Namespace) -> list[Tick]:
    """The check boxes of the passes.

    Raises UnknownNameError for an unknown pass: before the file is opened, which may take minutes.
    """
    if not arguments.passes:
        return []
    _blend.scene_file(arguments)  # its absence is reported before Blender starts
    _blend.require_blender()
    from ..translate.passes import OF_CYCLES, OF_LAYER

    known = {name: (tick, False) for tick, name in OF_LAYER.items()}
    known |= {name: (tick, True) for tick, more in OF_CYCLES.items() for name in more}
    for name in arguments.passes:
        if name not in known:
            raise UnknownNameError.among("pass", name, list(known))
    return [known[name] for name in arguments.passes]


def tick(scene: Any, boxes: list[Tick]) -> None:
    """Switch passes on in every view layer that is rendered."""
    for box, of_cycles in boxes:
        for layer in scene.view_layers:
            setattr(layer.cycles if of_cycles else layer, box, True)
