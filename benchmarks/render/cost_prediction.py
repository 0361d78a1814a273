# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicted against true time and error: a plain render, a requested error, a requested time, on 16 different scenes.

True errors are mean ΔE2000 over about 2048 pixels in groups of neighbors, against a picture with other random numbers
and all effects of at least ΔE 0.001, traced until its own noise is a third of the error; that noise is subtracted in
quadrature. Half of the groups are drawn evenly, half by the error of a few samples, and weighted accordingly: 2 % of
the pixels, at edges, may have two thirds of the error. Times are compared in seconds of the processor (work), which
other programs on the machine change little; those on the wall are printed beside. A time budget counts on the wall.
Two samples for each pixel are the least: a scene that is better than requested after them is asked for a quarter of
what it then has, too. ``--only WORDS``: scenes of these names, or whose name has the word, separated by commas.
``--more``: twelve others (hair, a bottle, fog, blur, many lamps). ``--strange``: ten of a third kind (a tiny sun, lace,
nested glass, thick fog). ``--unseen``: six with which no constant of the predictions was chosen. ``--fresh``: ten that
were built after the predictions. ``--foreign``: twelve that were built later, unlike all these. ``--budget S``: seconds
of the time budget, 10 without it. ``--brief``: one prediction and one render of each, against references of up to 2,048
samples at 1,024 pixels.

The rows are those of the table in docs/plan_and_cost.md. Bold figures are off by more than 25 %, or by more than 10 %
where a time is requested, or beyond 0.7 to 1.1 of a requested error. ≥ is a prediction that says of itself that it is
a lower bound.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks.render.cases.cost_foreign import FOREIGN, foreign_scene
from benchmarks.render.cases.cost_fresh import FRESH, fresh_scene
from benchmarks.render.cases.cost_scenes import MORE, scene_of
from benchmarks.render.cases.cost_strange import STRANGE
from benchmarks.render.cases.cost_unseen import UNSEEN
from benchmarks.render.cases.plan_scenes import SINGLE, staged
from spectral_core.render import RenderResult, cost_curve, render_scene
from spectral_core.render.cost.errors import expected_errors, pixel_errors
from spectral_core.render.cost.resample import POOL, pools
from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.scene import Scene
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

OPTIONS = ("--only NAMES…", "--more", "--strange", "--unseen", "--fresh", "--foreign", "--budget S", "--brief")
NAMES = (
    "room", "wall", "sodium", "fluorescent", "measured paints", "lens", "sky", "sky image", "emissive", "curtain",
    "ball lamp", "lamp before lamp", "mirror", "mirror caustic", "glass caustic", "leaf",
)  # fmt: skip
ASKED, FINER = 1.0, 0.25
"""The requested ΔE2000; and, as a part of what the fewest samples reach, the request where they reach more."""
REACHED, NEAR, FAR, KEPT = (0.7, 1.1), 1.25, 2.0, 0.1
"""Limits: reached over requested error, ratio of prediction and outcome in most and in all scenes, time budget."""
COMPARED, LOOKED = 2048, 4
"""Pixels whose true error is found; samples of each half by whose error some of them are drawn."""
NOISE_SHARE = 0.35
"""Largest noise of the converged picture, as a part of the error that is compared with it."""
FINEST = 1 << 15
"""Most samples of a reference that is noisier than what is compared with it."""
_CERTAIN = 1e-3
"""Effects that are bounded by less than this ΔE are not in the converged picture: a medium of depth 1e-8 moves the
borders of shadows by more, through the offsets of rays at its own border."""
REPEATS, SHORT_S = 3, 3.0
"""Times are medians of as many predictions and renders in turn: other programs change processor time, too.
Renders of more than ``SHORT_S`` are not repeated."""


@dataclass(frozen=True)
class Effort:
    """Most samples of references, their pixels, and how often predictions and renders are timed."""

    most: int = FINEST
    compared: int = COMPARED
    repeats: int = REPEATS


def run(options: Options) -> dict[str, Any]:
    """Print the table and return it."""
    size, samples, most, budget = ((24, 18), 8, 128, 4.0) if options.quick else ((128, 96), 64, FINEST, 10.0)
    budget, options = options.number("--budget", budget)
    effort = Effort(most=most)
    if "--brief" in options.extra:
        options = replace(options, extra=[word for word in options.extra if word != "--brief"])
        effort = Effort(most=min(most, 2048), compared=1024, repeats=1)
    names = _chosen(options)[: 2 if options.quick else None]
    rows = {}
    print(f"load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print("\n".join(_head(budget)))
    for name in names:
        scene = _scene(name, size)
        rows[name] = _row(replace(scene, film=replace(scene.film, samples=samples)), effort, budget)
        print(_line(name, rows[name]), flush=True)
    for name, row in rows.items():
        if "finer" in row:
            print(_finer(name, row))
    figures: dict[str, Any] = {"scenes": rows, "holds": holds(rows)}
    return figures


def _chosen(options: Options) -> list[str]:
    """Names of the scenes that the command line chooses."""
    sets = {"": NAMES, "--more": MORE, "--strange": STRANGE, "--unseen": UNSEEN, "--fresh": FRESH, "--foreign": FOREIGN}
    one = sets.get(" ".join(options.extra))
    return options.only(name for names in sets.values() for name in names) if one is None else list(one)


def _scene(name: str, size: tuple[int, int]) -> Scene:
    if name in MORE:
        return scene_of(name, size)
    if name in FRESH:
        return fresh_scene(name, size)
    if name in FOREIGN:
        return foreign_scene(name, size)
    others = STRANGE | UNSEEN
    return staged((others[name],) if name in others else SINGLE[name], size, 1.0)[0]


def holds(rows: dict[str, dict[str, Any]]) -> dict[str, bool]:
    """Acceptance, over the scenes that ran."""
    plain = [max(_ratio(row["error"]), _ratio(row["work"])) for row in rows.values()]
    asked = [max(_ratio(row["asked_error"]), _ratio(row["asked_work"])) for row in rows.values()]
    needed = np.ceil(13 / 16 * len(rows))
    low, high = REACHED
    return {
        "plain render: time and error within 25 % in 13/16 of the scenes": sum(each <= NEAR for each in plain)
        >= needed,
        "plain render: none off by more than a factor of 2": max(plain) <= FAR,
        "requested error: time and error within 25 % in 13/16 of the scenes": sum(each <= NEAR for each in asked)
        >= needed,
        "requested error: none off by more than a factor of 2": max(asked) <= FAR,
        "requested error: 0.7 to 1.1 of it, or less after the fewest samples": all(
            low <= row["reached"] <= high or (row["samples"] <= 2 and row["reached"] < low) for row in rows.values()
        ),
        "a finer one, where the fewest samples do: 0.7 to 1.1 of it": all(
            low <= row["finer_reached"] <= high for row in rows.values() if "finer_reached" in row
        ),
        "time budget within 10 %": all(abs(row["budget"][1] / row["budget"][0] - 1) <= KEPT for row in rows.values()),
    }


def _ratio(pair: tuple[float, float]) -> float:
    return max(pair[0] / max(pair[1], 1e-9), pair[1] / max(pair[0], 1e-9))


def _row(scene: Scene, effort: Effort, budget: float) -> dict[str, Any]:
    truth = _Truth(scene, effort)
    asked = lambda **what: replace(scene, settings=replace(scene.settings, **what))  # noqa: E731
    pairs = [(cost_curve(scene).now, render_scene(scene)) for _ in range(effort.repeats)]
    said, plain = pairs[0]
    by_error = render_scene(asked(target_error=ASKED))
    repeats = effort.repeats - 1 if by_error.work < SHORT_S else 0
    again = [render_scene(asked(target_error=ASKED)) for _ in range(repeats)]
    by_time = render_scene(asked(time_budget_s=budget))
    reached = truth.error(by_error)
    row: dict[str, Any] = {
        "is_least": said.rare is not None,
        "error": (said.delta_e, truth.error(plain)),
        "seconds": _medians([(said.seconds, made.seconds) for said, made in pairs]),
        "work": _medians([(said.work, made.work) for said, made in pairs]),
        "asked_error": (_estimated(by_error), reached),
        "asked_work": _medians([_works(each) for each in (by_error, *again)]),
        "reached": reached / ASKED,
        "samples": by_error.samples,
        "budget": (budget, by_time.seconds),
        "budget_error": (_estimated(by_time), truth.error(by_time, refined=False)),
    }
    if by_error.samples <= 2 and reached < REACHED[0] * ASKED:
        finer = max(0.02, FINER * reached)
        found = render_scene(asked(target_error=finer))
        row |= {"finer": finer, "finer_reached": truth.error(found) / finer, "finer_work": _works(found)}
        row |= {"finer_samples": found.samples}
    return row


def _estimated(made: RenderResult) -> float:
    return made.outcome.delta_e if made.outcome else 0.0


def _medians(pairs: list[tuple[float, float]]) -> tuple[float, float]:
    first, second = np.median(np.array(pairs), axis=0)
    return float(first), float(second)


def _works(made: RenderResult) -> tuple[float, float]:
    return (made.prediction.work if made.prediction else 0.0, made.work)


def _head(budget: float) -> tuple[str, str]:
    cells = (
        "scene", "plain: ΔE predicted, true", "work, s", f"ΔE {ASKED:g} requested: estimated, true", "samples",
        "work, s", f"{budget:g} s requested: taken, s", "ΔE estimated, true",
    )  # fmt: skip
    return "| " + " | ".join(cells) + " |", "|---" * len(cells) + "|"


def _line(name: str, row: dict[str, Any]) -> str:
    low, high = REACHED
    kept = abs(row["budget"][1] / row["budget"][0] - 1) <= KEPT
    asked = low <= row["reached"] <= high or (row["samples"] <= 2 and row["reached"] < low)
    least = "≥ " if row["is_least"] else ""
    cells = (
        name, least + _pair(row["error"], 3), _pair(row["work"]),
        f"{row['asked_error'][0]:.2f}, " + _bold(f"{row['asked_error'][1]:.2f}", asked), str(row["samples"]),
        _pair(row["asked_work"]), _bold(f"{row['budget'][1]:.1f}", kept), _unless_unknown(row["budget_error"]),
    )  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def _pair(pair: tuple[float, float], digits: int = 2) -> str:
    return f"{pair[0]:.{digits}f}, " + _bold(f"{pair[1]:.{digits}f}", _ratio(pair) <= NEAR)


def _unless_unknown(pair: tuple[float, float]) -> str:
    """The errors after a time budget; – for a true one below the noise of the reference, which is not traced for it."""
    return _pair(pair, 3) if pair[1] >= 5e-4 else f"{pair[0]:.3f}, –"


def _bold(text: str, holds: bool) -> str:
    return text if holds else f"**{text}**"


def _finer(name: str, row: dict[str, Any]) -> str:
    return (
        f"{name}: ΔE {row['finer']:.3f} requested, {row['finer_reached']:.2f} of it reached; work "
        f"{_pair(row['finer_work'])} s, {row['finer_samples']} samples"
    )


class _Truth:
    """A picture with all effects, at some pixels, in two halves that are traced further on demand."""

    def __init__(self, scene: Scene, effort: Effort) -> None:
        most = effort.most
        far = replace(scene.settings, max_bounces=None, overrides=(*scene.settings.overrides, ("bounces", "64")))
        full = replace(scene, settings=far, film=replace(scene.film, seed=4711))
        stills = [full.at(moment) for moment in full.moments] or [full]
        self._tracers = [RenderJob(still, plan_from_data(still, _CERTAIN)).chosen_pixels() for still in stills]
        width, height = full.film.size
        self._numbers = np.arange(width * height)
        number = pools(self._numbers, width)
        self._begin(most, self._numbers)
        self._trace(LOOKED * len(stills))
        error = np.bincount(number, pixel_errors(*self._sums / self._samples))
        chance = (0.5 / len(error) + 0.5 * error / max(float(error.sum()), 1e-12)) * np.ones(len(error))
        wanted = max(1, effort.compared // (POOL[0] * POOL[1]))
        drawn = np.random.default_rng(4711).choice(len(error), wanted, p=chance / chance.sum())
        self._weights = (np.bincount(drawn, minlength=len(error)) / chance)[number]
        chosen = np.flatnonzero(self._weights)
        self._weights, self._pools = self._weights[chosen], np.unique(number[chosen], return_inverse=True)[1].ravel()
        self._begin(most, chosen)
        self._trace(most >> 5)  # where light is rare, the noise of few samples is underestimated

    def _begin(self, most: int, numbers: NDArray[np.int64]) -> None:
        self._numbers, self._most, self._samples = numbers, most, 0
        self._sums = np.zeros((2, len(numbers), 3))

    def _mean(self, errors: NDArray[np.float64]) -> float:
        return float(np.average(errors, weights=self._weights))

    def _trace(self, samples: int) -> None:
        none, parts = np.zeros_like(self._numbers), len(self._tracers)
        samples = max(1, samples // parts) * parts  # as many for each moment
        for tracer in self._tracers:
            sums = tracer.trace_halves(self._numbers, none + self._samples // parts, none + samples // parts)
            self._sums += sums.colors.reshape(2, -1, 3)
        self._samples += samples

    def error(self, made: RenderResult, *, refined: bool = True) -> float:
        """Mean ΔE2000 of a picture relative to the limit; the noise of the converged picture is subtracted in
        quadrature. Without ``refined`` that picture is not traced further, whatever its noise; else further than
        ``most`` where its noise exceeds the error, which would be the difference of two larger numbers.
        """
        while True:
            found, noise = self._compared(made.pixels)
            most = self._most if noise <= found else max(self._most, FINEST)
            if not refined or noise <= NOISE_SHARE * found or 2 * self._samples > most:
                return found
            self._trace(self._samples)

    def _compared(self, pixels: NDArray[np.float32]) -> tuple[float, float]:
        halves = self._sums / self._samples
        seen = pixels[..., :3].reshape(-1, 3)[self._numbers].astype(np.float64)
        lab = [lab_from_linear_rgb(np.maximum(each, 0.0)) for each in (seen, halves.mean(axis=0))]
        noise = self._mean(expected_errors(halves, self._pools))
        return float(np.sqrt(max(0.0, self._mean(delta_e_2000(*lab)) ** 2 - noise**2))), noise
