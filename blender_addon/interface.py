# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist sees and the file stores, in the order in which Blender must learn of it."""

from __future__ import annotations

from .drawing import icons, overlay
from .drawing import light_dial as drawn_dial
from .operators import light_dial as dial_operators
from .operators import (
    light_dial_apply,
    light_dial_drag,
    light_dial_record,
    palette_files,
    palette_scene,
    render_plan,
    volume_files,
)
from .operators import mixing_board as board_operators
from .operators import palette_solve as solve_operators
from .operators import palette_table as table_operators
from .operators import spectrum as spectrum_operators
from .operators import volume as volume_operators
from .panels import light_dial as dial_panels
from .panels import mixing_board as board_panels
from .panels import palette as palette_panels
from .panels import render as render_panels
from .panels import spectrum as spectrum_panels
from .panels import volume as volume_panels
from .properties import (
    light_dial,
    light_dial_live,
    live,
    mixing_board,
    mixing_board_live,
    palette,
    palette_cell,
    palette_solve,
    render,
    scene,
    spectrum,
    volume,
)

PROPERTIES = (
    spectrum, palette_cell, palette, render, light_dial, mixing_board, scene, live, palette_solve, volume,
    light_dial_live, mixing_board_live,
)  # fmt: skip
OPERATORS = (
    table_operators, solve_operators, spectrum_operators, palette_files, palette_scene, render_plan,
    volume_operators, volume_files, dial_operators, light_dial_record, light_dial_apply,
    light_dial_drag, board_operators,
)  # fmt: skip
PANELS = (
    icons, spectrum_panels, palette_panels, render_panels, volume_panels, dial_panels, board_panels, overlay,
    drawn_dial,
)  # fmt: skip
MODULES = (*PROPERTIES, *OPERATORS, *PANELS)
