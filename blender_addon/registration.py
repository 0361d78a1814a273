# SPDX-License-Identifier: GPL-3.0-or-later
"""What the extension adds to Blender, in order: each module has ``register()`` and ``unregister()``."""

from __future__ import annotations

from . import engine, jobs
from .drawing import icons
from .operators import palette_solve as solve_operators
from .operators import palette_table as table_operators
from .operators import spectrum as spectrum_operators
from .panels import palette as palette_panels
from .panels import spectrum as spectrum_panels
from .properties import live, palette, palette_cell, palette_solve, render, scene, spectrum

MODULES = (
    spectrum,
    palette_cell,
    palette,
    render,
    scene,
    live,
    palette_solve,
    icons,
    table_operators,
    solve_operators,
    spectrum_operators,
    spectrum_panels,
    palette_panels,
    jobs,
    engine,
)


def register() -> None:
    """Register every module; where one fails, what was registered before it is taken away again."""
    done = []
    try:
        for module in MODULES:
            module.register()
            done.append(module)
    except Exception:
        for module in reversed(done):
            module.unregister()
        raise


def unregister() -> None:
    """Take everything away, in the opposite order."""
    for module in reversed(MODULES):
        module.unregister()
