# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as F12 translates it, which the viewport may not show: a render that stops after its translation."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

import bpy
from bpy.types import Context, Depsgraph, Scene, ViewLayer

from spectral_core.errors import InvalidInputError, RenderCancelled, RenderError

from ... import jobs
from ...properties.render import ENGINE

if TYPE_CHECKING:
    from spectral_core.scene import Scene as SpectralScene

STOPPED = "reading the scene was stopped, as Esc and an undo do; press the button again"
NO_RENDER = "Blender did not start the render; is there a camera?"
RENDERS = "Blender renders at present; wait for the end of that render, or stop it, and press the button again"
SETTINGS = {"use_compositing": False, "use_sequencer": False, "engine": ENGINE}
"""Settings of a render that only translates the scene: a compositor would write the files of its File Output nodes,
and strips would replace the scene. The engine is the last: while the extension is disabled, Blender refuses it.
"""
SHOWN = (
    bpy.types.Object, bpy.types.Mesh, bpy.types.Curve, bpy.types.Light, bpy.types.Material, bpy.types.World,
    bpy.types.Camera, bpy.types.NodeTree, bpy.types.Volume, bpy.types.Collection,
)  # fmt: skip
"""Data-blocks that a picture depends on. The dial itself is stored on the scene, which is not among them."""
SLOT = "Spectral translation"
"""Name of the render slot that receives the empty picture of such a render."""


@dataclass(frozen=True)
class Layers:
    """The view layer that is translated. ``left_out``: names of the others that F12 renders."""

    name: str
    left_out: tuple[str, ...]

    @classmethod
    def of(cls, scene: Scene, layer: ViewLayer) -> Layers:
        """Those of a scene, with the layer to translate."""
        others = () if scene.render.use_single_layer else scene.view_layers
        return cls(layer.name, tuple(each.name for each in others if each.use and each.name != layer.name))

    @property
    def told(self) -> str:
        """Message about the layers that are left out, "" if there are none."""
        names = ", ".join(map(repr, self.left_out))
        return f"only the view layer {self.name!r} was read; left out: {names}" if names else ""


def first_layer(scene: Scene) -> ViewLayer:
    """The first view layer that is rendered, or the first one if none is."""
    return next((each for each in scene.view_layers if each.use), scene.view_layers[0])


_translated: dict[int, Layers] = {}
"""By session number of the scene: the layers of its last translation."""


def translated_layers(scene: Scene) -> Layers | None:
    """The layers of the scene's last translation by AsRendered; None before the first one."""
    return _translated.get(scene.session_uid)


def _switch(scene: Scene, layer: str) -> Callable[[], None]:
    """Give the scene SETTINGS, and one view layer to render; the function that is returned restores its own.

    The argument ``layer`` of Blender's operator is no way to that: without a window Blender ignores it, and with one it
    delays the job, so that none runs at first, as after its end. The scene's own settings are stored in the scene: the
    artist may edit and save meanwhile, and undo steps and files then contain SETTINGS.
    """
    number = scene.session_uid
    own = {"settings": _state(scene), "layers": {each.name: each.use for each in scene.view_layers}, "read": layer}
    scene.spectral.render.own_settings = json.dumps(own)
    _set(scene, SETTINGS, {each.name: each.name == layer for each in scene.view_layers})

    def restore() -> None:
        # an undo replaces the scene by another one with the same number; a deleted scene has none
        for each in bpy.data.scenes:
            if each.session_uid == number:
                _switch_back(each)

    return restore


def _state(scene: Scene) -> dict[str, Any]:
    return {name: getattr(scene.render, name) for name in SETTINGS}


def _switch_back(scene: Scene) -> None:
    """Restore a scene's own settings, if it has those of a translation; what the artist has set meanwhile stays."""
    stored, scene.spectral.render.own_settings = scene.spectral.render.own_settings, ""
    with suppress(ValueError, TypeError, KeyError, AttributeError):  # a text in a file may be anything
        own = json.loads(stored or "null")
        if own is not None:
            before = {name: own["settings"][name] for name in SETTINGS if getattr(scene.render, name) == SETTINGS[name]}
            read, now = own.get("read"), {each.name: each.use for each in scene.view_layers}
            switched = [name for name, use in now.items() if read is None or use == (name == read)]
            _set(scene, before, now | {name: own["layers"].get(name, True) for name in switched})


@bpy.app.handlers.persistent
def _after_exchange(*_: object) -> None:
    """An undo step or a file that was made during a translation is open now, and its scenes have SETTINGS."""
    if AsRendered._current is not None:
        AsRendered._current._edited_at = time.monotonic()
    for scene in bpy.data.scenes:
        if scene.spectral.render.own_settings and scene.library is None:
            _switch_back(scene)


@contextmanager
def only_translated(scene: Scene, layer: str) -> Iterator[None]:
    """Within it a render of the scene uses SETTINGS, and renders the view layer of that name."""
    restore = _switch(scene, layer)
    try:
        yield
    finally:
        restore()


def translated_at_once(scene: Scene, changed: Callable[[SpectralScene], SpectralScene] | None = None) -> SpectralScene:
    """The first view layer that is rendered, translated by a render that ends before it begins to trace.

    ``changed``: changes the scene within the render, which then reports its errors. Raises RuntimeError with Blender's
    message, RenderError if no render started.
    """
    caught: list[SpectralScene] = []

    def catch(translated: SpectralScene) -> NoReturn:
        caught.append(translated if changed is None else changed(translated))
        raise RenderCancelled("only the scene was requested")

    with only_translated(scene, first_layer(scene).name), jobs.request(jobs.RenderRequest(translated=catch)):
        bpy.ops.render.render(scene=scene.name)
    if not caught:
        raise RenderError(NO_RENDER)
    return caught[0]


def _set(scene: Scene, values: dict[str, Any], rendered: dict[str, bool]) -> None:
    """Set settings of renders, and which view layers are rendered; a name that is not known was given meanwhile.

    An equal value is not set: Blender restarts every rendered view when an engine is set.
    """
    for layer in scene.view_layers:
        layer.use = rendered.get(layer.name, True)
    for name, value in values.items():
        if getattr(scene.render, name) != value:
            setattr(scene.render, name, value)


class AsRendered:
    """Translation of a scene by a render: at once, or in Blender's render job, so that the interface goes on.

    The view layer is that of the window, and is the only one that is rendered between the start and ``take``, with
    SETTINGS; if another translation starts in between, the scene has its own settings before that. ``layers``: those
    that are translated and left out. Raises InvalidInputError if no render can start, and for a linked scene.
    """

    _current: ClassVar[AsRendered | None] = None
    """The last one, until it is taken: two that overlap would restore the settings of each other."""
    _edited_at: float | None = None

    def __init__(self, context: Context, *, at_once: bool) -> None:
        if not bpy.app.background and bpy.app.is_job_running("RENDER"):
            raise InvalidInputError(RENDERS)
        if context.scene.library is not None:  # Blender renders scenes by name, which a local one may have, too
            raise InvalidInputError(
                f"the scene {context.scene.name!r} is linked from {context.scene.library.filepath}, and this .blend "
                "does not keep what is stored in it; make the scene local, or open that file"
            )
        if AsRendered._current is not None:
            AsRendered._current.leave()
        self._scenes: list[SpectralScene] = []
        self._at_once = at_once
        self._failed = len(jobs.failures())
        self.layers = _translated[context.scene.session_uid] = Layers.of(context.scene, context.view_layer)
        self._until_taken = ExitStack()
        context.view_layer.update()  # earlier edits are in the translation
        AsRendered._current = self
        try:
            self._until_taken.callback(_switch(context.scene, self.layers.name))
            self._until_taken.enter_context(jobs.request(jobs.RenderRequest(translated=self._catch)))
            with _slot():
                if at_once:
                    bpy.ops.render.render(scene=context.scene.name)
                else:
                    _start_job(context.scene.name)
        except RuntimeError as error:
            self.leave()
            raise InvalidInputError(str(error).strip().removeprefix("Error: ")) from error
        except BaseException:
            self.leave()
            raise

    def _catch(self, scene: SpectralScene) -> NoReturn:
        self._scenes.append(scene)
        raise RenderCancelled("only the scene was requested")

    @property
    def edited_at(self) -> float | None:
        """Time of the last edit, which the scene may not have; None without one, or without a scene."""
        return self._edited_at if self._scenes else None

    @property
    def has_scene(self) -> bool:
        """True as soon as the scene is translated."""
        return bool(self._scenes)

    @property
    def is_running(self) -> bool:
        """True until the job has ended."""
        return bool(bpy.app.is_job_running("RENDER"))

    def leave(self) -> None:
        """End without a scene."""
        self._until_taken.close()
        if AsRendered._current is self:
            AsRendered._current = None

    def take(self) -> SpectralScene:
        """The scene; call it once. Raises InvalidInputError if the render failed, RenderCancelled if it was ended."""
        self.leave()
        if self._scenes:
            return self._scenes[0]
        failed = jobs.failures()[self._failed :]
        if not failed and not self._at_once:
            raise RenderCancelled(STOPPED)  # a job that has started was ended
        raise InvalidInputError(failed[-1].message if failed else NO_RENDER)


@contextmanager
def _slot() -> Iterator[None]:
    """A render that starts within it has a slot of its own: Blender frees the picture in the slot of a render."""
    image = next((each for each in bpy.data.images if each.type == "RENDER_RESULT"), None)
    if image is None:  # nothing was rendered
        yield
        return
    slots = image.render_slots
    shown, names = slots.active_index, [each.name for each in slots]
    if SLOT not in names:
        slots.new(name=SLOT)
        names.append(SLOT)
    slots.active_index = names.index(SLOT)
    try:
        yield
    finally:
        slots.active_index = shown


def _start_job(name: str) -> None:
    """Start Blender's render job without a window for its picture, which stays empty."""
    view = bpy.context.preferences.view
    chosen, view.render_display_type = view.render_display_type, "NONE"
    try:
        if "RUNNING_MODAL" not in bpy.ops.render.render("INVOKE_DEFAULT", scene=name):
            raise InvalidInputError(RENDERS)
    finally:
        view.render_display_type = chosen


@bpy.app.handlers.persistent
def _after_update(_scene: Scene, depsgraph: Depsgraph) -> None:
    """Blender has evaluated an edit."""
    asked = AsRendered._current
    if asked is None or depsgraph.mode != "VIEWPORT":
        return
    if any(isinstance(each.id, SHOWN) for each in depsgraph.updates):
        asked._edited_at = time.monotonic()


HANDLERS = ("undo_post", "redo_post", "load_post")


def register() -> None:
    """Start listening to edits, undo and files."""
    bpy.app.handlers.depsgraph_update_post.append(_after_update)
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).append(_after_exchange)


def unregister() -> None:
    """Stop listening, and restore the settings of scenes that are read."""
    if AsRendered._current is not None:
        AsRendered._current.leave()
    bpy.app.handlers.depsgraph_update_post.remove(_after_update)
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).remove(_after_exchange)
