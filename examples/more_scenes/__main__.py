# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m examples.more_scenes car|note|stage [--out DIR] [--samples N] [--width W]``: design, render, write."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from examples.more_scenes import bank_note, car_paint, stage
from spectral_core.cli.shared.terminal import completed
from spectral_core.files.whole import make_folder
from spectral_core.render import RenderProcess
from spectral_core.scene import Film, Scene
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.pictures import write_picture
from spectral_core.spectra.spectrum import Illuminant

Scenes = tuple[Callable[[Illuminant, Film], Scene], tuple[Illuminant, ...]]


def car() -> Scenes:
    """The car by day and under a sodium lamp, painted by recipe."""
    wanted, recipe = car_paint.paint()
    print(f"recipe for {wanted.name}:\n{recipe.text(1000)}")
    return lambda light, film: car_paint.car(recipe.reflectance, light, film), (illuminant("D65"), illuminant("HP1"))


def note() -> Scenes:
    """The bank note under two white lamps."""
    design = bank_note.note()
    for loss in design.losses:
        print(f"{loss.name}: ΔE2000 mean {loss.mean:.3f}, p99 {loss.p99:.2f}")
    return lambda light, film: bank_note.counter(design.texture, light, film), design.texture.lights


def theater() -> Scenes:
    """The stage under two white lamps."""
    lights, texture, costumes = stage.design()
    return lambda light, film: stage.theater(texture, costumes, light, film), lights


SCENES = {"car": car, "note": note, "stage": theater}


def main() -> None:
    """Make one scene."""
    parser = argparse.ArgumentParser(
        prog="python -m examples.more_scenes", description="Design and render one of the scenes: car, note or stage."
    )
    parser.add_argument("scene", choices=SCENES, help="which scene")
    parser.add_argument(
        "--out", type=Path, default=Path("out/more_scenes"), help="folder to write into (out/more_scenes)"
    )
    parser.add_argument("--samples", type=int, default=128, help="light paths per pixel (128)")
    parser.add_argument("--width", type=int, default=480, help="width of the pictures in pixels (480)")
    given = parser.parse_args()
    make_folder(given.out)
    make, lights = SCENES[given.scene]()
    film = Film(given.width, round(given.width * 0.75), samples=given.samples)
    with RenderProcess() as renderer:
        pictures = [renderer.render(make(light, film)).pixels[::-1, :, :3] for light in lights]
    path = given.out / f"{given.scene}.png"
    write_picture(path, np.ascontiguousarray(np.concatenate(pictures, axis=1)))
    print(f"written to {path}")


if __name__ == "__main__":
    sys.exit(completed(main))
