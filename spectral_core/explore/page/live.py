# SPDX-License-Identifier: GPL-3.0-or-later
"""The actions of the live page: sample, refine, render, derive, measure, label and apply, on an open store."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

from spectral_core.checks import require_whole
from spectral_core.errors import InvalidInputError, SpectralError, counted
from spectral_core.explore.sweep.document import compute_node
from spectral_core.explore.sweep.region import RegionOfInterest
from spectral_core.explore.sweep.store import Store, not_finite_note
from spectral_core.explore.sweep.sweep import compare_with_stored

MAX_SAMPLE = 10_000
Action = Callable[[Mapping[str, Any]], dict[str, Any]]


class LiveSweep:
    """Actions of the page on a sweep.

    Parameters
    ----------
    store : the open store.
    folder : where the sweep's file lies, for the compute node; None if points cannot be computed.
    workers : processes for renders.
    apply : called with the parameters of a point, to set the open scene to it; None if there is none.
    render : computes missing points and returns a message; None: child processes compute them.
    """

    def __init__(
        self,
        store: Store,
        folder: Any = None,
        *,
        workers: int = 1,
        apply: Callable[[Mapping[str, Any]], None] | None = None,
        render: Callable[[], str] | None = None,
    ) -> None:
        self.store, self.folder = store, folder
        self.workers = require_whole("the number of workers", workers, 1, 1024)
        self._apply, self._render = apply, render
        self._busy = threading.Lock()
        self._status = ""
        self._background = ThreadPoolExecutor(1)
        self._stops = threading.Event()

    def close(self) -> None:
        """Stop a run in the background, whose table is then written; the store can be closed after that."""
        self._stops.set()
        self._background.shutdown()

    @property
    def actions(self) -> dict[str, Action]:
        """Actions by name."""
        return {
            name: getattr(self, name)
            for name in ("sample", "refine", "render", "derive", "distance", "label", "apply", "status")
        }

    def sample(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Add points to a part of the sweep's region, whose constraints hold there, too."""
        region = RegionOfInterest.from_dict(dict(content.get("region") or {}))
        budget = content.get("budget")
        if isinstance(budget, bool) or not isinstance(budget, int) or not 1 <= budget <= MAX_SAMPLE:
            raise InvalidInputError(f"the number of points is {budget!r}; expected 1 to {MAX_SAMPLE}")
        project = self.store.project
        region = region.limited_as(project.region).checked(project.space)
        return self._add(region, self._count(region) + budget)

    def refine(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Twice as many points in the sweep's region."""
        budget = 2 * max(self.store.project.design.budget, self._count(self.store.project.region))
        answer = self._add(self.store.project.region, budget)
        project = self.store.project  # another request may have read it again meanwhile
        project.design = replace(project.design, budget=budget)
        self.store.save_project()
        return answer

    def _count(self, region: RegionOfInterest) -> int:
        """Points that lie in a region."""
        return sum(map(region.membership(self.store.project.space), self.store.known_points()))

    def _add(self, region: RegionOfInterest, budget: int) -> dict[str, Any]:
        from spectral_core.explore.sweep.designs import design_points

        project = self.store.project
        if project.design.kind == "list":
            raise InvalidInputError("this sweep lists its points; add points to the list in its file")
        design = replace(project.design, budget=budget)
        points, notes = design_points(project.space, region, design, known=self.store.known_points())
        new = self.store.enter(points)
        return {
            "message": "; ".join([f"{counted(new, 'point')} added; press Render to compute them", *notes]),
            "new": new,
        }

    def render(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Compute missing points in the background."""
        from spectral_core.explore.sweep.runner import run_sweep

        if self._render is not None:
            return {"message": self._render()}
        if self.folder is None:
            raise InvalidInputError("this sweep cannot be computed here; run it with spectral-scene sweep")
        node = compute_node(self.store.project.compute, self.store.project.space, self.folder)
        if not self._busy.acquire(blocking=False):
            raise InvalidInputError(f"a run is in progress: {self._status}")

        def work() -> None:
            try:
                report = run_sweep(
                    self.store, node, workers=self.workers, on_progress=self._note, should_stop=self._stops.is_set
                )
                lacking = "" if report.cancelled else self._not_compared()
                self._status = (
                    f"{report.computed} computed, {len(report.failures)} set aside; reload to see them{lacking}"
                )
            except Exception as error:
                self._status = f"the run failed: {error}"
            finally:
                self._busy.release()

        self._status = "started"
        self._background.submit(work)
        return {"message": "computing in the background; reload the page to see new points"}

    def _not_compared(self) -> str:
        """Compare all points with the reference of the sweep; returns why not, "" if they were or there is none."""
        try:
            compare_with_stored(self.store)
        except (SpectralError, OSError) as error:
            return f"; not compared with the reference: {error}"
        return ""

    def _note(self, progress: Any) -> None:
        self._status = f"{progress.done} of {progress.total} done"

    def derive(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Add a column."""
        name = str(content.get("name", ""))
        column = self.store.derive(name, str(content.get("expression", "")))
        self.store.write_table()
        if None in column:  # without a reload, which would take the message away
            note = not_finite_note(name, column.count(None), len(column))
            return {"message": f"column added; {note}. Reload the page to see it"}
        return {"message": "column added", "reload": True}

    def distance(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Add the column of distances to a row."""
        from spectral_core.explore.analysis.steps import add_distance

        weights, p = content.get("weights"), content.get("p", 2)
        if not isinstance(weights, dict) or isinstance(p, bool) or not isinstance(p, int | float | str):
            raise InvalidInputError("a distance needs weights, a mapping from columns to numbers, and a number p")
        name = str(content.get("name", "distance"))
        count = add_distance(self.store, str(content.get("key", "")), weights, float(p), name)
        self.store.write_table()
        return {"message": f"{counted(count, 'row')} measured: column {name}", "reload": True}

    def label(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Set a manual column."""
        values = content.get("values")
        if not isinstance(values, dict):
            raise InvalidInputError("labels are a mapping from rows to texts")
        self.store.label(str(content.get("name", "")), values)
        self.store.write_table()
        return {"message": f"{counted(len(values), 'row')} labeled"}

    def apply(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Set the open scene to a point."""
        if self._apply is None:
            raise InvalidInputError("no scene is open here; serve the page from Blender's Sweep panel")
        rows = {row.key: row for row in self.store.ledger.rows()}
        key = content.get("key")
        if key not in rows:
            raise InvalidInputError("the sweep has no such row")
        self._apply(rows[key].parameters)
        return {"message": "the scene is set to this point"}

    def status(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Progress of the run in the background."""
        return {"message": self._status or "nothing runs"}
