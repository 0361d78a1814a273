# SPDX-License-Identifier: GPL-3.0-or-later
"""Thesis Figs. 6.3 and 6.6 with other scenes: the light dial over its mixtures, and correlated faders.

No people took part in 6.6. Hands are scripted, each with a known habit, and the figure shows whether the measure of
Eq. 6.2 finds that habit again in what a board received.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.explore.board import Binding, Board, Control, Recording, simultaneity
from spectral_core.render import render_scene
from spectral_core.render.relight.dial import bulbs_on_polygon, dial_weights
from spectral_core.render.relight.mix import LiveMix
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import record_transport
from spectral_core.scene import PointLight, Scene, World, gray
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import display_rgb_from_linear

PLACES = ((-3, -3, 4), (3, -3, 4), (0, -4, 5), (-4, -1, 3), (4, -1, 3))
SPECTRA = ("A", "D65", "FL2", "FL11", "HP1")
FADERS, RATE_HZ, MOVE_S = 8, 60, 0.6
MESSAGE_S = 0.0003
"""Time between the messages of two faders."""
ITEMS = (
    "1 fader", "2 adjacent, same way", "2 apart, same way", "2 adjacent, opposed", "2 apart, opposed",
    "4 adjacent, same way", "4 apart, opposed", "8, same way",
)  # fmt: skip
HABITS = ("one after the other", "one hand: neighbors together", "two hands: all together", "two hands, each its way")


def five_lamps(size: int, samples: int) -> Scene:
    """The corner of the sweeps' examples under five lamps with different spectra."""
    from examples.sweeps.scenes import at, corner

    scene = corner(size, samples)
    lamps = tuple(
        PointLight(name=name, world_from_light=at(place), power_w=140, radius=0.3, color=catalogue.illuminant(name))
        for name, place in zip(SPECTRA, PLACES, strict=True)
    )
    return replace(scene, lights=lamps, world=World(gray(0.0)))


def dial_figure(path: Path, *, quick: bool = False) -> dict[str, Any]:
    """Draw the dial and the picture at each bulb, at the middle and along a path; checks a mixture against a render."""
    from matplotlib.figure import Figure

    scene = five_lamps(48 if quick else 128, 8 if quick else 96)
    mix = LiveMix(record_transport(scene, MixtureStorage(), one_per_light=True))
    names = [group for group in mix.transport.groups if group in SPECTRA]
    bulbs = bulbs_on_polygon(len(names))
    turns = np.linspace(0, 2 * np.pi, 60)
    path_at = 0.55 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    stops = [*bulbs, np.zeros(2), 0.5 * (bulbs[0] + bulbs[1]), path_at[20]]
    weights = dial_weights(np.array(stops), np.broadcast_to(bulbs, (len(stops), *bulbs.shape)))
    pictures = [_mixed(mix, names, row) for row in weights]
    figure = Figure(figsize=(11, 5.2), layout="constrained", dpi=110)
    left, right = figure.subfigures(1, 2, width_ratios=(1, 1.3))
    disc = left.subplots()
    disc.add_patch(_circle(1.12))
    disc.plot(*path_at.T, color="#888", linewidth=0.8, linestyle=":")
    for name, (x, y) in zip(names, bulbs, strict=True):
        disc.plot(x, y, "o", markersize=17, color="#f4e7b0", markeredgecolor="#555")
        disc.text(1.24 * x, 1.24 * y, name, ha="center", va="center", fontsize=9)
    for number, (x, y) in enumerate(stops, 1):
        disc.plot(x * 0.999, y * 0.999, "o", color="#e0a800", markersize=5, markeredgecolor="#333")
        disc.annotate(str(number), (x, y), xytext=(11, 9), textcoords="offset points", fontsize=9)
    disc.set(aspect="equal", xlim=(-1.45, 1.45), ylim=(-1.45, 1.45))
    disc.axis("off")
    for number, (plot, linear) in enumerate(zip(right.subplots(2, 4).ravel(), pictures, strict=True), 1):
        plot.imshow(np.clip(display_rgb_from_linear(linear[::-1, :, :3]), 0, 1))
        plot.set_title(f"{number}: " + " ".join(f"{w:.2f}" for w in weights[number - 1]), fontsize=7)
        plot.axis("off")
    figure.savefig(path)
    lamps = tuple(
        replace(lamp, power_w=max(lamp.power_w * len(names) * w, 1e-9))
        for lamp, w in zip(scene.lights, [weights[7][names.index(lamp.name)] for lamp in scene.lights], strict=True)
    )
    rendered = render_scene(replace(scene, lights=lamps, film=replace(scene.film, seed=5))).pixels[..., :3]
    mean = [np.mean(picture, axis=(0, 1)) for picture in (pictures[7][..., :3], rendered)]
    apart = float(np.abs(mean[0] / mean[1] - 1).max())
    own = float(np.abs(weights[:5] - np.eye(5)).max())
    return {"figure": str(path), "largest_error_at_bulbs": own, "mean_color_to_render": round(apart, 4)}


def _mixed(mix: LiveMix, names: list[str], weights: NDArray[np.float64]) -> NDArray[np.float32]:
    amounts = np.zeros(len(mix.transport.groups))
    for name, weight in zip(names, weights, strict=True):
        amounts[mix.transport.index_of(name)] = weight * len(names)
    return np.array(mix.picture(amounts))


def _circle(radius: float) -> Any:
    from matplotlib.patches import Circle

    return Circle((0, 0), radius, facecolor="#ececec", edgecolor="#999")


def simultaneity_figure(path: Path, *, people: int = 12) -> dict[str, Any]:
    """Draw the largest velocity correlation of each scripted pair of hands at each task, and check it."""
    from matplotlib.figure import Figure

    found = np.array([[_trial(person, item) for item in range(len(ITEMS))] for person in range(people)])
    figure = Figure(figsize=(8.5, 4.6), layout="constrained", dpi=110)
    plot = figure.subplots()
    shown = plot.imshow(found, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    plot.set_xticks(range(len(ITEMS)), ITEMS, rotation=25, ha="right", fontsize=8)
    plot.set_yticks(range(people), [f"{p + 1}: {HABITS[p % 4]}" for p in range(people)], fontsize=7)
    figure.colorbar(shown, label="largest correlation of two faders (Eq. 6.2)")
    figure.savefig(path)
    habits = np.arange(people) % 4
    right = {
        "one after the other shows none": bool(np.abs(found[habits == 0]).max() < 0.05),
        "neighbors of one hand move the same way": bool(found[habits == 1][:, [1, 5, 7]].min() > 0.5),
        "one hand leaves apart and opposed faders alone": bool(np.abs(found[habits == 1][:, 2:5]).max() < 0.05),
        "two hands move opposed faders against each other": bool(found[habits == 3][:, [3, 4]].max() < -0.5),
        "two hands move faders apart together": bool(found[habits == 2][:, [1, 2, 5, 7]].min() > 0.5),
    }
    return {"figure": str(path), "trials": int(found.size), **right}


def _trial(person: int, item: int) -> float:
    """Largest correlation (by magnitude, with its sign) of a task, from the values that the board sent to the scene."""
    rng = np.random.default_rng([person, item])
    habit, count = person % 4, int(ITEMS[item][0])
    step = 2 if "apart" in ITEMS[item] and count < 8 else 1
    faders = [k * step for k in range(count)]
    ways = [-1.0 if "opposed" in ITEMS[item] and k % 2 else 1.0 for k in range(count)]
    starts, now = [], rng.uniform(0.3, 0.8)
    for k in range(count):
        together = k > 0 and (
            (habit == 1 and step == 1 and ways[k] == ways[k - 1])
            or (habit == 2 and ways[k] == ways[k - 1])
            or habit == 3
        )
        now = starts[-1] + rng.uniform(0, 0.06) if together else now
        starts.append(now)
        now = max(now, starts[-1]) + MOVE_S * 1.2 + rng.uniform(0.2, 0.6)
    goal = {faders[k]: 0.5 + ways[k] * rng.uniform(0.2, 0.45) for k in range(count)}
    numbers = {f"lamp {k}": 500.0 for k in range(FADERS)}
    controls = [Control("cc14", 0, str(k)) for k in range(FADERS)]
    board = Board(numbers.__getitem__)
    for k, control in enumerate(controls):
        board.bind(Binding(control, f"lamp {k}", 0.0, 1000.0))
    events = []
    for tick in range(int((max(starts) + 2 * MOVE_S) * RATE_HZ)):
        time = tick / RATE_HZ
        for k, fader in enumerate(faders):
            share = np.clip((time - starts[k]) / MOVE_S, 0, 1)
            if 0 < share < 1:  # minimum jerk (Flash and Hogan 1985)
                at = 0.5 + (goal[fader] - 0.5) * (10 * share**3 - 15 * share**4 + 6 * share**5)
                # a device sends the positions of its faders in turn
                board.receive(controls[fader], float(at), time + k * MESSAGE_S)
        for change in board.poll():
            numbers[change.target] = change.value
            events.append((change.time, int(change.target.split()[1]), change.value / 1000.0))
    start = np.full(FADERS, 0.5)
    recording = Recording.from_events([(0.0, 0, 0.5), *events], tuple(numbers), start)
    correlation = simultaneity(recording)
    np.fill_diagonal(correlation, 0.0)
    return float(correlation.ravel()[np.abs(correlation).argmax()])
