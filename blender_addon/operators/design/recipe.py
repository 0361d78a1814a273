# SPDX-License-Identifier: GPL-3.0-or-later
"""Find a recipe, copy it, use its spectrum."""

from collections.abc import Callable
from typing import Any

import bpy
from bpy.types import Context, Scene

from spectral_core.errors import InvalidInputError

from ...editing import recipe
from ...editing.apart import stoppable
from ...editing.waiting import Waiting
from ..common import UNDOABLE, reporting, require_kept


class SPECTRAL_OT_recipe_find(Waiting, bpy.types.Operator):
    """Find amounts of real emitters, paints or films: drive levels, grams, coverages or thicknesses"""

    bl_idname = "spectral.recipe_find"
    bl_label = "Find Recipe"
    bl_options = UNDOABLE
    can_be_left = True
    result_of = "recipe"
    _before: dict[str, Any]

    def begin(self, context: Context) -> Callable[[], recipe.Found]:
        require_kept(context.scene, "recipe")
        self._before = recipe.result_of(context.scene)
        return recipe.search(context.scene, stoppable(self.stopping))

    def failed(self, scene: Scene) -> None:
        if self.is_stopped:
            recipe.put_back(scene, self._before)

    def end(self, scene: Scene, answer: recipe.Found) -> None:
        recipe.store(scene, answer)
        if not answer.met:
            self.report({"WARNING"}, "not all requirements can be reached; this is the nearest recipe")


class SPECTRAL_OT_recipe_copy(bpy.types.Operator):
    """Copy the recipe as text, to print or to send"""

    bl_idname = "spectral.recipe_copy"
    bl_label = "Copy Recipe"
    bl_options: set[str] = set()

    @reporting
    def execute(self, context: Context) -> None:
        text = context.scene.spectral.recipe.text
        if not text:
            raise InvalidInputError("there is no recipe yet; press Find Recipe first")
        context.window_manager.clipboard = text
        self.report({"INFO"}, "the recipe is on the clipboard")


class SPECTRAL_OT_recipe_give(bpy.types.Operator):
    """Assign the recipe's spectrum to the selected lamp, or to the selected object's material"""

    bl_idname = "spectral.recipe_give"
    bl_label = "Use It Here"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context: Context) -> None:
        lamp, active = context.scene.spectral.recipe.kind == "LAMP", context.object
        target = None
        if active is not None:
            target = (active.data if active.type == "LIGHT" else None) if lamp else active.active_material
        if target is None:
            wanted = "a lamp" if lamp else "an object with a material"
            raise InvalidInputError(f"select {wanted} that gets the spectrum of the recipe")
        recipe.give(context.scene, target)
        self.report({"INFO"}, f"{target.name} has it")


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_OT_recipe_find, SPECTRAL_OT_recipe_copy, SPECTRAL_OT_recipe_give)
)
