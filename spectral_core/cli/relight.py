# SPDX-License-Identifier: GPL-3.0-or-later
"""A new picture from stored transport: other spectra, other intensities, a dial's path, or a page with the dial."""

from __future__ import annotations

import argparse
import math
import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.checks import require_whole
from spectral_core.cli.shared.outputs import numbered
from spectral_core.cli.shared.parser import without_companion
from spectral_core.cli.shared.report import print_json
from spectral_core.errors import FileWriteError, InvalidInputError, MissingDependencyError
from spectral_core.files.whole import whole_file
from spectral_core.spectra.pictures import require_ending, write_picture, write_picture_with_alpha

VIDEO = ".mp4"
MOST_FRAMES = 100_000
"""Pictures along a path: more than an hour of video."""
COLORS_OF_VIDEO = {"colorspace": "bt709", "color_primaries": "bt709", "color_trc": "iec61966-2-1", "color_range": "tv"}
"""What a video states about its numbers. Without it players guess: the larger the picture, the more likely BT.709."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument(
        "transport", type=Path, metavar="TRANSPORT.exr", help="as `spectral-scene transport` records it"
    )
    parser.add_argument("--light", metavar="GROUP=LAMP,…", help="spectra: catalogue names, FILE or FILE@NAME")
    parser.add_argument("--mix", metavar="GROUP=AMOUNT,…", help="intensities; 1 is as rendered")
    parser.add_argument(
        "--dial", metavar="X,Y", help="selector on the dial (bulbs on a polygon of radius 1), or a path X,Y;X,Y;…"
    )
    parser.add_argument("--frames", type=int, default=48, help="pictures along a dial path (48)")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help=".png, .exr or .npy; of a path FILE_0001.png … (FILE####.png), or .mp4"
    )
    parser.add_argument("--html", type=Path, metavar="FILE.html", help="one self-contained page with the dial")


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    ignored = without_companion(arguments, {"dial": "out"})
    return ignored if ";" in (arguments.dial or "") else ignored | {"frames": "it needs a path, --dial 'X,Y;X,Y;…'"}


def run(arguments: argparse.Namespace) -> int:
    """Relight and write."""
    from spectral_core.cli.shared.outputs import require_apart, require_outputs
    from spectral_core.cli.shared.spectra import files_in, illuminant_named
    from spectral_core.render.relight.mix import LiveMix, amounts_of
    from spectral_core.render.relight.page import write_page
    from spectral_core.render.relight.transport_file import read_transport

    if arguments.out is None and arguments.html is None:
        raise InvalidInputError("nothing to write: give --out FILE or --html FILE.html")
    if ";" in (arguments.dial or ""):
        require_whole("--frames", arguments.frames, 2, MOST_FRAMES)
    require_apart(_targets(arguments), [arguments.transport])
    if arguments.out is not None and arguments.out.suffix.lower() != VIDEO:
        require_ending(arguments.out)
    if arguments.html is not None and arguments.html.suffix.lower() not in (".html", ".htm"):
        raise InvalidInputError(f"--html is {str(arguments.html)!r}; end it with .html, or no browser opens it")
    transport = read_transport(arguments.transport)
    groups = transport.groups
    named = _pairs("--light", arguments.light or "", groups)
    lights = {group: illuminant_named(name) for group, name in named.items()}
    mix = {group: _number("--mix", amount) for group, amount in _pairs("--mix", arguments.mix or "", groups).items()}
    weights = None if arguments.out is None else _dial_weights(arguments, len(groups))
    read = [file for name in named.values() for file in files_in(name)]
    require_outputs(_targets(arguments), [arguments.transport, *read])
    live = LiveMix(transport)
    for group, light in lights.items():
        live.set_light(group, light)
    amounts = amounts_of(transport, mix)
    report: dict[str, Any] = {"groups": list(transport.groups), "files": []}
    if arguments.out is not None:
        start = time.perf_counter()
        # times the number of lights: in the middle of the dial the picture is then as bright as it was recorded
        mixes = [amounts] if weights is None else list(amounts * weights * len(amounts))
        report["files"] = _write(arguments, live, mixes)
        report["seconds"] = round(time.perf_counter() - start, 3)
    if arguments.html is not None:
        write_page(
            arguments.html, transport, title=arguments.transport.stem.removesuffix(".transport"), lights=lights, mix=mix
        )
        report["files"].append(str(arguments.html))
    for file in report["files"]:
        print(file)
    if arguments.json:
        print_json(report)
    return 0


def _pairs(option: str, text: str, groups: Sequence[str]) -> dict[str, str]:
    """Value of each light group that a text names; names of groups and files may contain commas and equal signs."""
    pieces = text.split(",")
    entries: list[tuple[str, str]] = []
    while pieces:
        for count in range(1, len(pieces) + 1):  # up to the comma after the name of a known group
            known = _after_name(",".join(pieces[:count]), groups)
            if known is not None:
                entries.append(known)
                break
        else:
            count, piece = 1, pieces[0].strip()
            group, separator, value = piece.rpartition("=")
            if separator and value.strip():
                entries.append((group.strip(), value.strip()))
            elif piece and entries and not separator:  # a comma in the value before it
                entries[-1] = (entries[-1][0], f"{entries[-1][1]},{pieces[0].rstrip()}")
            elif piece:
                raise InvalidInputError(f"{option} {piece!r} is not of the form GROUP=VALUE, such as Key=0.3")
        del pieces[:count]
    if text and not entries:
        raise InvalidInputError(f"{option} {text!r} names no light group; expected GROUP=VALUE, such as Key=0.3")
    names = [group for group, _ in entries]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        from spectral_core.render.light_groups import group_text

        raise InvalidInputError(f"{option} names the light group {group_text(twice)} twice; name it once")
    return dict(entries)


def _after_name(text: str, groups: Sequence[str]) -> tuple[str, str] | None:
    """Group and value of GROUP=VALUE, None if the text begins with no group of the transport. Spaces before the name
    are ignored, unless a group begins with them.
    """
    for group in sorted(groups, key=len, reverse=True):
        starts = (text[spaces:] for spaces in range(len(text) - len(text.lstrip()) + 1))
        found = next((each for each in starts if each.startswith(group)), "")
        rest = found.removeprefix(group).lstrip()
        if rest.startswith("=") and rest[1:].strip():
            return group, rest[1:].strip()
    return None


def _number(option: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InvalidInputError(f"{option} has {text!r}; expected a number such as 0.3")
    return number


def _dial_weights(arguments: argparse.Namespace, groups: int) -> Any:
    """(frames, groups) for a selector or along its path; None without --dial."""
    from spectral_core.render.relight.dial import bulbs_on_polygon, dial_weights

    if arguments.dial is None:
        return None
    points = [[_number("--dial", number) for number in point.split(",")] for point in arguments.dial.split(";")]
    if any(len(point) != 2 for point in points):
        raise InvalidInputError(f"--dial {arguments.dial!r} is not X,Y or X,Y;X,Y;…")
    path = np.array(points)
    if len(path) > 1:
        along = np.linspace(0, len(path) - 1, arguments.frames)
        path = np.stack([np.interp(along, np.arange(len(path)), path[:, axis]) for axis in (0, 1)], axis=1)
    return dial_weights(path, bulbs_on_polygon(groups) if groups > 1 else [(0.0, 0.0)])


def _targets(arguments: argparse.Namespace) -> list[Path]:
    """The files to write: the picture, video or pictures along a path, and the page."""
    page = [] if arguments.html is None else [arguments.html]
    if arguments.out is None:
        return page
    return [*_pictures(arguments.out, arguments.frames if ";" in (arguments.dial or "") else 1), *page]


def _pictures(out: Path, frames: int) -> list[Path]:
    """The file of each frame; a single one, and a video, have the name as given."""
    if frames == 1 or out.suffix.lower() == VIDEO:
        return [out]
    return [numbered(out, number) for number in range(1, frames + 1)]


def _write(arguments: argparse.Namespace, live: Any, mixes: list[Any]) -> list[str]:
    from spectral_core.render.relight.mix import as_rendered

    out = arguments.out
    if out.suffix.lower() == VIDEO:
        return [_write_video(out, live, mixes)]
    files = _pictures(out, len(mixes))
    for path, weights in zip(files, mixes, strict=True):
        pixels = as_rendered(live.transport, live.picture(weights))[::-1]
        if path.suffix.lower() == ".npy" or np.all(pixels[..., 3] == 1):
            write_picture(path, pixels[..., :3])
        else:  # of a transparent film, as Blender writes it
            write_picture_with_alpha(path, pixels)
    return [str(path) for path in files]


def _write_video(out: Path, live: Any, mixes: list[Any]) -> str:
    from spectral_core.render.relight.mix import as_rendered

    program = shutil.which("ffmpeg")
    if program is None:
        raise MissingDependencyError(
            "a video needs the program ffmpeg (Debian: apt install ffmpeg); or write frames as .png"
        )
    with tempfile.TemporaryDirectory() as folder, whole_file(out) as unfinished:
        for number, weights in enumerate(mixes, 1):
            pixels = as_rendered(live.transport, live.picture(weights))
            write_picture(Path(folder) / f"{number:05d}.png", pixels[::-1, :, :3])
        even = "pad=ceil(iw/2)*2:ceil(ih/2)*2"  # the codec halves the color planes
        made = f"{even},scale=out_color_matrix=bt709:out_range=tv,format=yuv420p"  # by itself it would take BT.601
        stated = [word for name, value in COLORS_OF_VIDEO.items() for word in (f"-{name}", value)]
        done = subprocess.run(
            [program, "-y", "-loglevel", "error", "-framerate", "24", "-i", f"{folder}/%05d.png", "-vf", made, *stated,
             str(unfinished)], capture_output=True, text=True,
        )  # fmt: skip
        if done.returncode:
            raise FileWriteError(f"ffmpeg could not write {out}: {done.stderr.strip()[-300:]}")
    return str(out)
