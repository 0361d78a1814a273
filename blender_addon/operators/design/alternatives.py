# SPDX-License-Identifier: GPL-3.0-or-later
"""Find alternative solutions of the palette, and select one of them."""

from collections.abc import Callable

import bpy
from bpy.props import IntProperty
from bpy.types import Context, Scene

from ...editing.apart import stoppable
from ...editing.palette import alternatives, live, possible
from ...editing.waiting import Waiting
from ..common import UNDOABLE, palette_in, reporting


class SPECTRAL_OT_palette_alternatives(Waiting, bpy.types.Operator):
    """Find solutions that meet all requests and differ as much as possible elsewhere. Takes some seconds"""

    bl_idname = "spectral.palette_alternatives"
    bl_label = "Find Alternatives"
    bl_options = UNDOABLE
    can_be_left = True
    result_of = "alternatives"
    seed: IntProperty(name="Seed", default=0, min=0, description="Another number gives other solutions")

    def begin(self, context: Context) -> Callable[[], alternatives.Found]:
        palette_in(context)  # refuses a linked scene
        return alternatives.search(context.scene, self.seed, stoppable(self.stopping))

    def end(self, scene: Scene, answer: alternatives.Found) -> None:
        alternatives.store(scene, answer)
        if len(answer) < 2:
            self.report({"WARNING"}, "the targets allow only one solution; ignore a cell or unlock a material for more")
        else:
            self.report({"INFO"}, f"{len(answer)} different alternatives")


class SPECTRAL_OT_palette_alternative_take(bpy.types.Operator):
    """Use this solution in the palette. To find more like it, lock the materials to keep and search again"""

    bl_idname = "spectral.palette_alternative_take"
    bl_label = "Take Alternative"
    bl_options = UNDOABLE
    index: IntProperty(name="Alternative", min=0, description="Number of the solution, from 0")

    @reporting
    def execute(self, context: Context) -> None:
        palette_in(context)  # refuses a linked scene
        alternatives.take(context.scene, self.index)
        possible.changed(context.scene)
        live.show()


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_OT_palette_alternatives, SPECTRAL_OT_palette_alternative_take)
)
