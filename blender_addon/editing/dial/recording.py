# SPDX-License-Identifier: GPL-3.0-or-later
"""A transport render of a Blender scene: its input, and the lights that must be rendered again."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from bpy.types import Context, Scene
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, SpectralError, counted
from spectral_core.files.whole import make_folder

from ... import jobs
from ...translate.dial import storage_of
from ...translate.display.transform import view_transform_of
from ...translate.viewport.look import require_light
from . import changes, kept_mix
from .as_rendered import translated_layers
from .members import Member, members_of, sealed_besides
from .names import names_of_lights, present_names, recorded_names
from .rendered_parts import look_matrix

if TYPE_CHECKING:
    from spectral_core.render import Progress
    from spectral_core.render.relight.agx_view import View
    from spectral_core.render.relight.groups import Fingerprint
    from spectral_core.render.relight.mix import LiveMix
    from spectral_core.render.relight.transport import Transport
    from spectral_core.scene import Note
    from spectral_core.scene import Scene as SpectralScene

MOST_NOTES = 3
"""Notes of a recording that are told, of which each is a sentence."""


@dataclass
class Recording:
    """A transport render. It reads all data from Blender before it starts, so that a thread can run it."""

    scene: SpectralScene
    storage: Any
    one_per_light: bool
    members: list[Member]
    parts: changes.Parts
    view: View | None
    look: NDArray[np.float64]
    """Matrix of the look of renders; the dial shows the picture with that of the present look."""
    before: tuple[Fingerprint, Transport] | None = None
    """The present recording, if only lights that have changed since then are to be recorded."""
    names: dict[str, str] = field(default_factory=dict)
    """Name in the present recording by present name, for lamps that were renamed since."""
    left_out: str = ""
    """Message about view layers that are not recorded."""
    fingerprint: Any = None
    hashes: dict[str, str] = field(default_factory=dict)
    """Of ``parts``, after ``run``."""
    again: tuple[str, ...] | None = None
    """Groups that are recorded; None for all."""
    progress: float = 0.0
    left_s: float | None = None
    """Seconds for the rest, None if unknown."""
    stop: bool = False
    path: Path = Path()
    """File to write. It changes if the .blend gets another name during the render."""

    @classmethod
    def of(
        cls, context: Context, scene: SpectralScene, *, only_changed: bool = False, parts: changes.Parts | None = None
    ) -> Recording:
        """Find the lights and emissive objects of a scene as rendered, and the state of the viewport's.

        ``parts``: that state, if it was read already. Raises InvalidInputError if the look shows only dark lights.
        """
        require_light(scene, context.scene.spectral.viewport.look)
        dial = context.scene.spectral.dial
        names = {each.name for each in (*scene.lights, *scene.instances)}
        shown = [each for each in bpy.data.objects if each.name_full in names]
        layers = translated_layers(context.scene)
        layer = context.view_layer if layers is None else context.scene.view_layers.get(layers.name, context.view_layer)
        members = members_of(layer, shown, dial.one_per_light)
        members += sealed_besides(scene, members, layer, dial.one_per_light)
        parts, view = parts or changes.read_parts(context.scene), view_transform_of(context.scene)
        look = look_matrix(context.scene)
        before = _present(context.scene) if only_changed else None
        left_out = "" if layers is None else layers.told
        renamed = {} if before is None else recorded_names(context.scene)
        earlier = names_of_lights(renamed, (each.name for each in scene.lights))
        return cls(scene, storage_of(dial), dial.one_per_light, members, parts, view, look, before, earlier, left_out)

    def identify(self) -> None:
        """Compute the fingerprint of the scene, for which its effects are planned."""
        from spectral_core.render.relight.groups import fingerprint

        self.fingerprint = fingerprint(self.scene, one_per_light=self.one_per_light)

    def run(self) -> Transport:
        """Render. Raises RenderCancelled after ``stop``, and the errors of ``record_transport``."""
        from spectral_core.render.relight.dial import MOST_BULBS
        from spectral_core.render.relight.transport import record_transport

        self.identify()
        self.hashes = self.parts.hashes()
        kept = None
        if self.before is not None:
            kept = self._still_valid(*self.before)
        return record_transport(
            self.scene, self.storage, one_per_light=self.one_per_light, most_groups=MOST_BULBS, view=self.view,
            look=self.look, kept=kept, again=self.again, render=jobs.render,
            on_progress=self._note, should_stop=lambda: self.stop,
        )  # fmt: skip

    def _still_valid(self, known: Fingerprint, transport: Transport) -> Transport | None:
        """The present recording with the present names of its lamps; None if all must be recorded. Sets ``again``."""
        from spectral_core.render.relight.groups import changed_groups, fingerprint, with_light_names

        now = self.fingerprint
        if self.names:
            now = fingerprint(with_light_names(self.scene, self.names), one_per_light=self.one_per_light)
        self.again = changed_groups(known, now)
        if self.again is None or not self.one_per_light:
            return None if self.again is None else transport
        present = present_names(self.names)
        self.again = tuple(present.get(name, name) for name in self.again)
        return replace(transport, groups=tuple(present.get(name, name) for name in transport.groups))

    def require_grouping(self, transport: Transport) -> None:
        """Raise InvalidInputError if a transport of this scene has other light groups."""
        from spectral_core.render.light_groups import group_text, light_groups
        from spectral_core.render.relight.groups import one_group_per_light

        # volumes that emit light are in groups, too, and no member of a bulb writes their strength
        known = light_groups(one_group_per_light(self.scene) if self.one_per_light else self.scene)
        if set(transport.groups) - set(known):
            other = "off" if self.one_per_light else "on"
            raise InvalidInputError(
                f"the file has light groups {', '.join(map(group_text, transport.groups))}; this scene has "
                f"{', '.join(map(group_text, sorted(known)))}. Was it recorded with One per Light {other}?"
            )

    @property
    def told(self) -> str:
        """Message about a recording that does not cover everything."""
        left_out = f"; {self.left_out}" if self.left_out else ""
        if self.again is None:
            return left_out
        names = ", ".join(name or "ungrouped" for name in self.again)
        rendered = f"only {names} rendered anew" if names else "no light had changed, so nothing was rendered"
        return f"; {rendered}{left_out}"

    def _note(self, progress: Progress) -> None:
        self.progress, self.left_s = progress.samples / progress.total, progress.left_s


@dataclass(frozen=True)
class Recorded:
    """What the thread hands back. ``path``: of the file; ``unsaved``: the error if it could not be written."""

    mix: LiveMix
    path: Path
    unsaved: Exception | None


def recorded_in_file(recording: Recording) -> Recorded:
    """Render, and write the file. A recording that could not be written is kept: it may have taken hours."""
    from spectral_core.render.relight.transport_file import write_transport

    transport, path, unsaved = recording.run(), recording.path, None
    try:
        make_folder(path.parent)
        write_transport(path, transport, only_over_transports=True)  # the path may come from a downloaded .blend
    except (SpectralError, OSError) as error:
        unsaved = error
    return Recorded(kept_mix.mix_of(transport), path, unsaved)


def told(notes: Sequence[Note]) -> str:
    """Text on the features that a recording approximates."""
    shown = [f"; {each.subject}: {each.message}" for each in notes[:MOST_NOTES]]
    more = len(notes) - MOST_NOTES
    return "".join(shown) + (f"; and {counted(more, 'more note')}" if more > 0 else "")


def _present(scene: Scene) -> tuple[Fingerprint, Transport] | None:
    """The present recording and the fingerprint of its scene; None if all must be recorded."""
    from spectral_core.render.relight.groups import Fingerprint

    dial = scene.spectral.dial
    try:
        before = json.loads(dial.recorded_groups or "null")
        known, kept = Fingerprint(before["rest"], before["groups"]), kept_mix.live_mix(scene).transport
    except (ValueError, KeyError, TypeError, SpectralError, OSError):  # of an earlier version, or deleted
        return None
    return (known, kept) if kept.storage.channel_names() == storage_of(dial).channel_names() else None


def remember_recorded(scene: Scene, recording: Recording) -> None:
    """Store the hashes of the recording's inputs, to find later changes."""
    changes.remember_parts(scene, recording.hashes or recording.parts.hashes())
    found = recording.fingerprint
    scene.spectral.dial.named_by_object = recording.one_per_light
    scene.spectral.dial.recorded_groups = json.dumps({"rest": found.rest, "groups": found.groups})
