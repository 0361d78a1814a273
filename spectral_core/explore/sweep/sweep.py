# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep from its file to its table: opened or created, planned, extended, run, compared with its reference."""

from __future__ import annotations

import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from spectral_core.checks import require_kind
from spectral_core.errors import InvalidInputError, counted
from spectral_core.explore.sweep.designs import design_points
from spectral_core.explore.sweep.document import SweepDocument
from spectral_core.explore.sweep.files import DRIVER_LOCK, require_free
from spectral_core.explore.sweep.outcome import describe
from spectral_core.explore.sweep.parameters import Space
from spectral_core.explore.sweep.runner import SweepProgress, SweepReport, run_sweep, text_of
from spectral_core.explore.sweep.store import Store, cdb_folder
from spectral_core.explore.sweep.task import compute_point

REFERENCE_KEY = "reference"
DOCUMENT_FOLDER = "document_folder"
"""Entry of a project's environment: the folder of the sweep's file on the machine that ran it last."""


@dataclass(frozen=True, slots=True)
class SweepPlan:
    """Plan of a run, in numbers and words. ``new`` points are computed, ``reused`` are done already."""

    keys: tuple[str, ...]
    new: int
    reused: int
    lines: tuple[str, ...]
    seconds: float | None
    """Time expected with one worker, from the points done so far; None before the first."""


class Sweep:
    """A document, its compute node and its store."""

    def __init__(self, document: SweepDocument, folder: Path) -> None:
        require_kind("the sweep", document, SweepDocument, "explore.sweep.document.read_sweep(PATH)")
        self.document = document
        self.node = document.node()
        place = cdb_folder(folder)
        is_new = not (place / "project.json").is_file()
        self.store = Store.create(place, document.project(self.node.fingerprint)) if is_new else Store.open(place)
        try:
            if not is_new:
                self._keep_node()
                self._fit()
            # folder of the document's files, for a page that renders
            self.store.project.environment[DOCUMENT_FOLDER] = str(document.folder.resolve())
            self.store.save_project()
        except BaseException:
            self.store.close()
            raise

    def close(self) -> None:
        """Close the store."""
        self.store.close()

    def _keep_node(self) -> None:
        """Take the node as it was made for the stored ranges: its fingerprint may depend on them, its points do not."""
        project = self.store.project
        if self.node.fingerprint == project.fingerprint or meanings(self.document.space) != meanings(project.space):
            return
        earlier = replace(self.document, space=project.space).node()
        if earlier.fingerprint == project.fingerprint:
            self.node = earlier

    def _fit(self) -> None:
        """Adopt the document's region, budget and columns; refuse changes that would mix different rows."""
        project, document = self.store.project, self.document
        mine, theirs = meanings(document.space), meanings(project.space)
        if mine != theirs or document.seed != project.seed or self.node.fingerprint != project.fingerprint:
            what = (
                f"its parameters differ: {difference(document.space, project.space)}"
                if mine != theirs
                else "its seed differs"
                if document.seed != project.seed
                else "the computation differs, one of its files has changed, or another version of this program made it"
            )
            raise InvalidInputError(
                f"{self.store.folder} holds another sweep: {what}. Its rows do not fit; name another folder"
            )
        ranges = {
            p.name: (float(p.low), float(p.high))
            for p, old in zip(document.space.parameters, project.space.parameters, strict=True)
            if p.kind != "choice" and (p.low, p.high) != (old.low, old.high)
        }
        region = document.region
        project.region = replace(region, ranges={**ranges, **region.ranges}).checked(project.space)
        same_design = (document.design.kind, document.design.seed, document.design.rate) == (
            project.design.kind, project.design.seed, project.design.rate)  # fmt: skip
        frame = (project.design.frame, project.design.shifts) if same_design else (None, ())
        project.design = replace(document.design, frame=frame[0], shifts=frame[1]).placed(project.space)
        # A column that took the name of a value was refused, and the file may now have another name for it.
        values = {name for row in self.store.ledger.rows("done") for name in row.outcome}
        for name in values & set(project.expressions):
            del project.expressions[name]
        project.expressions.update(document.expressions)
        # Views show unit and group, and no point depends on them.
        shown = [replace(old, unit=p.unit, group=p.group)
                 for p, old in zip(document.space.parameters, project.space.parameters, strict=True)]  # fmt: skip
        project.space, project.units = Space(tuple(shown)), {p.name: p.unit for p in shown if p.unit}

    def plan(self, budget: int | None = None) -> SweepPlan:
        """Enter the points of the region and return the plan of a run."""
        project = self.store.project
        if budget is not None and project.design.kind == "list":
            raise InvalidInputError("the sweep lists its points, so a budget has no effect; add points to the list")
        if budget is not None:
            project.design = replace(project.design, budget=budget)
            self.store.save_project()
        known = self.store.known_points()
        points, notes = design_points(project.space, project.region, project.design, known=known)
        self.store.enter(points)
        keys = tuple(self.store.key(point) for point in points)
        states = self.store.ledger.states()
        reused = sum(states[key] == "done" for key in keys)
        aside = len(self.store.ledger.failed_by_themselves().intersection(keys))
        timed = [row.seconds for row in self.store.ledger.rows("done") if row.seconds is not None]
        each = sum(timed) / len(timed) if timed else None
        new = len(keys) - reused - aside
        lines = [f"{counted(len(keys), 'point')} over {', '.join(project.space.names)} ({project.design.kind})", *notes,
                 f"{new} to compute, {reused} done already", *_aside_lines(aside), *describe(self.node)]  # fmt: skip
        if budget is not None and len(keys) > budget:
            lines.append(f"the folder holds {counted(len(keys), 'point')} already, and a budget of {budget} "
                         "removes none; name another folder for fewer")  # fmt: skip
        if each is not None and new:
            lines.append(f"about {each * new:.0f} s with one worker ({each:.2f} s per point so far)")
        return SweepPlan(keys, new, reused, tuple(lines), None if each is None else each * new)

    def pending(self) -> SweepPlan:
        """The listed but missing points of the folder; none is added."""
        keys = tuple(row.key for row in self.store.ledger.rows("pending"))
        reused = len(self.store.ledger.rows("done"))
        lines = (f"{len(keys)} to compute, {reused} done already",)
        return SweepPlan(
            keys, len(keys), reused, (*lines, *_aside_lines(len(self.store.ledger.failed_by_themselves()))), None
        )

    def listed(self) -> SweepPlan:
        """All points that the folder lists; none is added."""
        rows = self.store.ledger.rows()
        new, reused, aside = (sum(row.state == state for row in rows) for state in ("pending", "done", "failed"))
        lines = (f"{counted(len(rows), 'point')}, {new} to compute, {reused} done already", *_aside_lines(aside))
        return SweepPlan(tuple(row.key for row in rows), new, reused, lines, None)

    def run(
        self,
        plan: SweepPlan,
        *,
        executor: Executor | None = None,
        workers: int = 1,
        on_progress: Callable[[SweepProgress], None] | None = None,
        should_stop: Callable[[], bool] | None = None,
        **options: Any,
    ) -> SweepReport:
        """Compute missing points, then compare with the reference if the document names one.

        Parameters
        ----------
        plan : of ``plan()``.
        executor : computes the points; ``workers`` processes that keep loaded data by default.
        workers : how many.
        on_progress, should_stop : as for ``run_sweep``.
        options : passed on to ``run_sweep``.
        """
        report = run_sweep(
            self.store, self.node, keys=plan.keys, executor=executor, workers=workers, on_progress=on_progress,
            should_stop=should_stop, **options,
        )  # fmt: skip
        if self.document.reference is not None and not report.cancelled:
            try:
                self.compare(dict(self.document.reference))
            except Exception as error:  # the swept code of a user may raise anything; the points stay
                report.not_compared = text_of(error)
        if not report.cancelled:  # the columns of a comparison come last
            wrong = self.store.not_computed
            report.not_computed = {name: wrong[name] for name in self.document.expressions if name in wrong}
            report.not_finite = self.store.not_finite(plan.keys)
        return report

    def compare(self, reference: dict[str, Any]) -> None:
        """Compute the reference point where it is missing and measure every picture against it."""
        views = self.store.project.views
        key = self.store.key(reference)
        if views.get(REFERENCE_KEY, {}).get("key") != key:
            # another seed: with the same one a picture would share part of the reference's noise
            receipt = compute_point(self.node, reference, self.store.project.seed + 1, key, None)
            for name, content in receipt.contents.items():
                from spectral_core.explore.sweep.files import write_whole

                write_whole(self.store.folder / "image" / name, content)
            views[REFERENCE_KEY] = {"key": key, "files": receipt.record["files"], "parameters": reference}
            self.store.save_project()
        compare_with_stored(self.store)


def compare_with_stored(store: Store) -> None:
    """Measure every picture against that of the reference, if it was computed. InvalidInputError without pictures."""
    from spectral_core.explore.features.compare import compare_rows

    reference = store.project.views.get(REFERENCE_KEY)
    if reference is None:
        return
    picture = reference["files"].get("FILE_linear") or reference["files"].get("FILE")
    if picture is None:
        raise InvalidInputError("the points have no picture to compare; remove [reference] from the sweep file")
    compare_rows(store, picture)
    store.write_table()


def meanings(space: Space) -> list[tuple[Any, ...]]:
    """The parameters without their ranges; folders of different ones hold different sweeps."""
    return [(p.name, p.kind, p.scale, p.choices, p.target) for p in space.parameters]


def difference(space: Space, stored: Space) -> str:
    """The first difference of the parameters to those of a folder whose ``meanings`` are others, in words."""
    for names, others, where in ((space.names, stored.names, "the folder"), (stored.names, space.names, "this sweep")):
        only = next((name for name in names if name not in others), None)
        if only is not None:
            return f"{where} has no {only!r}"
    for one in space.parameters:
        old = stored[one.name]
        for what, here, there in (
            ("kind", one.kind, old.kind), ("scale", one.scale, old.scale), ("choices", one.choices, old.choices),
            ("path", one.target, old.target),
        ):  # fmt: skip
            if here != there:
                said = (", ".join(map(str, each)) if what == "choices" else each for each in (here, there))
                return "{!r} has the {} {} here, and {} in the folder".format(one.name, what, *said)
    return f"they have another order, which is {', '.join(stored.names)} in the folder"


def _aside_lines(count: int) -> list[str]:
    if not count:
        return []
    said = counted(count, "was set aside by an earlier run and is", "were set aside by an earlier run and are")
    return [f"{said} left out; --retry tries {'it' if count == 1 else 'them'} again"]


@contextmanager
def planned_apart(document: SweepDocument, folder: Path) -> Iterator[Sweep]:
    """The sweep in a temporary folder that holds the points of ``folder``, which stays as it is: only to plan with."""
    place = cdb_folder(folder)
    with tempfile.TemporaryDirectory(prefix="sweep-plan-") as name:
        apart = Path(name) / place.name
        if (place / "project.json").is_file():
            left = shutil.ignore_patterns("image", "lease", DRIVER_LOCK, "ledger.sqlite*", "*.html", "data.csv")
            shutil.copytree(place, apart, ignore=left)
            for each in (apart, *apart.rglob("*")):  # a copy of a read-only folder is read-only
                each.chmod(each.stat().st_mode | stat.S_IWUSR)
            with Store.open(place) as store:
                store.ledger.copy_to(apart / "ledger.sqlite")
        else:
            require_free(place)
        try:
            sweep = Sweep(document, apart)
        except InvalidInputError as error:
            raise InvalidInputError(str(error).replace(str(apart), str(place))) from error
        try:
            sweep.store.recover()
            yield sweep
        finally:
            sweep.store.close()
