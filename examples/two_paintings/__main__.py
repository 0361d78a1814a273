# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m examples.two_paintings [--out DIR] [--samples N] [--width W]``: design, render, write, measure."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from examples.two_paintings.gallery import gallery
from examples.two_paintings.paintings import circles, hills
from spectral_core.cli.shared.terminal import completed
from spectral_core.files.whole import make_folder
from spectral_core.palette.texture.file import write_texture
from spectral_core.palette.texture.lights import design_lights, led_range
from spectral_core.palette.texture.texture import Picture, design_texture
from spectral_core.render import RenderProcess
from spectral_core.scene import Film
from spectral_core.spectra.files import write_spectra
from spectral_core.spectra.pictures import write_picture


def main() -> None:
    """Make the scene."""
    parser = argparse.ArgumentParser(
        prog="python -m examples.two_paintings",
        description="Design two white lamps and a paint that shows a picture under each, render and measure both.",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/two_paintings"), help="folder to write into (out/two_paintings)"
    )
    parser.add_argument("--samples", type=int, default=192, help="light paths per pixel (192)")
    parser.add_argument("--width", type=int, default=640, help="width of the pictures in pixels (640)")
    given = parser.parse_args()
    make_folder(given.out)
    lights = design_lights(led_range(20.0)).lights
    design = design_texture([Picture("hills", hills()), Picture("circles", circles())], lights)
    write_texture(given.out / "painting.exr", design.texture)
    write_spectra(given.out / "lights.csv", lights)
    for loss in design.losses:
        print(f"{loss.name}: ΔE2000 mean {loss.mean:.3f}, p99 {loss.p99:.2f}; ghost of the other {loss.ghost:.3f}")
    film = Film(given.width, round(given.width * 0.75), samples=given.samples)
    pictures = []
    with RenderProcess() as renderer:
        for number, light in enumerate(lights, 1):
            pixels = renderer.render(gallery(design.texture, light, film)).pixels[::-1, :, :3]
            pictures.append(np.ascontiguousarray(pixels))
            write_picture(given.out / f"white_{number}.png", pictures[-1])
    write_picture(given.out / "both.png", np.concatenate(pictures, axis=1))
    print(f"written to {given.out}: both.png, white_1.png, white_2.png, painting.exr, lights.csv")


if __name__ == "__main__":
    sys.exit(completed(main))
