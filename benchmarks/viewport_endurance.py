# SPDX-License-Identifier: GPL-3.0-or-later
"""A Rendered view through random edits, undos, files, mode switches and kills: is it ever stale, does it recover?

A plane, a ball and a lamp at 96×64 in Blender without a window; the session is the one of a 3D view, with its own
render process. After each change the view has to settle (``--changes N``, 1000; ``--kills N``, 30 spread over them).
Every few changes its picture is compared with that of another process which loads the whole scene afresh, sample for
sample, and with F12 on average. ``--seed N`` repeats a run. An hour and more on two cores: new nodes compile kernels.
"""

from __future__ import annotations

import os
import signal
import tempfile
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from benchmarks import Options

OPTIONS = ("--changes", "--kills", "--seed")
WIDTH, HEIGHT, SAMPLES = 96, 64, 2
PATIENCE_S = 300.0
COMPARED_EVERY = 5
"""Changes between two comparisons with a fresh process."""
LARGEST_ERROR = 2e-3
"""Mean difference, as a share of the mean, between a view and a fresh one: their random numbers are the same."""


def run(options: Options) -> dict[str, Any]:
    """Change, settle, compare, count."""
    import bpy

    import blender_addon

    if not hasattr(bpy.types.Scene, "spectral"):
        blender_addon.register()
    from blender_addon import jobs

    changes = _number(options, "--changes", 12 if options.quick else 1000)
    kills = _number(options, "--kills", 2 if options.quick else 30)
    seed = _number(options, "--seed", int.from_bytes(os.urandom(3), "little"))
    print(f"seed {seed}, {changes} changes, {kills} kills")
    with tempfile.TemporaryDirectory() as folder:
        trial = Trial(np.random.default_rng(seed), Path(folder))
        try:
            killed = set(np.linspace(1, changes - 1, kills).astype(int).tolist())
            for number in range(changes):
                trial.change(number, kill=number in killed)
        finally:
            trial.close()
            jobs.live().close()
    figures = trial.figures()
    for name, value in figures.items():
        print(f"{name}: {value}")
    return figures


class Trial:
    """One run: the view, a process that loads afresh, and what was counted."""

    def __init__(self, rng: np.random.Generator, folder: Path) -> None:
        from benchmarks._random_edits import EDITS
        from spectral_core.render.live.link import LiveLink

        self.rng, self.folder, self.fresh = rng, folder, LiveLink()
        self.kinds: dict[str, Any] = dict(EDITS)
        self.kinds |= {"undo": self._undo, "file": self._file, "mode": self._mode}
        self.counts: Counter[str] = Counter()
        self.wrong: list[str] = []
        self.memory: list[int] = []
        self.compared, self.dark, self.errors = 0, 0, [0.0]
        self.session: Any = None
        start()
        self.new_view()

    def new_view(self) -> None:
        """What Blender does where a 3D view is switched to Rendered mode."""
        from blender_addon.editing.viewport.session import ViewSession

        if self.session is not None:
            self.session.leave()
        self.session, self.context = ViewSession(lambda: None), context()

    def _undo(self, _rng: np.random.Generator) -> None:
        import bpy

        from benchmarks._random_edits import EDITS

        bpy.ops.ed.undo_push(message="before")
        EDITS["move"](self.rng)
        bpy.ops.ed.undo_push(message="moved")
        bpy.ops.ed.undo()

    def _file(self, _rng: np.random.Generator) -> None:
        import bpy

        path = str(self.folder / "scene.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.new_view()

    def _mode(self, _rng: np.random.Generator) -> None:
        self.new_view()

    def change(self, number: int, *, kill: bool) -> None:
        """One change of a random kind; the view settles, and is compared where it is its turn."""
        import bpy

        from blender_addon import jobs

        name = str(self.rng.choice(list(self.kinds)))
        self.counts[name] += 1
        try:
            followed(lambda: self.session, self.context, lambda: self.kinds[name](self.rng))
        except RuntimeError as error:  # an operator that cannot be called without a window
            self.counts[f"{name} (refused: {str(error).strip().splitlines()[-1]})"] += 1
        process = jobs.live().process_id
        self.session.look(self.context, bpy.context.view_layer.depsgraph)
        if kill and process is not None:
            os.kill(process, signal.SIGKILL)
            self.counts["killed"] += 1
        shown = self._settled()
        if shown is None:
            self.wrong.append(f"{number} {name}: no picture within {PATIENCE_S:g} s")
            return
        self.memory.append(shown.frame.memory)
        if number % COMPARED_EVERY == 0 or kill:
            self._compare(f"{number} {name}", shown)

    def _settled(self) -> Any:
        """The finished picture of the view's present request; None if it does not come."""
        import bpy

        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            picture = self.session.look(self.context, bpy.context.view_layer.depsgraph)[0]
            if picture.is_current and picture.shown is not None and picture.shown.frame.is_done:
                return picture.shown
            time.sleep(0.01)
        return None

    def _compare(self, what: str, shown: Any) -> None:
        """With a process that knows nothing of what was before, given a whole translation."""
        import bpy

        from blender_addon.translate.scene import translate_scene
        from spectral_core.render.live.view import ViewRequest
        from spectral_core.scene import Camera

        depsgraph = bpy.context.evaluated_depsgraph_get()
        known = next(iter(self.session.link._scenes.values()))
        true = translate_scene(depsgraph, film=known.film, seen_from=Camera(world_from_camera=np.eye(4)))
        stage = f"fresh {what}"
        self.fresh.show(stage, true)
        viewpoint = self.session._sides[0].viewpoint
        request = ViewRequest(stage, viewpoint, WIDTH, HEIGHT, SAMPLES, 0)
        generation = self.fresh.look(stage, request, lambda: None)
        end, found = time.monotonic() + PATIENCE_S, None
        while found is None and time.monotonic() < end:
            self.fresh.wait(stage, generation, 1.0)
            latest = self.fresh.latest(stage)
            found = latest if latest is not None and latest.frame.is_done else None
        self.fresh.drop(stage)
        if found is None:
            self.wrong.append(f"{what}: the fresh process shows nothing: {self.fresh.trouble(stage)}")
            return
        self.compared += 1
        self.dark += not found.pixels[..., :3].any()
        size = max(float(np.abs(found.pixels[..., :3]).mean()), 1e-3)
        error = float(np.abs(found.pixels - shown.pixels).mean()) / size
        self.errors.append(error)
        if error > LARGEST_ERROR:
            self.wrong.append(f"{what}: differs from a fresh view by {error:.1e} of its mean")

    def figures(self) -> dict[str, Any]:
        """What was found."""
        link, memory = self.session.link, np.array(self.memory or [0]) / 1e6
        return {
            "changes": sum(self.counts[name] for name in self.kinds),
            "kinds": dict(sorted(self.counts.items())),
            "kills": self.counts["killed"],
            "restarts": link.restarts,
            "compared": self.compared,
            "compared_in_the_dark": self.dark,
            "worst_error": max(self.errors),
            "first_memory_mb": float(memory[0]),
            "most_memory_mb": float(memory.max()),
            "wrong": self.wrong,
            "holds": {
                "no picture is stale and none is missing": not self.wrong,
                "every kill is recovered from": link.restarts >= self.counts["killed"],
                "memory is bounded": float(memory.max()) <= 3 * float(memory[0]) + 1000,
            },
        }

    def close(self) -> None:
        """End the processes."""
        self.session.leave()
        self.fresh.close()


def _number(options: Options, name: str, usual: int) -> int:
    return int(options.extra[options.extra.index(name) + 1]) if name in options.extra else usual


def start() -> None:
    """Plane, ball and lamp."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.spectral.viewport.samples = SAMPLES
    material = bpy.data.materials.new("Paint")
    if material.node_tree is None:
        material.use_nodes = True
    bpy.ops.mesh.primitive_plane_add(size=6)
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 1), segments=12, ring_count=8)
    bpy.context.object.data.materials.append(material)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location, lamp.data.energy = (2, -2, 4), 300.0
    scene.collection.objects.link(lamp)


def context() -> Any:
    """A 3D view as the session sees one, from above."""
    projection = np.diag([1.2, 1.8, -1.0, 0.0])
    projection[3, 2] = -1.0
    placed = np.eye(4)
    placed[2, 3] = 12.0
    region = SimpleNamespace(
        window_matrix=projection, view_matrix=np.linalg.inv(placed), is_perspective=True, view_perspective="PERSP"
    )
    space = SimpleNamespace(
        local_view=None,
        use_local_collections=False,
        camera=None,
        use_local_camera=False,
        clip_start=0.1,
        clip_end=100.0,
    )
    return SimpleNamespace(space_data=space, region=SimpleNamespace(width=WIDTH, height=HEIGHT), region_data=region)


def followed(session: Any, seen: Any, edit: Any) -> None:
    """What Blender does after an edit: its handlers see the same list of updates as the view of an engine."""
    import bpy

    def follow(_scene: Any, depsgraph: Any) -> None:
        session().update(seen, depsgraph)

    def lists() -> tuple[Any, Any]:
        return bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post

    for handlers in lists():
        handlers.append(follow)
    try:
        edit()
        bpy.context.view_layer.update()
    finally:
        for handlers in lists():
            if follow in handlers:  # a file that was opened takes them away
                handlers.remove(follow)
    session().update(seen, bpy.context.view_layer.depsgraph)
