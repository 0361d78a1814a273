# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of the renderer: make it, override a decision, release it; and the cost of accuracy."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import bpy
from bpy.props import StringProperty
from bpy.types import Context, Event, PropertyGroup

from spectral_core.errors import InvalidInputError, counted

from .. import jobs
from ..editing.dial.as_rendered import AsRendered
from ..editing.waiting import Waiting
from ..translate.settings import overrides_of
from .common import UNDOABLE, chosen_path, reporting

if TYPE_CHECKING:
    from spectral_core.render import CostCurve
    from spectral_core.render.plan.effects import EffectPlan
    from spectral_core.scene import Scene


def store_plan(settings: PropertyGroup, plan: "EffectPlan") -> None:
    """Store the decisions of an EffectPlan for the panel."""
    settings.plan.clear()
    settings.plan_accepted = plan.accepted
    for decision in plan.decisions:
        line = settings.plan.add()
        line.name, line.value = decision.name, decision.value
        line.reason, line.cost = decision.reason, decision.cost_if_left_out
        line.error = -1.0 if decision.error is None else decision.error
        line.how, line.time_share = decision.how, decision.time_share
        line.choices = "|".join(decision.choices)
        line.is_overridable = decision.overridable
        line.is_artists = decision.source == "artist"


class _Reading(Waiting):
    """Base of operators that need the scene as F12 renders it, which may differ from what the viewport shows."""

    can_be_left = True
    _asked: AsRendered | None = None

    def prepare(self, context: Context, *, at_once: bool) -> None:
        self._asked = AsRendered(context, at_once=at_once)

    def is_prepared(self) -> bool:
        return self._asked is None or not self._asked.is_running

    def read(self) -> "Scene":
        """The scene. Raises InvalidInputError if it could not be translated."""
        assert self._asked is not None
        return self._asked.take()

    def end(self, scene: bpy.types.Scene, answer: Any) -> None:
        if self._asked is not None and self._asked.layers.told:
            self.report({"WARNING"}, self._asked.layers.told)  # type: ignore[attr-defined]

    def leave(self) -> None:
        if self._asked is not None:
            self._asked.leave()


class _Planning(_Reading):
    """Plans the scene in the renderer's process, which may have to start, or to end a render first."""

    def begin(self, context: Context) -> Callable[[], "EffectPlan"]:
        scene, stopping = self.read(), self.stopping
        return lambda: jobs.process.plan(scene, should_stop=stopping.is_set)

    def end(self, scene: bpy.types.Scene, answer: "EffectPlan") -> None:
        store_plan(scene.spectral.render, answer)
        super().end(scene, answer)


class SPECTRAL_OT_plan(_Planning, bpy.types.Operator):
    """Examine the scene and decide which effects must be simulated"""

    bl_idname = "spectral.plan"
    bl_label = "Plan the Render"
    bl_options = UNDOABLE


class _Overriding(_Planning):
    """Plans the scene with another override of one decision; where that fails, the present one returns."""

    effect: str
    _before: dict[str, str]

    def wanted(self) -> str | None:
        """The override, None to leave the decision to the plan. Raises InvalidInputError if it is incomplete."""
        raise NotImplementedError

    def prepare(self, context: Context, *, at_once: bool) -> None:
        settings, value = context.scene.spectral.render, self.wanted()
        self._before = overrides_of(settings)
        _set_override(settings, self.effect, value)
        try:
            super().prepare(context, at_once=at_once)
        except Exception:
            self.failed(context.scene)
            raise

    def begin(self, context: Context) -> Callable[[], "EffectPlan"]:
        try:
            return super().begin(context)
        except Exception:
            self.failed(context.scene)
            raise

    def failed(self, scene: bpy.types.Scene) -> None:
        _set_override(scene.spectral.render, self.effect, self._before.get(self.effect))


class SPECTRAL_OT_plan_override(_Overriding, bpy.types.Operator):
    """Override the plan's decision"""

    bl_idname = "spectral.plan_override"
    bl_label = "Override Decision"
    bl_options = UNDOABLE
    effect: StringProperty(name="Effect", description="Name of the decision, such as 'transport'")
    value: StringProperty(name="Value", description="What to simulate, such as 'spectral', 'off' or '4'")

    def invoke(self, context: Context, event: Event) -> set[str]:
        line = context.scene.spectral.render.plan.get(self.effect)
        if line is not None and line.choices:
            return super().invoke(context, event)
        return context.window_manager.invoke_props_dialog(self)

    def wanted(self) -> str | None:
        if not self.effect or not self.value:
            raise InvalidInputError("name the effect and the value to override it with")
        return str(self.value)


def _set_override(settings: PropertyGroup, effect: str, value: str | None) -> None:
    settings.id_data.update_tag()
    if effect == "transport":
        settings.transport = _transport(value)
        return
    found = settings.overrides.find(effect)
    if found >= 0:
        settings.overrides.remove(found)
    if value is not None:
        entry = settings.overrides.add()
        entry.name, entry.value = effect, value


def _transport(value: str | None) -> str:
    if value not in (None, "rgb", "spectral"):
        raise InvalidInputError(f"effect 'transport' cannot be {value!r}; choose rgb or spectral")
    return "AUTO" if value is None else value.upper()


class SPECTRAL_OT_plan_release(_Overriding, bpy.types.Operator):
    """Leave this decision to the plan again"""

    bl_idname = "spectral.plan_release"
    bl_label = "Leave to the Plan"
    bl_options = UNDOABLE
    effect: StringProperty(name="Effect", description="Name of the decision, such as 'transport'")

    def wanted(self) -> str | None:
        return None


def store_curve(settings: PropertyGroup, curve: "CostCurve") -> None:
    """Store the points of a cost curve for the panel."""
    settings.cost.clear()
    for point in curve.points:
        line = settings.cost.add()
        line.name, line.axis, line.is_measured = point.setting, point.axis, point.measured
        line.seconds, line.delta_e, line.bias = point.seconds, point.delta_e, point.bias
    now, asked = curve.now, curve.at_error
    least = "at least " if now.rare is not None else ""
    settings.cost_summary = (
        f"As it is set: {least}ΔE {now.delta_e:.2g} of noise in {now.seconds:.1f} s. "
        f"ΔE 1 takes {asked.seconds:.1f} s, {counted(asked.samples, 'sample', form='.0f')} in the mean."
    )
    if now.rare is not None:
        settings.cost_summary += f" {now.rare.text}"


class SPECTRAL_OT_cost(_Reading, bpy.types.Operator):
    """Measure error against time on some of the picture's pixels, and predict both for the whole picture"""

    bl_idname = "spectral.cost"
    bl_label = "Measure Cost"
    bl_options = UNDOABLE

    def begin(self, context: Context) -> Callable[[], "CostCurve"]:
        scene, stopping = self.read(), self.stopping
        return lambda: jobs.process.cost_curve(scene, should_stop=stopping.is_set)

    def end(self, scene: bpy.types.Scene, answer: "CostCurve") -> None:
        store_curve(scene.spectral.render, answer)
        super().end(scene, answer)


class SPECTRAL_OT_write_mitsuba(bpy.types.Operator):
    """Write the scene as a folder that Mitsuba 3 loads without this extension"""

    bl_idname = "spectral.write_mitsuba"
    bl_label = "Mitsuba 3 (Folder)"
    directory: StringProperty(
        name="Folder",
        description="Folder to write to; an unchanged earlier export in it is replaced",
        subtype="DIR_PATH",
    )

    def invoke(self, context: Context, _event: Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.render.mitsuba_export import write_mitsuba

        path = chosen_path(self.directory)
        asked = AsRendered(context, at_once=True)
        made = write_mitsuba(asked.take(), path)
        if asked.layers.told:
            self.report({"WARNING"}, asked.layers.told)
        for note in made.notes:
            self.report({"WARNING"}, f"{note.subject}: {note.message}")
        self.report({"INFO"}, f"{made.scene}: {counted(len(made.files), 'file')}")


def _draw_export(menu: bpy.types.Menu, _context: Context) -> None:
    menu.layout.operator("spectral.write_mitsuba")


_register, _unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_OT_plan,
        SPECTRAL_OT_plan_override,
        SPECTRAL_OT_plan_release,
        SPECTRAL_OT_cost,
        SPECTRAL_OT_write_mitsuba,
    )
)


def register() -> None:
    """Register the operators, and the entry in File > Export."""
    _register()
    bpy.types.TOPBAR_MT_file_export.append(_draw_export)


def unregister() -> None:
    """Remove them."""
    bpy.types.TOPBAR_MT_file_export.remove(_draw_export)
    _unregister()
