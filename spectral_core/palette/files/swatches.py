# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors for painting programs: Adobe Swatch Exchange (``.ase``) and GIMP palettes (``.gpl``), read and written.

ASE: "ASEF", version 1.0, then blocks of a type, a length and, big-endian, a UTF-16 name and four-letter color model.
GPL: a line of three bytes and a name per color. Aseprite adds a fourth byte where a line "Channels: RGBA" says so.
GPL has no groups: a color's name begins with that of its group, and comments, which other programs skip, state where a
group begins.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, path_of, read_only_when_copied, require_kind, require_text
from spectral_core.errors import FileFormatError, InvalidInputError, counted
from spectral_core.files.guarded import read_bytes, read_text, reading
from spectral_core.files.whole import write_bytes
from spectral_core.palette.given import sequence_of
from spectral_core.palette.solution import PaletteSolution
from spectral_core.spectra.color import display_rgb_from_linear, linear_from_display_rgb

ASE_COLOR, ASE_GROUP, ASE_GROUP_END = 0x0001, 0xC001, 0xC002
GAMUT_SLACK = 1e-6
"""Distance from [0, 1] that counts as rounding of a color."""
GROUP = "# group:"
"""Begins the comment of a GPL file that states the group of the colors after it."""
OPAQUE = 255


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Swatch:
    """A named color. ``linear_rgb``: (3,), linear sRGB; ``group``: for example its light."""

    name: str
    linear_rgb: NDArray[np.float64]
    group: str = ""

    def __post_init__(self) -> None:
        require_text("the name of a swatch", self.name)
        require_text("the group of a swatch", self.group)
        object.__setattr__(self, "linear_rgb", frozen_array(f"swatch {self.name!r}", self.linear_rgb, (3,)))


def swatches_of(solution: PaletteSolution) -> list[Swatch]:
    """Color of each reflectance under each light, grouped by light."""
    require_kind("the solution", solution, PaletteSolution, "from solve_palette")
    return [
        Swatch(item.name, solution.actual_linear_rgb[i, j], light.name)
        for j, light in enumerate(solution.problem.lights)
        for i, item in enumerate(solution.problem.reflectances)
    ]


def write_swatches(path: str | Path, swatches: Sequence[Swatch], *, clip: bool = False) -> tuple[str, ...]:
    """Write ``.ase`` or ``.gpl``; returns the names of colors whose channels were clipped.

    Painting programs store display colors. ``clip`` cuts each channel of other colors at 0 and 1, as screens show
    them, which may change their hue; without it they raise InvalidInputError.
    """
    swatches = sequence_of("swatches", swatches)
    for swatch in swatches:
        require_kind("a swatch", swatch, Swatch)
    file = path_of(path)
    writers = {".ase": _ase_bytes, ".gpl": _gpl_bytes}
    if file.suffix.lower() not in writers:
        raise InvalidInputError(f"cannot tell the swatch format of {file.name!r}; name it .ase or .gpl")
    outside = tuple(
        f"{swatch.group} / {swatch.name}" if swatch.group else swatch.name
        for swatch in swatches
        if swatch.linear_rgb.min() < -GAMUT_SLACK or swatch.linear_rgb.max() > 1 + GAMUT_SLACK
    )
    if outside and not clip:
        raise InvalidInputError(
            f"{len(outside)} of {len(swatches)} colors are outside of the display's gamut, such as {outside[0]!r}; "
            "pass clip=True to cut their channels at 0 and 1, as screens show them"
        )
    write_bytes(file, writers[file.suffix.lower()](file.stem, swatches))
    return outside


def read_swatches(path: str | Path) -> list[Swatch]:
    """Colors of an ``.ase`` or ``.gpl`` file, recognized by their contents. Raises FileFormatError."""
    file = path_of(path)
    with reading(file, "a file of swatches"):
        data = read_bytes(file)
        return _read_ase(file, data) if data[:4] == b"ASEF" else _read_gpl(file)


def _display(swatch: Swatch) -> list[float]:
    return display_rgb_from_linear(np.clip(swatch.linear_rgb, 0.0, 1.0)).tolist()


def _ase_bytes(_title: str, swatches: Sequence[Swatch]) -> bytes:
    blocks = []
    for group, members in groupby(swatches, key=lambda swatch: swatch.group):
        if group:
            blocks.append(_ase_block(ASE_GROUP, _ase_name(group)))
        for swatch in members:
            color = b"RGB " + struct.pack(">3f", *_display(swatch)) + struct.pack(">H", 2)
            blocks.append(_ase_block(ASE_COLOR, _ase_name(swatch.name) + color))
        if group:
            blocks.append(_ase_block(ASE_GROUP_END, b""))
    return b"ASEF" + struct.pack(">HHI", 1, 0, len(blocks)) + b"".join(blocks)


def _ase_block(kind: int, content: bytes) -> bytes:
    return struct.pack(">HI", kind, len(content)) + content


def _ase_name(name: str) -> bytes:
    text = name.encode("utf-16-be") + b"\0\0"
    return struct.pack(">H", len(text) // 2) + text


def _read_ase(file: Path, data: bytes) -> list[Swatch]:
    swatches, group, at = [], "", 12
    try:
        (count,) = struct.unpack_from(">I", data, 8)
        for _ in range(count):
            kind, length = struct.unpack_from(">HI", data, at)
            content, at = data[at + 6 : at + 6 + length], at + 6 + length
            if len(content) < length:
                raise struct.error("the last block is cut")
            if kind == ASE_GROUP_END:
                group = ""
            elif kind in (ASE_GROUP, ASE_COLOR):
                (letters,) = struct.unpack_from(">H", content, 0)
                name = content[2 : 2 * letters].decode("utf-16-be")
                if kind == ASE_GROUP:
                    group = name
                else:
                    swatches.append(Swatch(name, _ase_color(file, name, content[2 + 2 * letters :]), group))
        if data[at:].strip(b"\0"):
            raise struct.error(f"its header states {counted(count, 'block')}, and {len(data) - at} bytes follow")
    except (struct.error, UnicodeDecodeError) as error:
        raise FileFormatError(
            f"{file}: the .ase file is truncated or edited near byte {at} ({error}); export it again"
        ) from error
    return swatches


def _ase_color(file: Path, name: str, content: bytes) -> NDArray[np.float64]:
    model = content[:4]
    if model in (b"RGB ", b"Gray"):
        stored = struct.unpack_from(">3f" if model == b"RGB " else ">f", content, 4)
        if not np.isfinite(stored).all():
            raise FileFormatError(f"{file}: swatch {name!r} has the channels {stored}; expected finite numbers")
        return linear_from_display_rgb(np.broadcast_to(stored, 3))
    raise FileFormatError(
        f"{file}: swatch {name!r} is in {model.decode('ascii', 'replace').strip()!r}; expected RGB or Gray, so convert "
        "it in the program that wrote it"
    )


def _gpl_bytes(title: str, swatches: Sequence[Swatch]) -> bytes:
    lines = ["GIMP Palette", f"Name: {_one_line(title)}", "Columns: 0", "#"]
    stated = None
    for swatch in swatches:
        group = _one_line(swatch.group)
        if group != stated:
            lines.append(f"{GROUP} {group}".rstrip())
            stated = group
        red, green, blue = (round(255 * channel) for channel in _display(swatch))
        full = f"{group} / {swatch.name}" if group else swatch.name
        lines.append(f"{red:3d} {green:3d} {blue:3d}\t{_one_line(full)}")
    # A file's own name may be no text.
    return ("\n".join(lines) + "\n").encode("utf-8", "replace")


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _read_gpl(file: Path) -> list[Swatch]:
    lines = read_text(file).splitlines()
    if lines[0].strip() != "GIMP Palette":
        raise FileFormatError(f"{file}, line 1: {lines[0][:40]!r}; expected 'GIMP Palette', or an .ase file")
    swatches: list[Swatch] = []
    group: str | None = None
    count = 3
    for number, line in enumerate(lines[1:], 2):
        if line.startswith("Channels:"):
            count = _channels(file, number, line)
        elif line.startswith(GROUP):
            group = _one_line(line.removeprefix(GROUP))
        elif line.strip() and not line.startswith(("#", "Name:", "Columns:")):
            channels, text = _gpl_color(file, number, line, count)
            linear = linear_from_display_rgb(np.array(channels[:3]) / 255)
            swatches.append(_swatch(text, group, linear))
    return swatches


def _channels(file: Path, number: int, line: str) -> int:
    """Numbers of a color, from Aseprite's line on them."""
    stated = line.partition(":")[2].strip()
    counts = {"RGB": 3, "RGBA": 4}
    if stated not in counts:
        raise FileFormatError(f"{file}, line {number}: the channels are {stated[:40]!r}; expected RGB or RGBA")
    return counts[stated]


def _gpl_color(file: Path, number: int, line: str, count: int) -> tuple[list[int], str]:
    """The ``count`` bytes and the name of a line."""
    cells = line.split(maxsplit=count)
    channels = [int(cell) for cell in cells[:count] if cell.isascii() and cell.isdigit() and len(cell) <= 3]
    if len(channels) < count or max(channels) > 255:
        words = {3: "three", 4: "four"}[count]
        raise FileFormatError(
            f"{file}, line {number}: {line.strip()[:40]!r}; expected {words} numbers to 255 and a name"
        )
    text = cells[count].strip() if len(cells) > count else "Untitled"
    if channels[3:] and channels[3] != OPAQUE:
        raise FileFormatError(
            f"{file}, line {number}: {text[:40]!r} has the opacity {channels[3]}; expected {OPAQUE}, as a swatch is a "
            "color without transparency: make the color opaque, or remove it from the file"
        )
    return channels, text


def _swatch(text: str, group: str | None, linear: NDArray[np.float64]) -> Swatch:
    """The swatch of a line's name; ``group``: the stated one, None in files that state none."""
    if group and f"{text} ".startswith(f"{group} / "):
        return Swatch(text[len(group) + 3 :], linear, group)
    if group is not None:
        return Swatch(text, linear, group)
    before, slash, name = text.rpartition(" / ")
    return Swatch(name, linear, before if slash else "")
