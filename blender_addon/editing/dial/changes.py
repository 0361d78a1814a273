# SPDX-License-Identifier: GPL-3.0-or-later
"""Test if the scene still equals the recorded one, part by part: the dial shows the changes."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import bpy
from bpy.types import Depsgraph, Scene, ViewLayer

from spectral_core.errors import SpectralError

from ...translate.scene import translate_scene
from ...translate.viewport.kept import Unfinished
from ..deferred import Deferred
from ..viewport.stages import Stage
from .as_rendered import SHOWN, first_layer, translated_layers
from .differences import HIDDEN, SUNS, WORLD, told
from .live import changed, redraw_dial
from .members import forget_deleted
from .names import dark_parts, names_of_lights, present_part, recorded_names
from .rendered_parts import look_matrix, names_of, rendered_forms, rendered_objects, settings_parts

REST_SECONDS = 1.0
"""Time without an edit until the scene is compared."""
SLOW_SECONDS = 0.5
"""A scene that takes longer to compare is compared only on request."""
SHARE_SECONDS = 0.03
"""Blender's main thread translates a scene in shares of about this time."""
DIGITS = 12
"""Digits of each part's hash: they detect an edit, and can be stored for thousands of objects."""
EDITED_ELSEWHERE = "The scene was edited since the recording; press Compare to list the changes"

slow_scenes: set[int] = set()
_shares: dict[int, Shares] = {}
"""Parts of scenes whose comparison has begun."""
_stages: dict[int, Stage] = {}
"""By scene the parts of its last translation, in a session with a window: only edited parts are translated again."""
_hashes: dict[int, dict[int, tuple[Any, str]]] = {}
"""By scene and identity of a part: the part, and its hash."""

_settings: dict[int, tuple[str, bytes]] = {}
"""By scene the hash of its settings of renders, and the matrix of its look, at the last update."""
LAYER = "the view layer"
"""Name of the part whose value is the name of the view layer that the others belong to."""


@dataclass(frozen=True)
class Parts:
    """Everything that a recording depends on, by name; ``hidden``: names whose hash is HIDDEN.

    ``layer``: name of the view layer.
    """

    scene: int
    layer: str
    values: dict[str, Any]
    hidden: tuple[str, ...]

    def hashes(self) -> dict[str, str]:
        """Name to hash; without Blender, so that a thread can compute them."""
        from spectral_core.scene import scene_hash

        known = _hashes.get(self.scene, {})
        made = {id(part): known.get(id(part)) or (part, scene_hash(part)[:DIGITS]) for part in self.values.values()}
        if not bpy.app.background:
            _hashes[self.scene] = made
        hashes = {name: made[id(part)][1] for name, part in self.values.items()}
        return {LAYER: self.layer} | dict.fromkeys(self.hidden, HIDDEN) | hashes


def parts_of(scene: Scene) -> dict[str, str]:
    """Name to hash of everything that the recording depends on, as the viewport has it now."""
    return present_parts(scene).hashes()


def present_parts(scene: Scene) -> Parts:
    """Everything that the recording depends on as it is now, in the view layer and with the names of the recording."""
    return read_parts(scene, layer=recorded_layer(scene), names=recorded_names(scene))


def read_parts(
    scene: Scene, seconds: float = math.inf, *, continues: bool = False, layer: str = "",
    names: Mapping[str, str] | None = None,
) -> Parts:  # fmt: skip
    """Everything that the recording depends on, as the viewport has it now.

    Parts that are hidden from renders do not count, whatever the viewport shows; HIDDEN stands for those that only
    the viewport hides. ``seconds``: raises Unfinished after about so long; ``continues``: True for a call after that.
    ``layer``: name of the view layer; without it that of the last translation. ``names``: other names of lamps.
    """
    from spectral_core.render.light_groups import is_of_world

    view_layer = _view_layer(scene, layer)
    if view_layer.depsgraph is None:
        view_layer.update()  # no window has shown it
    depsgraph, names = view_layer.depsgraph, names or {}
    stage = _stage_of(scene)
    if stage is not None and stage.users != {view_layer.name}:
        stage.kept.clear()  # those of another view layer
        stage.users = {view_layer.name}
    if not continues:
        depsgraph.update()
    if stage is not None:
        if not continues:
            stage.keep_up(depsgraph)
        stage.kept.limit(seconds)
    rendered = {each.session_uid: each for each in rendered_objects(view_layer.layer_collection)}
    own = {each.session_uid for each in view_layer.objects}

    def shows(instance: Any) -> bool:
        owner = (instance.parent if instance.is_instance else instance.object).original.session_uid
        return owner in rendered or owner not in own

    translated = translate_scene(depsgraph, shows=shows, kept=None if stage is None else stage.kept)
    if names:
        from spectral_core.render.relight.groups import with_light_names

        translated = with_light_names(translated, names_of_lights(names, (each.name for each in translated.lights)))
    parts: dict[str, Any] = {"the camera": translated.camera, "the size of the picture": translated.film.size}
    parts |= {WORLD: translated.world, **settings_parts(scene, view_layer), **rendered_forms(rendered.values())}
    parts[SUNS] = [replace(each, name="") for each in translated.lights if is_of_world(each)]
    for kind in ("lights", "meshes", "materials", "instances", "volumes"):
        singular = {"meshes": "mesh", "instances": "object"}.get(kind, kind[:-1])
        parts |= {f"{singular} {each.name!r}": each for each in getattr(translated, kind) if not is_of_world(each)}
    unseen = [obj for obj in rendered.values() if not obj.visible_get(view_layer=view_layer)]
    hidden = [name for obj in unseen for name in names_of(obj, names)]
    return Parts(scene.session_uid, view_layer.name, parts, tuple(hidden))


class Shares:
    """Reads the parts of a scene in shares, between which Blender's main thread is free. ``parts``: the outcome.

    ``layer``, ``names``: as in ``read_parts``.
    """

    def __init__(self, layer: str = "", names: Mapping[str, str] | None = None) -> None:
        self.parts: Parts | None = None
        self._layer, self._names = layer, names
        self._continues = False

    def read(self, scene: Scene) -> bool:
        """Read one share; True if no share is left. Raises SpectralError."""
        if self.parts is None:
            try:
                more: Any = {"layer": self._layer, "names": self._names, "continues": self._continues}
                self.parts = read_parts(scene, SHARE_SECONDS, **more)
            except Unfinished:
                self._continues = True
        return self.parts is not None


def _view_layer(scene: Scene, name: str) -> ViewLayer:
    """The view layer of that name, or that of the last translation, or that of the window."""
    last = translated_layers(scene)
    for known in (name, "" if last is None else last.name):
        if scene.view_layers.get(known) is not None:
            return scene.view_layers[known]
    return bpy.context.view_layer if bpy.context.scene == scene else first_layer(scene)


def _stage_of(scene: Scene) -> Stage | None:
    """What stays of a scene's translation; nothing without a window, where nobody edits between two comparisons."""
    return None if bpy.app.background else _stages.setdefault(scene.session_uid, Stage())


def remember_parts(scene: Scene, parts: dict[str, str]) -> None:
    """Store the state of the recorded scene, and forget earlier changes."""
    scene.spectral.dial.recorded_parts = json.dumps(parts)
    scene.spectral.dial.changes = ""


def accept(scene: Scene, before: dict[str, str]) -> None:
    """Accept a change made by the dial itself since ``before`` as recorded: Apply dims the lamps and nothing else."""
    recorded = recorded_parts(scene)
    for name, now in parts_of(scene).items():
        if recorded.get(name) == before.get(name) and now != HIDDEN:
            recorded[name] = now
    scene.spectral.dial.recorded_parts = json.dumps(recorded)


def recorded_parts(scene: Scene) -> dict[str, str]:
    """The stored state of the recorded scene; empty if unknown, as in files of an earlier version."""
    try:
        parts = json.loads(scene.spectral.dial.recorded_parts or "{}")
    except ValueError:
        return {}
    return parts if isinstance(parts, dict) else {}


def recorded_layer(scene: Scene) -> str:
    """Name of the view layer that was recorded; "" if unknown, as in files of an earlier version."""
    return str(recorded_parts(scene).get(LAYER, ""))


def compare(scene: Scene, parts: Parts | None = None) -> str:
    """Compare the scene with the recorded one, store the differences on the dial and return them; "" for none.

    ``parts``: those of the scene, if they were read already.
    """
    dial, recorded = scene.spectral.dial, recorded_parts(scene)
    if not dial.scene_hash or not recorded:
        return ""
    forget_deleted()
    layer = recorded.pop(LAYER, "")
    if layer and scene.view_layers.get(layer) is None:
        dial.changes = f"view layer {layer!r} was removed or renamed"
        return dial.changes
    began, names = time.monotonic(), recorded_names(scene)
    try:
        now = (parts or read_parts(scene, layer=layer, names=names)).hashes()
    except SpectralError as error:
        dial.changes = str(error)
        return dial.changes
    if time.monotonic() - began > SLOW_SECONDS:
        slow_scenes.add(scene.session_uid)
    now |= {LAYER: HIDDEN} | dict.fromkeys(dark_parts(scene, recorded), HIDDEN)
    dial.changes = told(*({present_part(name, names): each[name] for name in each} for each in (recorded, now)))
    return dial.changes


def _compare_and_show(scene: Scene) -> bool:
    """Read a share of the scene, and compare after the last one; False if another share is left."""
    shares = _shares.setdefault(scene.session_uid, Shares(recorded_layer(scene), recorded_names(scene)))
    with suppress(SpectralError):  # the comparison reads the parts again, and tells the artist
        if not shares.read(scene):
            return False
    del _shares[scene.session_uid]
    compare(scene, shares.parts)
    redraw_dial()
    return True


LIVE = Deferred(lambda _scene: None, _compare_and_show, delay_seconds=REST_SECONDS, rest_seconds=REST_SECONDS)


def _has_new_settings(scene: Scene, depsgraph: Depsgraph) -> bool:
    """True if settings of renders have changed since the last call; the picture follows the exposure of the look."""
    from spectral_core.scene import scene_hash

    layer = scene.view_layers.get(depsgraph.view_layer.name)
    if layer is None or not any(isinstance(each.id, Scene) for each in depsgraph.updates):
        return False
    try:
        found = scene_hash(list(settings_parts(scene, layer).values())), look_matrix(scene).tobytes()
    except SpectralError:  # the comparison reports it
        return True
    before = _settings.get(scene.session_uid)
    _settings[scene.session_uid] = found
    if before is not None and before[1] != found[1]:
        changed(scene)
    return before is None or before[0] != found[0]


@bpy.app.handlers.persistent
def _after_update(scene: Scene, depsgraph: Depsgraph) -> None:
    """Blender has evaluated an edit."""
    dial = scene.spectral.dial
    if scene.session_uid in _stages:
        _stages[scene.session_uid].keep_up(depsgraph)
    if bpy.app.background or not dial.scene_hash:
        return
    has_new_settings = _has_new_settings(scene, depsgraph)
    if not has_new_settings and not any(isinstance(each.id, SHOWN) for each in depsgraph.updates):
        return
    if scene.session_uid not in slow_scenes:
        LIVE.request(scene)
    elif not dial.changes:
        dial.changes = EDITED_ELSEWHERE


@bpy.app.handlers.persistent
def _forget(*_: object) -> None:
    """Another file has other scenes: free the parts of the last one's."""
    for kept in (slow_scenes, _shares, _stages, _hashes, _settings):
        kept.clear()


def register() -> None:
    """Start watching the scene."""
    bpy.app.handlers.depsgraph_update_post.append(_after_update)
    bpy.app.handlers.load_pre.append(_forget)


def unregister() -> None:
    """Stop watching the scene."""
    bpy.app.handlers.depsgraph_update_post.remove(_after_update)
    bpy.app.handlers.load_pre.remove(_forget)
    LIVE.cancel()
    _forget()
