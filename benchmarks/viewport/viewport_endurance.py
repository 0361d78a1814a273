# SPDX-License-Identifier: GPL-3.0-or-later
"""A Rendered view through random edits, undos, files, mode switches and kills: outdated pictures, and recovery.

A plane, a ball and a lamp at 96×64 in Blender without a window; the session is the one of a 3D view, with its own
render process. After each change the view has to settle (``--changes N``, 1000; ``--kills N``, 30 spread over them).
Changes are deletes, renames, new objects, materials and nodes, numbers, meshes, drivers and keys, rigs, shape keys,
layers, linked data, images, an undo or redo of any of them, another file or the same one loaded, data appended, the
mode switched, the camera turned, a wanted color dragged; some come while another one is still being translated. Every
few changes the picture is compared with that of another process which loads the whole scene afresh, sample for sample.
``--kill-each N`` instead kills the process N times during each type of change that is limited in time (``--only A,B``:
these), at a random moment. ``--minutes N`` ends a run earlier, ``--seed N`` repeats one. Hours on two cores: new nodes
compile kernels.
"""

from __future__ import annotations

import os
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.viewport.checks.fresh import PATIENCE_S, FreshView
from benchmarks.viewport.edits.session import TIMED, context, followed, kinds_of, start
from spectral_core.errors import UnknownNameError

OPTIONS = ("--changes N", "--kills N", "--kill-each N", "--only NAMES", "--minutes N", "--seed N", "--every N")
COMPARED_EVERY = 5
"""Changes between two comparisons with a fresh process, unless ``--every`` says otherwise."""
TOLD_EVERY = 25
"""Changes between two lines on the progress."""
LATEST_KILL_S = 0.6
"""A process is killed so long after the change at most: while it loads, records or traces."""
HURRIED = 0.3
"""Share of changes that come while the view still translates another one."""


def run(options: Options) -> dict[str, Any]:
    """Change, settle, compare, count."""
    import blender_addon

    blender_addon.register_once()
    from blender_addon import jobs

    changes = options.whole("--changes", 12 if options.quick else 1000)
    kills = options.whole("--kills", 2 if options.quick else 30)
    seed, each = options.whole("--seed", int.from_bytes(os.urandom(3), "little")), options.whole("--kill-each", 0)
    end = time.monotonic() + 60 * options.whole("--minutes", 10_000)
    print(f"seed {seed}, {changes} changes, {kills} kills" if not each else f"seed {seed}, {each} kills of each kind")
    with tempfile.TemporaryDirectory() as folder:
        trial = Trial(np.random.default_rng(seed), Path(folder), options.out / "viewport-endurance")
        try:
            trial.every = options.whole("--every", COMPARED_EVERY)
            trial.chosen = _only(options, trial.kinds, trial.kinds)
            killed = set(np.linspace(1, changes - 1, kills).astype(int).tolist())
            planned: list[tuple[str, bool]] = [("", number in killed) for number in range(changes)]
            if each:
                planned = [(name, True) for _ in range(each) for name in _only(options, trial.kinds, TIMED)]
            for number, (name, kill) in enumerate(planned):
                if time.monotonic() < end:
                    trial.change(number, name, kill=kill)
                    if number % TOLD_EVERY == TOLD_EVERY - 1:
                        print(f"{number + 1} changes, {trial.compared} pictures compared", flush=True)
        finally:
            trial.close()
            jobs.live().close()
    figures = trial.figures()
    for name, value in figures.items():
        print(f"{name}: {value}")
    return figures


class Trial:
    """One run: the view, a process that loads each scene anew, and the counts."""

    def __init__(self, rng: np.random.Generator, folder: Path, faults: Path) -> None:
        self.rng, self.folder, self.faults, self.fresh = rng, folder, faults, FreshView()
        self.counts: Counter[str] = Counter()
        self.wrong: list[str] = []
        self.memory: list[int] = []
        self.compared, self.repeated, self.dark, self.errors = 0, 0, 0, [0.0]
        self.session: Any = None
        start(folder)
        self.kinds = kinds_of(self)
        self.every, self.chosen = COMPARED_EVERY, tuple(self.kinds)
        self.made: list[str] = []
        """The types of all changes, in their order."""
        self.new_view()

    def new_view(self) -> None:
        """The calls that Blender makes when a 3D view is switched to Rendered mode."""
        from blender_addon.editing.viewport.session import ViewSession

        if self.session is not None:
            self.session.leave()
        self.session, self.context = ViewSession(lambda: None), context()

    def change(self, number: int, name: str = "", *, kill: bool) -> None:
        """One change of a kind (a random one by default); the view settles, and is compared where it is its turn."""
        import bpy

        from blender_addon import jobs

        name = name or str(self.rng.choice(self.chosen))
        if not kill and self.rng.random() < HURRIED:
            self._hurry()
        self._make(name)
        process = jobs.live().process_id
        self.session.look(self.context, bpy.context.view_layer.depsgraph)
        if kill and process is not None:
            time.sleep(float(self.rng.uniform(0.0, LATEST_KILL_S)))
            os.kill(process, signal.SIGKILL)
            self.counts["killed"] += 1
        shown = self._settled()
        if shown is None:
            self._found(f"{number} {name}: no picture within {PATIENCE_S:g} s")
            return
        self.memory.append(shown.frame.memory)
        if number % self.every == 0 or kill:
            self._compare(f"{number} {name}", shown)

    def _make(self, name: str) -> None:
        self.counts[name] += 1
        self.made.append(name)
        try:
            followed(lambda: self.session, self.context, lambda: self.kinds[name](self.rng))
        except RuntimeError as error:  # an operator that cannot be called without a window
            self.counts[f"{name} (refused: {str(error).strip().splitlines()[-1]})"] += 1

    def _hurry(self) -> None:
        """A change of which a few parts are translated, each in a redraw of its own, before the next change comes."""
        import bpy

        from blender_addon.editing.viewport import session as sessions

        usual, sessions.UPDATE_S = sessions.UPDATE_S, -1.0
        try:
            self._make(str(self.rng.choice(self.chosen)))
            for _ in range(int(self.rng.integers(8))):
                self.session.look(self.context, bpy.context.view_layer.depsgraph)
            self.counts["interrupted"] += self.session._is_unfinished
        finally:
            sessions.UPDATE_S = usual

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
        found = self.fresh.compared(self.session, shown, what)
        self.compared += 1
        self.repeated += found.repeated
        self.dark += found.is_dark
        self.errors.append(found.error)
        if found.trouble:
            self._found(f"{what}: {found.trouble}")
            if found.evidence is not None:
                found.keep(self.faults, what, self.made)

    def _found(self, what: str) -> None:
        """Note a fault; it is printed at once, as a run takes long."""
        self.wrong.append(what)
        print("wrong:", what, flush=True)

    def figures(self) -> dict[str, Any]:
        """The results."""
        link, memory = self.session.link, np.array(self.memory or [0]) / 1e6
        return {
            "changes": sum(self.counts[name] for name in self.kinds),
            "kinds_tried": sum(self.counts[name] > 0 for name in self.kinds),
            "kinds": dict(sorted(self.counts.items())),
            "kills": self.counts["killed"],
            "interrupted": self.counts["interrupted"],
            "restarts": link.restarts,
            "compared": self.compared,
            "compared_with_more_samples": self.repeated,
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


def _only(options: Options, known: Iterable[str], usual: Iterable[str]) -> tuple[str, ...]:
    """The types of change that are made or killed."""
    chosen = tuple(options.word("--only", ",".join(usual)).split(","))
    for name in chosen:
        if name not in known:
            raise UnknownNameError.among("type of change", name, known)
    return chosen
