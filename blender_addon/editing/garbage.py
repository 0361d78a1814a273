# SPDX-License-Identifier: GPL-3.0-or-later
"""Python's garbage collector in a Blender with a window.

A full collection looks at every object that can refer to others. With the modules of the extension and its libraries
these are 150,000, which takes 80 ms in the middle of an edit. Loaded modules stay, so the collector passes over what
exists after they were loaded (``gc.freeze``). An object that nobody refers to is freed as before; only those that
refer to each other in circles and are dropped later stay.
"""

from __future__ import annotations

import gc
import sys

import bpy

FEWEST = 20
"""Number of new modules from which on the collector passes over what they have made."""
_loaded = [0]


def _after_collection(phase: str, _info: dict[str, int]) -> None:
    """Python calls this around each collection; while modules are loaded, there are many small ones."""
    if phase == "stop" and len(sys.modules) >= _loaded[0] + FEWEST:
        _settle()


def _settle() -> None:
    _loaded[0] = len(sys.modules)
    gc.freeze()


def register() -> None:
    """Start, in a Blender with a window."""
    if not bpy.app.background:
        gc.callbacks.append(_after_collection)
        _settle()


def unregister() -> None:
    """Let the collector look at all objects again."""
    if _after_collection in gc.callbacks:
        gc.callbacks.remove(_after_collection)
        gc.unfreeze()
