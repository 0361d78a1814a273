# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection of a file's format: by its first bytes, or by its name if the bytes do not identify it."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from spectral_core.checks import path_of
from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.guarded import open_regular
from spectral_core.volume.files.payload import BROKEN_STREAM

_HEAD = 4096


@dataclass(frozen=True)
class VolumeFormat:
    """One format: its module in this package has ``read(path, request)``, and ``write(volume, path)`` if ``writes``."""

    name: str
    description: str
    extensions: tuple[str, ...]
    recognizes: Callable[[bytes], bool]
    """True if a file's first bytes are this format's; always False for a format without a signature."""
    writes: bool = False
    names_arrays: bool = False
    """True if ``field`` names one of the arrays of a file."""


def _nifti(head: bytes) -> bool:
    return head[344:348] in (b"n+1\0", b"ni1\0") or head[4:8] in (b"n+2\0", b"ni2\0")


def _text_key(*keys: bytes) -> Callable[[bytes], bool]:
    def found(head: bytes) -> bool:
        lines = (line.strip() for line in head.split(b"\n"))
        return any(line.startswith(keys) for line in lines) and b"\0" not in head.split(b"\n")[0]

    return found


FORMATS: tuple[VolumeFormat, ...] = (
    VolumeFormat("nrrd", "NRRD", (".nrrd", ".nhdr"), lambda head: head.startswith(b"NRRD00"), writes=True),
    VolumeFormat(
        "openvdb", "OpenVDB", (".vdb",), lambda head: head.startswith(b" BDV"), writes=True, names_arrays=True
    ),
    VolumeFormat(
        "vtk",
        "VTK legacy structured points",
        (".vtk",),
        lambda head: head.startswith(b"# vtk DataFile"),
        names_arrays=True,
    ),
    VolumeFormat("vti", "VTK image data", (".vti",), lambda head: b"<VTKFile" in head, names_arrays=True),
    VolumeFormat(
        "numpy",
        "NumPy array",
        (".npy", ".npz"),
        lambda head: head.startswith((b"\x93NUMPY", b"PK\x03\x04")),
        names_arrays=True,
    ),
    VolumeFormat(
        "tiff",
        "TIFF stack",
        (".tif", ".tiff"),
        lambda head: head.startswith((b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")),
    ),
    VolumeFormat("nifti", "NIfTI", (".nii", ".nii.gz", ".hdr"), _nifti),
    VolumeFormat("meta", "MetaImage", (".mhd", ".mha"), _text_key(b"NDims", b"ObjectType = Image")),
    VolumeFormat("dat", "raw data with a .dat header", (".dat",), _text_key(b"ObjectFileName", b"RawFile")),
    VolumeFormat("raw", "bare numbers", (".raw", ".bin", ".img"), lambda head: False),
)


def known_formats() -> tuple[VolumeFormat, ...]:
    """Every format that ``read_volume`` tries, in the order they are recognized."""
    return FORMATS


def by_name(name: str) -> VolumeFormat:
    """The format of that name."""
    for entry in FORMATS:
        if entry.name == name:
            return entry
    raise InvalidInputError(f"no volume format is named {name!r}; known: {', '.join(f.name for f in FORMATS)}")


def by_extension(path: Path) -> VolumeFormat | None:
    """The format of the file's extension, or None."""
    lower = path.name.lower()
    return next((entry for entry in FORMATS if lower.endswith(entry.extensions)), None)


def detect_format(path: str | Path) -> VolumeFormat:
    """The format of a file or of a folder (a TIFF stack); raises FileFormatError if none fits.

    The first bytes have precedence over the name, since files are renamed; the name of a format with a signature over
    other bytes is an error, which shows these bytes.
    """
    path = path_of(path)
    if path.is_dir():
        return by_name("tiff")
    head, is_packed = _head(path)
    for entry in FORMATS:
        if entry.recognizes(head):
            if is_packed and entry.name != "nifti":
                raise FileFormatError(
                    f"{path} is {entry.description} inside gzip, which is read of NIfTI alone; unpack it with gunzip"
                )
            return entry
    promised = by_extension(path)
    if promised is None:
        endings = sorted(extension for entry in FORMATS for extension in entry.extensions)
        raise FileFormatError(f"{path} is of no volume format known here; expected one of {', '.join(endings)}")
    if promised.name != "raw":
        what = "is empty" if not head else f"does not begin as one does, but with {head[:12]!r}"
        raise FileFormatError(f"{path} is named as {promised.description} but {what}")
    return promised


def _head(path: Path) -> tuple[bytes, bool]:
    """The first bytes of a file, unpacked if it is gzipped, and whether it is; raises FileFormatError if it cannot be
    opened.
    """
    with open_regular(path) as stream:
        head = stream.read(_HEAD)
    if not head.startswith(b"\x1f\x8b"):
        return head, False
    try:
        with gzip.open(path) as stream:
            return stream.read(_HEAD), True
    except BROKEN_STREAM as error:
        raise FileFormatError(f"{path} is gzipped but truncated or damaged: {error}") from error
