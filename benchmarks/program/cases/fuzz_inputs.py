# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of ``fuzz`` for the readers: valid files of every format, and random damage to them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import ROOT
from benchmarks.program.cases.file_writers import writers

FIXTURES = ROOT / "tests" / "volume_files" / "data"
EXAMPLES = ROOT / "examples"
Read = Callable[[Path], Any]

NUMBERS = (
    b"0", b"-1", b"1000000000000", b"1e400", b"-1e400", b"nan", b"inf", b"2147483648", b"18446744073709551616", b"0.1",
    b"65536", b"\xc2\xb2", b"9" * 5000, b"1e-320",
)  # fmt: skip
WORDS = (
    b"[" * 20_000, b"{" * 500, b" " * 20_000, b"(" + b" " * 5000, b"/dev/zero", b"..", b"a." * 3000, b"\0", b"\xff\xfe",
    b"%1000000000d", b"x%d 0 1000000000000 1", b"\nline skip: 1000000000000", b"#" * 1000, b"\n" * 1000, b"<a>" * 2000,
    b"LIST\n", b'"' * 999, b",,,,,,", b"1" * 200_000,
)  # fmt: skip
EXTREMES = (0, 1, 2, 127, 255, 256, 65535, 1 << 20, (1 << 31) - 1, 1 << 31, (1 << 32) - 1, 1 << 40, (1 << 63) - 1)


@dataclass(frozen=True)
class Source:
    """A valid file and its reader. ``beside``: valid files beside it that it names."""

    name: str
    file_name: str
    data: bytes
    read: Read
    beside: tuple[tuple[str, bytes], ...] = ()


@cache
def sources(folder: Path) -> tuple[Source, ...]:
    """Valid files of every type that the product reads, written into ``folder``."""
    from spectral_core.explore.board.recording import Recording
    from spectral_core.palette.files import read_palette, read_solution, read_swatches
    from spectral_core.palette.texture.file import read_texture
    from spectral_core.render.relight.transport_file import read_transport
    from spectral_core.spectra.files import read_spectra
    from spectral_core.volume.documents.transfer_file import read_transfer
    from spectral_core.volume.files import read_volume

    readers: dict[str, Read] = {
        "palette": read_palette, "solution": read_solution, "swatches": read_swatches, "transfer": read_transfer,
        "recording": Recording.load, "spectra": read_spectra, "transport": read_transport, "texture": read_texture,
        "volume": read_volume,
    }  # fmt: skip
    found = []
    for writer in writers(side=8):
        if (read := readers.get(re.split(r"[.,]", writer.name)[0])) is None:
            continue  # other programs read pictures and pages
        path = folder / writer.file_name
        writer.write(path, 0)
        found.append(Source(writer.name, writer.file_name, path.read_bytes(), read))
    for path in sorted(EXAMPLES.rglob("*.toml")):
        read = read_transfer if path.parent.name == "transfer" else read_palette
        found.append(Source(f"example {path.name}", path.name, path.read_bytes(), read))
    raw = ("image.raw", (FIXTURES / "image.raw").read_bytes())
    for path in sorted(FIXTURES.iterdir()):
        if path.suffix != ".raw":
            beside = (raw,) if path.suffix == ".mhd" else ()
            found.append(Source(f"volume {path.name}", path.name, path.read_bytes(), read_volume, beside))
    return (*found, *_other_volumes(folder, read_volume))


def _other_volumes(folder: Path, read: Read) -> list[Source]:
    """Formats that the product reads and does not write."""
    values = np.arange(60, dtype=np.uint8).reshape(3, 4, 5)
    raw = values.tobytes()
    np.save(folder / "a.npy", values)
    np.savez_compressed(folder / "a.npz", data=values, spacing=np.ones(3))
    paths = [folder / "a.npy", folder / "a.npz"]
    for make in (_nifti, _tiff):
        try:
            paths += make(folder, values)
        except ImportError:
            continue
    texts = {
        "a.dat": b"ObjectFileName: a.raw\nResolution: 5 4 3\nSliceThickness: 1 1 2\nFormat: UCHAR\n",
        "a.nhdr": b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 5 4 3\nencoding: raw\ndata file: a.raw\n\n",
        "b.nhdr": b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 5 4 1\nencoding: raw\ndata file: a%d.raw 1 1 1 2\n\n",
    }
    beside = (("a.raw", raw), ("a1.raw", raw[:20]))
    found = [Source(f"volume {name}", name, data, read, beside) for name, data in texts.items()]
    found += [Source(f"volume {path.name}", path.name, path.read_bytes(), read) for path in paths]
    return [*found, Source("volume raw", "a_5x4x3_uint8.raw", raw, read)]


def _nifti(folder: Path, values: np.ndarray) -> list[Path]:
    import nibabel

    for name in ("a.nii", "a.nii.gz"):
        nibabel.save(nibabel.Nifti1Image(values, np.eye(4)), folder / name)
    return [folder / "a.nii", folder / "a.nii.gz"]


def _tiff(folder: Path, values: np.ndarray) -> list[Path]:
    import tifffile

    tifffile.imwrite(folder / "a.tif", values, imagej=True)
    tifffile.imwrite(folder / "b.tif", values, compression="zlib")
    return [folder / "a.tif", folder / "b.tif"]


def damaged(source: Source, others: tuple[Source, ...], rng: np.random.Generator) -> bytes:
    """The source's bytes after random changes: mostly one, because files with several are usually refused at once."""
    data = source.data
    for _ in range(min(int(rng.geometric(0.7)), 5)):
        change = _CHANGES[int(rng.integers(len(_CHANGES)))]
        data = change(data, rng, others[int(rng.integers(len(others)))].data)
    return data


Change = Callable[[bytes, np.random.Generator, bytes], bytes]


def _at(data: bytes, rng: np.random.Generator) -> int:
    """A position, with probability ½ in the first kilobyte, where headers are."""
    return int(rng.integers(0, min(len(data), 1024 if rng.random() < 0.5 else len(data)) + 1))


def _flip(data: bytes, rng: np.random.Generator, _: bytes) -> bytes:
    changed = bytearray(data)
    for _index in range(int(rng.integers(1, 9))):
        at = _at(data, rng)
        if at < len(changed):
            changed[at] = int(rng.integers(256))
    return bytes(changed)


def _cut(data: bytes, rng: np.random.Generator, _: bytes) -> bytes:
    return data[: _at(data, rng)]


def _remove(data: bytes, rng: np.random.Generator, _: bytes) -> bytes:
    at = _at(data, rng)
    return data[:at] + data[at + int(rng.integers(1, 64)) :]


def _repeat(data: bytes, rng: np.random.Generator, _: bytes) -> bytes:
    at, length = _at(data, rng), int(rng.integers(1, 200))
    return data[:at] + data[at : at + length] * int(rng.choice([2, 3, 100])) + data[at:]


def _splice(data: bytes, rng: np.random.Generator, other: bytes) -> bytes:
    at, there = _at(data, rng), _at(other, rng)
    return data[:at] + other[there : there + int(rng.integers(1, 2000))] + data[at:]


def _insert(data: bytes, rng: np.random.Generator, _: bytes) -> bytes:
    at = _at(data, rng)
    return data[:at] + WORDS[int(rng.integers(len(WORDS)))] + data[at:]


def _number(data: bytes, rng: np.random.Generator, _: bytes) -> bytes:
    """Replace a number in a text by another one."""
    found = list(re.finditer(rb"-?\d+(?:\.\d+)?", data[:20_000]))
    if not found:
        return data
    place = found[int(rng.integers(len(found)))]
    return data[: place.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))] + data[place.end() :]


def _word(data: bytes, rng: np.random.Generator, _: bytes) -> bytes:
    """An extreme integer of 2, 4 or 8 bytes, in either order."""
    size = int(rng.choice([2, 4, 8]))
    value = EXTREMES[int(rng.integers(len(EXTREMES)))] % (1 << 8 * size)
    at = _at(data, rng)
    return data[:at] + value.to_bytes(size, "little" if rng.random() < 0.7 else "big") + data[at + size :]


_CHANGES: tuple[Change, ...] = (_flip, _flip, _cut, _remove, _repeat, _splice, _insert, _number, _number, _word, _word)
