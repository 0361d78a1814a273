# SPDX-License-Identifier: GPL-3.0-or-later
"""Put two pictures into one surface: the second appears when the light changes.

Without --light, two white lights are designed along, under which the pictures can be unrelated. With two lights given
by name or file, the contrast that they allow is stated first. Writes into the output folder: texture.exr (weights and
spectra), lights.csv, what each light shows (shown_1.png, shown_2.png), what was lost (lost_1.png, lost_2.png; white is
ΔE2000 10 or more) and report.json.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spectral_core.errors import InvalidInputError

if TYPE_CHECKING:
    from spectral_core.palette.texture.texture import TextureDesign
    from spectral_core.spectra.spectrum import Illuminant

WHITE_AT_DELTA_E = 10.0
NOTICED_DELTA_E = 1.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("pictures", nargs="+", type=Path, metavar="PICTURE", help="two pictures of one size")
    parser.add_argument("--out", type=Path, default=Path("out/texture"), help="folder to write to (out/texture)")
    parser.add_argument("--light", action="append", default=[], metavar="NAME", help="catalog name or file; give two")
    parser.add_argument("--floor", type=float, help="gray that black becomes (0.02; 0.1 with given lights)")
    parser.add_argument("--slope", type=float, help="contrast to keep, up to 1 - floor (0.97 - floor)")
    parser.add_argument(
        "--exact", action="store_true", help="lower the contrast of all texels until every one is exact"
    )
    parser.add_argument(
        "--spectra", type=int, metavar="K", help="basis spectra, 6 to 8 (6 for designed lights, else 8)"
    )
    parser.add_argument("--importance", type=float, default=1.0, metavar="W", help="weight of picture 1 over picture 2")
    parser.add_argument(
        "--daylight-share", type=float, default=0.0, metavar="F", help="daylight mixed into both lights"
    )
    parser.add_argument(
        "--led-width", type=float, default=20.0, metavar="NM", help="width of the LEDs, 5 to 60 nm (20)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Design the lights where none are given, then the texture; write and print the figures."""
    from spectral_core.palette.texture.texture import Picture, design_texture
    from spectral_core.render.pictures import read_picture

    if len(arguments.pictures) != 2:
        raise InvalidInputError(f"one surface takes two pictures; got {len(arguments.pictures)}")
    pictures = [Picture(path.stem, read_picture(path)) for path in arguments.pictures]
    designed = not arguments.light
    lights, about = _lights(arguments)
    floor = arguments.floor if arguments.floor is not None else (0.02 if designed else 0.1)
    design = design_texture(
        pictures, lights, floor=floor, slope=arguments.slope,
        mapping="uniform_contrast" if arguments.exact else "least_delta_e",
        count=arguments.spectra or (6 if designed else 8), importance=(arguments.importance, 1.0),
    )  # fmt: skip
    figures = about | _figures(design)
    _print(design, figures)
    written = _write(arguments.out, design, figures)
    print(f"written to {arguments.out}: {', '.join(written)}")
    if arguments.json:
        print(json.dumps(figures | {"out": str(arguments.out), "files": written}))
    return 0


def _lights(arguments: argparse.Namespace) -> tuple[list[Illuminant], dict[str, Any]]:
    """Both lights, and what they allow."""
    from spectral_core.palette.texture.lights import design_lights, led_range
    from spectral_core.palette.texture.reach import reachable_contrast

    if arguments.light:
        if len(arguments.light) != 2:
            raise InvalidInputError(f"two pictures need two lights; got {len(arguments.light)} with --light")
        lights = [_light(name) for name in arguments.light]
        reach = reachable_contrast(lights, max(arguments.floor or 0.1, 0.01))
        print(f"these lights allow unrelated pictures a contrast of {reach.contrast:.2g}:1 at floor {reach.floor:g}")
        return lights, {"allowed_slope": reach.slope, "allowed_contrast": reach.contrast}
    if not 5 <= arguments.led_width <= 60:
        raise InvalidInputError(f"--led-width is {arguments.led_width:g}; expected 5 to 60 nm")
    found = design_lights(led_range(arguments.led_width), daylight_share=arguments.daylight_share)
    contrast = (found.floor + found.slope) / found.floor
    print(
        f"designed two lights in {found.seconds:.1f} s: unrelated pictures have a contrast of up to {contrast:.2g}:1, "
        f"their whites differ from D65 by ΔE2000 {max(found.white_delta_e):.3f}"
    )
    return list(found.lights), {"allowed_slope": found.slope, "white_delta_e": list(found.white_delta_e)}


def _light(name: str) -> Illuminant:
    from spectral_core.spectra import catalogue
    from spectral_core.spectra.files import read_spectrum
    from spectral_core.spectra.spectrum import Illuminant

    path = Path(name)
    if not path.suffix:
        return catalogue.illuminant(name)
    spectrum = read_spectrum(path)
    return Illuminant(spectrum.name, spectrum.grid, spectrum.values)


def _figures(design: TextureDesign) -> dict[str, Any]:
    return {
        "floor": design.floor,
        "slope": design.slope,
        "exact_slope": design.stated_slope,
        "spectra": len(design.texture.spectra),
        "compressed_share": design.compressed,
        "pictures": [
            {
                "name": loss.name, "mean_delta_e": loss.mean, "p95_delta_e": loss.p95, "p99_delta_e": loss.p99,
                "largest_delta_e": loss.largest, "contrast": loss.contrast, "ghost": loss.ghost,
            }
            for loss in design.losses
        ],
        "seconds": design.seconds,
    }  # fmt: skip


def _print(design: TextureDesign, figures: dict[str, Any]) -> None:
    print(
        f"{figures['spectra']} spectra; black is shown as {design.floor:g}, contrast {design.slope:.3f}; "
        f"{design.compressed:.1%} of the texels show the nearest color that a reflectance can have"
    )
    for loss in design.losses:
        print(
            f"{loss.name}: ΔE2000 mean {loss.mean:.3f}, 99 % {loss.p99:.2f}, largest {loss.largest:.2f}; "
            f"details kept {loss.contrast:.2f}, ghost of the other picture {loss.ghost:.3f}"
        )
    if max(loss.mean for loss in design.losses) > NOTICED_DELTA_E:
        print(
            "these lights cannot show both pictures with this contrast: lower --slope, raise --floor, give --exact, "
            "favor one picture with --importance, or leave out --light to have the lights designed"
        )


def _write(folder: Path, design: TextureDesign, figures: dict[str, Any]) -> list[str]:
    from spectral_core.cli._pictures import write_picture
    from spectral_core.files.whole import write_text
    from spectral_core.palette.texture.file import write_texture
    from spectral_core.spectra.files import write_spectra

    folder.mkdir(parents=True, exist_ok=True)
    write_texture(folder / "texture.exr", design.texture)
    write_spectra(folder / "lights.csv", list(design.texture.lights))
    names = ["texture.exr", "lights.csv"]
    for number, (light, loss) in enumerate(zip(design.texture.lights, design.losses, strict=True), 1):
        write_picture(folder / f"shown_{number}.png", design.texture.picture(light))
        lost = np.minimum(loss.delta_e.astype(np.float32) / WHITE_AT_DELTA_E, 1.0)
        write_picture(folder / f"lost_{number}.png", np.repeat(lost[..., None], 3, axis=2))
        names += [f"shown_{number}.png", f"lost_{number}.png"]
    write_text(folder / "report.json", json.dumps(figures, indent=1))
    return [*names, "report.json"]
