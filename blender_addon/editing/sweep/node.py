# SPDX-License-Identifier: GPL-3.0-or-later
"""A .blend file as a compute node: properties by their full data paths are set, the scene is translated and rendered.

A worker opens the file once and keeps it open. The node's fingerprint is that of the translated scene in a few places
of the ranges of its swept properties, so that it does not change if the file is saved again, or if a point is applied
to it. At the start of the ranges alone a lamp may be dark and an object hidden, and their changes would be unnoticed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from spectral_core.errors import FileFormatError, InvalidInputError, RenderError, SpectralError
from spectral_core.explore.sweep.compute.paths import require_set_once
from spectral_core.explore.sweep.compute.rendering import Relighter, not_linear, recording_mark, rendered, under_look
from spectral_core.explore.sweep.document import entries
from spectral_core.explore.sweep.effects import places, remembered, without_effect
from spectral_core.explore.sweep.outcome import Outcome
from spectral_core.explore.sweep.parameters import Space, Value
from spectral_core.files.guarded import is_file, no_file
from spectral_core.scene import Film, Scene, scene_hash
from spectral_core.spectra.pictures import png_bytes

from ...properties.render import ENGINE
from ...translate.display.transform import PLAIN_VIEW, shown_pixels, view_name
from ..background import worker_command, worker_prelude
from ..board.paths import block_at
from ..dial.rendered_parts import look_matrix
from ..libraries import library_notes
from .settings import follow_palette, is_of_palette, setting_at
from .stays import where_it_stays

PACKAGE = __package__.rsplit(".", 2)[0]
LIGHT_PATH, LOOK_PATH = "bpy.data.lights[", ".spectral.viewport.look."
SAMPLES_PATH, SEED_PATH = ".spectral.render.samples", ".spectral.render.seed"
SIZE_PATH = ".render.resolution_percentage"
GOAL_PATHS = (".spectral.render.goal", ".spectral.render.target_error", ".spectral.render.time_budget")

_MOST = {"percentage": 32767, "samples": 16777216}
"""Entries of ``[compute]`` that are whole numbers, and their largest values."""
_file_of: list[dict[str, Any]] = []
"""What is kept by the node that has opened the file and changed its settings last, such as of another sweep."""


@dataclass(frozen=True)
class BlendNode:
    """Renders a .blend file with some of its properties set.

    ``file``: the file. ``paths``: full data path by parameter. ``percentage`` and ``samples``: replace the file's
    output size and samples, None for those of the file. ``scene_name``: of the scene, "" for the one that the file
    opens with. ``of_scene``: those of the paths that are settings of this scene. ``command``: of a worker.
    ``not_linear``: why no point can be re-lit, "" if points can. ``notes``: lines on what is rendered in another way
    than the file states or is missing, and on settings that change nothing.
    """

    file: str
    paths: tuple[tuple[str, str], ...]
    percentage: int | None = None
    samples: int | None = None
    scene_name: str = ""
    of_scene: tuple[str, ...] = ()
    command: tuple[str, ...] = ()
    not_linear: str = ""
    notes: tuple[str, ...] = ()
    fingerprint: str = ""
    _kept: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def of(
        cls, file: Path, space: Space, *, percentage: int | None = None, samples: int | None = None, scene: str = ""
    ) -> BlendNode:  # fmt: skip
        """The node of a file; every path is checked in it.

        Parameters
        ----------
        file : the .blend file.
        space : the parameters; their targets are full data paths, as Copy Full Data Path gives them.
        percentage : size of the pictures in percent of the file's.
        samples : light paths per pixel.
        scene : name of the scene; the one that the file opens with if empty.
        """
        paths = tuple((parameter.name, parameter.target) for parameter in space.parameters)
        require_set_once((f"the parameter {name}", path) for name, path in paths)
        node = cls(str(file.resolve()), paths, percentage, samples, scene, command=worker_command())
        node._open()
        lacking = tuple(f"note: {each}" for each in library_notes())
        node = replace(node, of_scene=tuple(path for _, path in paths if block_at(path)[0] == bpy.context.scene))
        for parameter in space.parameters:
            setting = setting_at(parameter.target)
            setting.require_kind(parameter.kind)
            for choice in parameter.choices:
                setting.checked(choice)
        start = {parameter.name: parameter.value(0.0) for parameter in space.parameters}
        made = node.scene(start, 0)
        view = view_name(bpy.context.scene)
        print_, node = scene_hash(made), replace(node, not_linear=not_linear(made))
        mark = recording_mark(made) if node.relights else ""
        look, sweeps_look = look_matrix(bpy.context.scene), any(LOOK_PATH in path for _, path in paths)
        if sweeps_look or not np.array_equal(look, np.eye(3)):  # else as in earlier versions
            mark += f"{look.tolist()}"
        said = f"{print_}{paths!r}{node.relights}{'' if view == PLAIN_VIEW else view}{mark}"
        told = tuple(f"note: {note.subject}: {note.message}" for note in made.notes)
        state = remembered(node._state)
        if not any(is_of_palette(path) for _, path in paths):  # whose spectra may differ from solve to solve
            said += str([found if isinstance(found := state(point), tuple) else "" for point in places(space)])
        node = replace(node, notes=lacking + told + _notes(space, state))
        return replace(node, fingerprint=hashlib.sha256(said.encode()).hexdigest())

    def _state(self, values: Mapping[str, Value]) -> Hashable:
        """Equal for points with equal pictures; no tuple if a point cannot be rendered."""
        try:
            made = scene_hash(self.scene(values, 0))
            return made, view_name(bpy.context.scene), look_matrix(bpy.context.scene).tobytes()
        except SpectralError:  # the run names the points that cannot be rendered
            return object()

    @property
    def relights(self) -> bool:
        """True if only energies of lights are swept, so that points are re-lit instead of rendered."""
        return not self.not_linear and self._sweeps_energies

    @property
    def _sweeps_energies(self) -> bool:
        return all(path.startswith(LIGHT_PATH) and path.endswith(".energy") for _, path in self.paths)

    def worker_command(self) -> list[str]:
        """Command of a process with this Blender."""
        return list(self.command)

    @property
    def worker_prelude(self) -> str:
        """Code that a worker runs first."""
        return worker_prelude(self.command)

    def __call__(self, parameters: Mapping[str, Value], seed: int) -> Outcome:
        scene = self.scene(parameters, seed)
        if self.relights:
            relighter: Relighter = self._kept.setdefault("relighter", Relighter())
            outcome = relighter.picture(scene)
        else:
            outcome = rendered(scene)
        outcome = under_look(outcome, look_matrix(bpy.context.scene))
        if view_name(bpy.context.scene) == PLAIN_VIEW:
            return outcome
        levels = np.round(255 * shown_pixels(bpy.context.scene, outcome.pictures[""][..., :3])).astype(np.uint8)
        return replace(outcome, shown={"": png_bytes(levels)})

    def scene(self, parameters: Mapping[str, Value], seed: int) -> Scene:
        """The file's scene at a point."""
        self._open()
        settings = [setting_at(path) for _, path in self.paths]
        for (name, _), setting in zip(self.paths, settings, strict=True):
            setting.write(parameters[name])
        follow_palette(path for _, path in self.paths)
        # as a render does: Blender evaluates keyframes only when the frame is set
        stage = bpy.context.scene
        stage.frame_set(stage.frame_current, subframe=stage.frame_subframe)
        bpy.context.view_layer.update()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for (name, _), setting in zip(self.paths, settings, strict=True):
            setting.require_taken(depsgraph, parameters[name])
        scene = self._translated()
        film: Film = scene.film if self._sweeps(SEED_PATH) else replace(scene.film, seed=seed)
        if self.samples is None or any(self._sweeps(path) for path in (SAMPLES_PATH, *GOAL_PATHS)):
            return replace(scene, film=film)
        # these samples, also of a file whose renders end at an error or a time
        ends = replace(scene.settings, target_error=None, time_budget_s=None)
        return replace(scene, film=replace(film, samples=self.samples), settings=ends)

    def _translated(self) -> Scene:
        """The scene as F12 renders it, which the viewport may not show: objects, levels of modifiers, motion blur."""
        from ..dial.as_rendered import translated_at_once

        try:
            scene = translated_at_once(bpy.context.scene)
        except RuntimeError as error:
            raise RenderError(f"Blender did not render the point: {str(error).strip()}") from error
        return replace(scene, settings=replace(scene.settings, passes=None))  # none is stored

    def _sweeps(self, ending: str) -> bool:
        """True if a render setting of the scene is swept, which the sweep's own setting then does not replace."""
        return any(path.endswith(ending) for path in self.of_scene)

    def _open(self) -> None:
        # another node of this process may have opened the same file since, and have set what this one does not set
        is_own = bool(_file_of) and _file_of[0] is self._kept
        if is_own and self._kept.get("open") == self.file and bpy.data.filepath == self.file:
            return
        _file_of.clear()
        import_module(PACKAGE).register_once()
        if not is_file(self.file):
            raise InvalidInputError(no_file(self.file))
        try:
            bpy.ops.wm.open_mainfile(filepath=self.file, load_ui=False)
        except RuntimeError as error:
            raise FileFormatError(f"{Path(self.file).name} cannot be opened: {str(error).strip()}") from error
        if self.scene_name:
            self._show_scene()
        bpy.context.scene.render.engine = ENGINE
        if self.percentage is not None:  # each point sets a swept size anew
            bpy.context.scene.render.resolution_percentage = self.percentage
        self._kept["open"] = self.file
        _file_of.append(self._kept)

    def _show_scene(self) -> None:
        """Make the scene that of the context: a file opens with the scene of its first window."""
        found = bpy.data.scenes.get(self.scene_name)
        if found is None:
            known = ", ".join(each.name for each in bpy.data.scenes)
            raise InvalidInputError(f"{Path(self.file).name} has no scene {self.scene_name!r}; it has {known}")
        bpy.context.window.scene = found

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": {}}

    def describe(self) -> list[str]:
        """Lines of the plan."""
        lines = ["each worker keeps the file open and the renderer warm"]
        if self.samples is not None and self._sweeps(SAMPLES_PATH):
            lines.append(f"samples are swept, so the {self.samples} of the sweep are not used")
        if self.percentage is not None and self._sweeps(SIZE_PATH):
            lines.append(f"the size is swept, so the {self.percentage} % of the sweep are not used")
        if self.relights:
            lines.append("only energies of lights are swept: a worker records them once and re-lights each point")
        elif self._sweeps_energies:
            lines.append(f"every point is rendered: {self.not_linear}")
        elif any(path.startswith(LIGHT_PATH) for _, path in self.paths):
            lines.append("lights are swept together with other properties, so every point is rendered")
        return [*lines, *self.notes]


def _notes(space: Space, state: Callable[[dict[str, Value]], Hashable]) -> tuple[str, ...]:
    """Notes on settings that change no picture, or not over their whole range.

    Raises InvalidInputError if a constraint keeps an object where it is.
    """
    notes = list(filter(None, map(where_it_stays, space.parameters)))
    for parameter in without_effect(space, state):
        notes.append(
            f"note: no picture changes with {parameter.name!r} ({parameter.target}), as far as some of its values "
            "tell; what it belongs to may be hidden, unused, of another scene, or not rendered in a sweep"
        )
    return tuple(notes)


def blend_node(table: dict[str, Any], space: Space, folder: Path) -> BlendNode:
    """The node of a document's ``[compute] kind = "blend"``."""
    name, scene = entries(table, "blend", "blend", (*_MOST, "scene")), table.get("scene", "")
    if not isinstance(scene, str):
        raise InvalidInputError(f"[compute] has scene = {scene!r}; expected the name of a scene of the file")
    for setting, most in _MOST.items():
        value = table.get(setting, 1)
        if type(value) is not int or not 1 <= value <= most:
            raise InvalidInputError(f"[compute] has {setting} = {value!r}; expected a whole number from 1 to {most}")
    return BlendNode.of(
        folder / name, space, percentage=table.get("percentage"), samples=table.get("samples"), scene=scene
    )
