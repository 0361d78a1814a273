# SPDX-License-Identifier: GPL-3.0-or-later
"""Modules that Blender must register, in this order: properties, live editing, operators, drawing, panels.

A new panel, operator or property group is one file with ``register()`` and ``unregister()``, and its name here.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

FEATURES = {
    "properties": (
        "spectrum", "palette.cell", "palette.answers", "palette.table", "render", "dial", "board", "sweep",
        "texture_design", "recipe", "viewport", "scene", "volume", "texture",
    ),
    "editing": (
        "pauses", "garbage", "viewport.session", "spectrum", "texture", "dial.live", "dial.as_rendered",
        "palette.live", "palette.picture", "dial.changes", "board.live", "sweep.live", "texture_job", "saved_paths",
    ),
    "operators": (
        "palette.table", "palette.solve", "palette.apply", "spectrum", "palette.files", "palette.scene", "render",
        "volume", "volume_files", "dial", "dial_record", "dial_apply", "dial_drag", "board", "sweep", "design.texture",
        "design.possible", "design.alternatives", "design.paint", "design.recipe", "design.look", "common",
    ),
    "drawing": ("icons", "overlay", "dial", "split"),
    "panels": (
        "shared", "settings", "viewport", "spectrum", "palette", "texture", "recipe", "render", "volume", "dial",
        "board", "sweep",
    ),
}  # fmt: skip
"""Folder to its modules with registration."""


def modules_of(folder: str) -> tuple[ModuleType, ...]:
    """The modules of a folder with registration."""
    return tuple(import_module(f".{folder}.{name}", __package__) for name in FEATURES[folder])


MODULES = tuple(module for folder in FEATURES for module in modules_of(folder))
