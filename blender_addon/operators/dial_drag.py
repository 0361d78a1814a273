# SPDX-License-Identifier: GPL-3.0-or-later
"""The dial under the mouse: drag the selector, drag bulbs, click bulbs on and off, keys; Esc ends.

The mouse changes only ``scene.spectral.dial``; the picture follows every such change.
"""

import contextlib

import bpy
import numpy as np
from bpy.props import FloatVectorProperty
from bpy.types import Area, Context, Event, PropertyGroup, Region

from spectral_core.errors import InvalidInputError, SpectralError

from ..drawing import dial as drawn
from ..drawing.dial_shape import CLICK_PIXELS, DialShape, Target, on_disc, snapped
from ..editing.dial import live
from ..editing.dial.picture import look
from ..editing.waiting import clear_every_status, clear_status
from .common import UNDOABLE, ends_drag, reporting, require_kept
from .dial import dial_in

AREAS = {"VIEW_3D", "IMAGE_EDITOR"}
NUDGE, FINE_NUDGE = 0.05, 0.01
ARROWS = {"LEFT_ARROW": (-1, 0), "RIGHT_ARROW": (1, 0), "UP_ARROW": (0, 1), "DOWN_ARROW": (0, -1)}
DIGITS = ("ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")
HINT = "Dial: drag the selector, drag bulbs, click bulbs on and off · Ctrl snaps · arrows, 1–9, 0 · Esc ends"

Place = tuple[Area, Region]
Pixel = tuple[float, float]

running: set[int] = set()
"""Windows (``as_pointer``) in which the dial handles the mouse."""


def _under_mouse(context: Context, event: Event) -> Place | None:
    """Area and region below the mouse, one of four in a quad view; None for another type of editor."""
    for area in context.window.screen.areas:
        inside = area.x <= event.mouse_x < area.x + area.width and area.y <= event.mouse_y < area.y + area.height
        if inside and area.type in AREAS:
            below = [each for each in area.regions if each.width > 1 and _holds(each, event)]
            if any(each.type != "WINDOW" for each in below):
                return None
            return (area, below[0]) if below else None
    return None


def _draw_moved(context: Context) -> None:
    """Draw dials again whose place has changed since they were drawn: the mouse would grab them elsewhere."""
    for area in context.window.screen.areas:
        if area.type in AREAS and drawn.is_elsewhere(area):
            area.tag_redraw()


def _holds(region: Region, event: Event) -> bool:
    return region.x <= event.mouse_x < region.x + region.width and region.y <= event.mouse_y < region.y + region.height


class SPECTRAL_OT_dial_play(bpy.types.Operator):
    """Turn the dial with mouse and keys, over the 3D view and the image editor, until Esc"""

    bl_idname = "spectral.dial_play"
    bl_label = "Turn the Dial"
    bl_options = UNDOABLE
    selector: FloatVectorProperty(
        name="Selector", size=2, default=(0.0, 0.0), description="Position of the selector, without a mouse"
    )

    @reporting
    def execute(self, context: Context) -> None:
        _require_bulbs(context)
        dial_in(context).selector = self.selector
        live.show(context.scene)

    def invoke(self, context: Context, _event: Event) -> set[str]:
        try:
            _require_bulbs(context)
        except InvalidInputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        key = context.window.as_pointer()
        if key in running:
            return {"CANCELLED"}
        running.add(key)
        self._window = key
        self._drag: _Drag | None = None
        dial_in(context).show = True
        with contextlib.suppress(SpectralError, OSError):  # dial.message reports it
            look(context, live.show(context.scene))
        context.workspace.status_text_set(HINT)
        context.window_manager.modal_handler_add(self)
        live.changed(context.scene)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> set[str]:
        if self._window not in running or not len(dial_in(context).bulbs):
            return self._end(context)
        if self._drag is not None:
            return self._dragging(context, event)
        if event.type == "ESC" and event.value == "PRESS":
            return self._end(context)
        if event.type == "MOUSEMOVE" and dial_in(context).show:
            _draw_moved(context)
        place = _under_mouse(context, event)
        if place is None or not dial_in(context).show:
            self._hover(context, None, False)
            return {"PASS_THROUGH"}
        shape = drawn.shape_in(*place)
        pixel = (event.mouse_x - place[1].x, event.mouse_y - place[1].y)
        is_over = shape.is_over(pixel)
        self._hover(context, place, is_over)
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            return self._press(context, place, shape, pixel)
        if is_over and event.value == "PRESS" and _key(context, event):
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"}

    def _hover(self, context: Context, place: Place | None, is_over: bool) -> None:
        now = place[1].as_pointer() if place is not None and is_over else 0
        if now != drawn.hovered["region"]:
            drawn.hovered["region"] = now
            if now:
                context.workspace.status_text_set(HINT)  # another tool may have shown its own meanwhile
            live.redraw_dial()

    def _press(self, context: Context, place: Place, shape: DialShape, pixel: Pixel) -> set[str]:
        dial = dial_in(context)
        target = shape.target(pixel, tuple(dial.selector), _places(dial))
        if target is None:
            return {"PASS_THROUGH"}
        before = tuple(dial.selector) if target.kind != "bulb" else tuple(dial.bulbs[target.index].place)
        drag = self._drag = _Drag(target, shape, (context.scene.session_uid, place[1].as_pointer()), pixel, before)
        if target.kind == "disc":
            drag.move(dial, pixel, snap=False)
        return {"RUNNING_MODAL"}

    def _dragging(self, context: Context, event: Event) -> set[str]:
        dial, drag = dial_in(context), self._drag
        assert drag is not None
        if event.type.startswith("TIMER"):  # of an animation that is played, or of a recording
            return {"PASS_THROUGH"}
        region = drag.region_in(context)
        if region is None or drag.target.index >= len(dial.bulbs):  # a recording that has ended brought fewer
            self._drag = None
            return {"RUNNING_MODAL"}
        pixel = (event.mouse_x - region.x, event.mouse_y - region.y)
        if event.type in ("MOUSEMOVE", "INBETWEEN_MOUSEMOVE"):
            drag.move(dial, pixel, snap=event.ctrl)
        elif event.type in ("ESC", "RIGHTMOUSE") and event.value == "PRESS":
            drag.put_back(dial)
            self._drag = None
        elif ends_drag(event):
            self._drag = None
            if event.type == "LEFTMOUSE" and drag.is_click and drag.target.kind == "bulb":
                bulb = dial.bulbs[drag.target.index]
                bulb.is_on = not bulb.is_on
            bpy.ops.ed.undo_push(message="Turn the Light Dial")
        return {"RUNNING_MODAL"}

    def _end(self, context: Context) -> set[str]:
        running.discard(self._window)
        drawn.hovered["region"] = 0
        clear_status(context)
        clear_every_status()
        live.redraw_dial()
        # Each drag has made its undo step. Another one would end what Redo brings back, as after an undo of Record.
        return {"CANCELLED"}

    def cancel(self, context: Context) -> None:
        """Blender ends the operator: another file is loaded, or the window closed."""
        running.discard(self._window)
        clear_status(context)


class _Drag:
    """A press in progress. A bulb moves only beyond CLICK_PIXELS, so that a click with a trembling hand stays a
    click.
    """

    def __init__(self, target: Target, shape: DialShape, pressed: tuple[int, int], pixel: Pixel, before: Pixel) -> None:
        """``pressed``: identifier of the scene, and address of the region, whose dial was pressed."""
        self.target, self.shape, self.before = target, shape, before
        self._pressed, self._start, self.is_click = pressed, pixel, True

    def region_in(self, context: Context) -> Region | None:
        """The region that was pressed; None if its editor was closed, or if the window shows another scene.

        It is found anew, because Blender frees the region of a closed editor, and Python would still read it.
        """
        scene, address = self._pressed
        if context.scene.session_uid != scene:
            return None
        regions = [region for area in context.window.screen.areas for region in area.regions]
        return next((region for region in regions if region.as_pointer() == address), None)

    def move(self, dial: PropertyGroup, pixel: Pixel, *, snap: bool) -> None:
        self.is_click = self.is_click and np.hypot(*np.subtract(pixel, self._start)) < CLICK_PIXELS
        place = on_disc(self.shape.place(pixel))
        if self.target.kind != "bulb":
            dial.selector = snapped(place, _places(dial)) if snap else place
        elif not self.is_click:
            others = np.delete(_places(dial), self.target.index, axis=0)
            dial.bulbs[self.target.index].place = snapped(place, others) if snap else place

    def put_back(self, dial: PropertyGroup) -> None:
        """Restore the state before the press."""
        if self.target.kind == "bulb":
            dial.bulbs[self.target.index].place = self.before
        else:
            dial.selector = self.before


def _places(dial: PropertyGroup) -> np.ndarray:
    return np.array([tuple(bulb.place) for bulb in dial.bulbs]).reshape(-1, 2)


def _key(context: Context, event: Event) -> bool:
    """Arrows move the selector (Shift: finely), 1 to 9 put it on a bulb, 0 at the center; True if the key was one of
    these. With Ctrl, Alt or Cmd they are Blender's.
    """
    dial = dial_in(context)
    if event.ctrl or event.alt or event.oskey:
        return False
    if event.type in ARROWS:
        step = FINE_NUDGE if event.shift else NUDGE
        dial.selector = on_disc(np.add(tuple(dial.selector), np.multiply(ARROWS[event.type], step)))
    elif event.type in DIGITS and DIGITS.index(event.type) < len(dial.bulbs):
        dial.selector = dial.bulbs[DIGITS.index(event.type)].place
    elif event.type == "ZERO":
        dial.selector = (0.0, 0.0)
    else:
        return False
    bpy.ops.ed.undo_push(message="Turn the Light Dial")
    return True


def _require_bulbs(context: Context) -> None:
    require_kept(context.scene, "light dial")
    if not len(dial_in(context).bulbs):
        raise InvalidInputError("the dial has no bulbs yet; press Record")


class SPECTRAL_OT_dial_stop(bpy.types.Operator):
    """Return the mouse to Blender"""

    bl_idname = "spectral.dial_stop"
    bl_label = "Stop Turning the Dial"
    bl_options: set[str] = set()

    def execute(self, _context: Context) -> set[str]:
        running.clear()
        return {"FINISHED"}


_register, _unregister = bpy.utils.register_classes_factory((SPECTRAL_OT_dial_play, SPECTRAL_OT_dial_stop))


def register() -> None:
    """Register the operators."""
    _register()


def unregister() -> None:
    """Stop handling the mouse, and remove the operators."""
    if running:
        clear_every_status()  # Blender frees the operator, and calls nothing of it
    running.clear()
    _unregister()
