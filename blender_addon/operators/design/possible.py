# SPDX-License-Identifier: GPL-3.0-or-later
"""Find the colors that the selected cell can show, and use the nearest one."""

from collections.abc import Callable
from functools import partial

import bpy
from bpy.types import Context, Scene

from spectral_core.errors import InvalidInputError

from ...editing.palette import possible
from ...editing.waiting import Waiting
from ...translate.palette.table import active_cell
from ..common import UNDOABLE, palette_in, reporting


class SPECTRAL_OT_palette_possible(Waiting, bpy.types.Operator):
    """Test whether the selected cell can show its color beside the exact cells of its row, and draw what it can show"""

    bl_idname = "spectral.palette_possible"
    bl_label = "Possible?"
    bl_options: set[str] = set()
    can_be_left = True

    def begin(self, context: Context) -> Callable[[], possible.Answer]:
        if active_cell(palette_in(context)) is None:
            raise InvalidInputError("no cell is selected; add a light and a material first")
        return partial(possible.answered, possible.question_of(palette_in(context)))

    def end(self, scene: Scene, answer: possible.Answer) -> None:
        self.report({"INFO"}, possible.keep(scene, answer).words.splitlines()[0])


class SPECTRAL_OT_palette_take_nearest(bpy.types.Operator):
    """Make the nearest possible color the target of this cell"""

    bl_idname = "spectral.palette_take_nearest"
    bl_label = "Take Nearest"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context: Context) -> None:
        palette_in(context)  # refuses a linked scene
        possible.take_nearest(context.scene)


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_OT_palette_possible, SPECTRAL_OT_palette_take_nearest)
)
