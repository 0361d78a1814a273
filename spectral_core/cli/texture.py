# SPDX-License-Identifier: GPL-3.0-or-later
"""Put two pictures into one surface: the second appears when the light changes.

Without --light, two white lights are designed as well, under which the pictures can be unrelated. With two lights given
by name or file, the contrast that they allow is printed first. One picture and two lights take wanted colors:
--want '#a02020' '#604020' says that this red should look brown under the second light. A document (.toml or .json, see
examples/) states the same. Writes into the output folder: texture.exr (weights and spectra), lights.csv, the picture
under each light (shown_1.png, shown_2.png), its errors (lost_1.png, lost_2.png; white is ΔE2000 10 or more) and
report.json.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from spectral_core.cli.shared.texture import make_texture
from spectral_core.errors import InvalidInputError

if TYPE_CHECKING:
    from spectral_core.palette.texture.project import TextureProject

DOCUMENTS = (".toml", ".json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument(
        "pictures",
        nargs="+",
        type=Path,
        metavar="PICTURE",
        help="two pictures of one size, one with wanted colors, or a document",
    )
    parser.add_argument("--out", type=Path, default=Path("out/texture"), help="folder to write to (out/texture)")
    parser.add_argument(
        "--light", action="append", default=[], metavar="NAME", help="catalogue name, FILE or FILE@NAME; give two"
    )
    parser.add_argument("--floor", type=float, help="gray that black becomes (0.02; 0.1 with given lights)")
    parser.add_argument("--slope", type=float, help="contrast to keep, up to 1 - floor (0.97 - floor)")
    parser.add_argument(
        "--exact", action="store_true", help="lower the contrast of all texels until every one is exact"
    )
    parser.add_argument(
        "--spectra",
        type=int,
        metavar="K",
        help="basis spectra, 6 to 8, of one picture 4 to 8 (6 for designed lights, else 8)",
    )
    parser.add_argument(
        "--importance", type=float, default=1.0, metavar="W", help="weight of picture 1 over picture 2 (1)"
    )
    parser.add_argument(
        "--daylight-share", type=float, default=0.0, metavar="F", help="share of daylight mixed into both lights (0)"
    )
    parser.add_argument(
        "--led-width", type=float, default=20.0, metavar="NM", help="width of the LEDs, 5 to 60 nm (20)"
    )
    parser.add_argument(
        "--want", nargs=2, dest="wanted", action="append", default=[], metavar=("COLOR", "WANTED"),
        help="one picture: this color should look like that one under the second light, both as #rrggbb",
    )  # fmt: skip
    # the earlier name of --want
    parser.add_argument("--wish", nargs=2, dest="wanted", action="append", default=[], help=argparse.SUPPRESS)
    parser.add_argument("--progress", action="store_true", help="print a line 'progress SHARE WHAT' for each step")


NAMED = {
    "the number of basis spectra": "--spectra", "floor": "--floor", "slope": "--slope", "importance": "--importance",
    "daylight_share": "--daylight-share", "led_width_nm": "--led-width",
}  # fmt: skip
OF_SETTINGS = (
    "light", "floor", "slope", "exact", "spectra", "importance", "daylight_share", "led_width", "wanted"
)  # fmt: skip
OF_TWO_PICTURES = ("floor", "slope", "exact", "importance", "daylight_share", "led_width")


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    if arguments.pictures[0].suffix.lower() in DOCUMENTS:
        return dict.fromkeys(OF_SETTINGS, "the document states all settings")
    if len(arguments.pictures) == 1:
        return dict.fromkeys(OF_TWO_PICTURES, "it is for two pictures")
    found = dict.fromkeys(("daylight_share", "led_width"), "both lights are given") if arguments.light else {}
    return found | ({"slope": "--exact keeps as much contrast as every texel can show"} if arguments.exact else {})


def run(arguments: argparse.Namespace) -> int:
    """Design the lights where none are given, then the texture; write and print the figures."""
    from spectral_core.cli.shared.outputs import files_of_document
    from spectral_core.cli.shared.spectra import files_in

    project, first = _project(arguments), arguments.pictures[0]
    is_document = first.suffix.lower() in DOCUMENTS
    read = files_of_document(first) if is_document else [file for name in arguments.light for file in files_in(name)]
    return make_texture(project, arguments.out, read=read, as_json=arguments.json, tell=arguments.progress)


def _project(arguments: argparse.Namespace) -> TextureProject:
    """The project of the document, or of the options."""
    from spectral_core.cli.shared.spectra import illuminant_named
    from spectral_core.documents.codecs import decoded_color
    from spectral_core.palette.texture.project import TextureProject, TextureSettings, read_project
    from spectral_core.palette.texture.uplift import Pin
    from spectral_core.spectra.spectrum import told_apart

    if arguments.pictures[0].suffix.lower() in DOCUMENTS:
        if len(arguments.pictures) > 1:
            raise InvalidInputError("a document names its pictures; give it alone")
        return read_project(arguments.pictures[0])
    if len(arguments.light) not in (0, 2):
        raise InvalidInputError(
            f"got {len(arguments.light)} with --light; a texture needs two lights, or none for two pictures, whose "
            "lights are then designed"
        )
    settings = TextureSettings(
        floor=arguments.floor, slope=arguments.slope,
        mapping="uniform_contrast" if arguments.exact else "least_delta_e", spectra=arguments.spectra,
        importance=arguments.importance, daylight_share=arguments.daylight_share, led_width_nm=arguments.led_width,
    )  # fmt: skip
    return TextureProject(
        tuple(arguments.pictures), tuple(told_apart([illuminant_named(name) for name in arguments.light])),
        tuple(Pin(decoded_color(color), decoded_color(wanted)) for color, wanted in arguments.wanted), settings,
    )  # fmt: skip
