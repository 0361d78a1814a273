# SPDX-License-Identifier: GPL-3.0-or-later
"""Transport in one multi-part EXR: a part per light group, a part for coverage, and a header that describes them.

Band channels follow the published layout of Fichet et al. 2021 (``S0.550,000000nm``), so that spectral viewers open
them; ``dial`` parts are R, G, B; ``exact`` parts are X, Y, Z at each knot. A checksum over pixels and header detects a
truncated or edited file.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import path_of
from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.exr import exr_headers, openexr, read_exr, write_exr
from spectral_core.files.guarded import is_file, no_file, reading, require_shallow
from spectral_core.files.whole import require_own_kind
from spectral_core.render.relight.agx_view import view_of_document
from spectral_core.render.relight.storages import storage_of_document
from spectral_core.render.relight.transport import Transport
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

KIND, VERSION = "spectral-scene transport", 1
_ATTRIBUTE = "spectralSceneTransport"
_COVERAGE = "coverage"
_GONE = "if it was moved or renamed, name its present path; else record it (in Blender, or by spectral-scene transport)"


def write_transport(path: str | Path, transport: Transport, *, only_over_transports: bool = False) -> None:
    """Write a transport file; lossless, whole or not at all.

    Parameters
    ----------
    path : the .exr file.
    transport : the recording.
    only_over_transports : replace only an earlier transport file. For a path that comes from a .blend.

    Raises
    ------
    FileWriteError
        The disk is full, or the folder is absent or closed to this user.
    InvalidInputError
        Another file than a transport is there, and ``only_over_transports``.
    MissingDependencyError
        OpenEXR is not installed.
    """
    module = openexr()
    meaning = json.dumps({**_meaning(transport), "checksum": _checksum(transport)})
    layout = transport.storage.exr_header
    parts = []
    for number, (group, planes) in enumerate(zip(transport.groups, transport.channels, strict=True)):
        names = transport.storage.channel_names()
        pixels = {name: np.ascontiguousarray(plane[::-1]) for name, plane in zip(names, planes, strict=True)}
        header = {"type": module.scanlineimage, "compression": module.ZIP_COMPRESSION, **layout}
        if number == 0:  # it may take a megabyte
            header[_ATTRIBUTE] = meaning
        parts.append(module.Part(header, pixels, f"{number} {group or 'ungrouped'}"))
    header = {"type": module.scanlineimage, "compression": module.ZIP_COMPRESSION}
    parts.append(module.Part(header, {"A": np.ascontiguousarray(transport.coverage[::-1])}, _COVERAGE))
    if only_over_transports:
        require_own_kind(path, is_transport, "transport file")
    write_exr(path, module.File(parts))


def is_transport(path: str | Path) -> bool:
    """True if a file is a transport, by its header; pixels are not read."""
    try:
        return any(_ATTRIBUTE in header for header in exr_headers(path)[:1])
    except FileFormatError:
        return False


def read_transport(path: str | Path, *, scene_hash: str | None = None) -> Transport:
    """Read a transport file. ``scene_hash``: refuse a file that was made from any other scene.

    Raises FileFormatError for a file that is missing, truncated, edited, of another type or of another scene; the
    message names the cause and the remedy.
    """
    path = path_of(path)
    if not is_file(path):
        raise FileFormatError(no_file(path, _GONE))
    what = "a transport file; record it again"
    with reading(path, what):
        parts = read_exr(path, what)
        meaning = _read_meaning(path, parts)
        transport = _assemble(path, meaning, parts)
        if _checksum(transport) != meaning.get("checksum"):
            raise FileFormatError(
                f"{path}: its pixels are not those that were recorded: the file was edited or damaged; record it again"
            )
    if scene_hash is not None and scene_hash != transport.scene_hash:
        raise FileFormatError(
            f"{path} was recorded from another scene, from this one before a change (also of its samples or notes), or "
            "by a version of this program that describes scenes otherwise; record it again, or mix it as it is by: "
            "spectral-scene relight"
        )
    return transport


def _meaning(transport: Transport) -> dict[str, Any]:
    grid = transport.storage.grid
    return {
        "kind": KIND,
        "version": VERSION,
        "storage": transport.storage.kind,
        "wavelengths_nm": None if grid is None else grid.wavelengths_nm.tolist(),
        "groups": list(transport.groups),
        "lights": [None if light is None else _light_document(light) for light in transport.lights],
        "white": "linear sRGB, white is D65; lights have the luminance of white",
        "exposure": transport.exposure,
        "scene_hash": transport.scene_hash,
        "samples": transport.samples,
        "seed": transport.seed,
        **({} if transport.view is None else {"view": transport.view.document()}),
        **({} if transport.look is None else {"look": transport.look.tolist()}),
    }


def _light_document(light: Spectrum) -> dict[str, Any]:
    return {"name": light.name, "wavelengths_nm": light.grid.wavelengths_nm.tolist(), "values": light.values.tolist()}


def _light_of(document: dict[str, Any] | None) -> Spectrum | None:
    if document is None:
        return None
    return Illuminant(
        document["name"], SpectralGrid(np.array(document["wavelengths_nm"])), np.array(document["values"])
    )


def _read_meaning(path: Path, parts: list[Any]) -> dict[str, Any]:
    text = parts[0].header.get(_ATTRIBUTE) if parts else None
    if text is None:
        raise FileFormatError(f"{path} is an EXR picture, but no transport; make one with: spectral-scene transport")
    try:
        require_shallow(text, path)
        meaning: dict[str, Any] = json.loads(text)
        kind, version = meaning["kind"], meaning["version"]
    except (ValueError, KeyError, TypeError) as error:
        raise FileFormatError(f"{path}: its header was edited and cannot be read ({error}); record it again") from error
    if kind != KIND or isinstance(version, bool) or not isinstance(version, int) or not 1 <= version <= VERSION:
        raise FileFormatError(f"{path} is of version {str(version)[:40]}; this program reads 1 to {VERSION}")
    return meaning


def _assemble(path: Path, meaning: dict[str, Any], parts: list[Any]) -> Transport:
    try:
        storage = storage_of_document(meaning["storage"], meaning["wavelengths_nm"])
        groups, names = _groups(path, meaning["groups"], parts), storage.channel_names()
        planes = [[_plane(path, part, name) for name in names] for part in parts[: len(groups)]]
        return Transport(
            storage, groups, np.array(planes, dtype=np.float32), _plane(path, parts[len(groups)], "A"),
            tuple(_light_of(light) for light in meaning["lights"]), float(meaning["exposure"]),
            str(meaning["scene_hash"]), int(meaning["samples"]), int(meaning["seed"]),
            view_of_document(meaning["view"]) if "view" in meaning else None,
            np.array(meaning["look"], dtype=np.float64) if "look" in meaning else None,
        )  # fmt: skip
    except (KeyError, TypeError, ValueError, OverflowError, InvalidInputError) as error:
        why = f"it lacks {error}" if isinstance(error, KeyError) else error
        raise FileFormatError(
            f"{path}: its header was edited or damaged and describes no transport ({why}); record it again"
        ) from error


def _groups(path: Path, stated: Any, parts: list[Any]) -> tuple[str, ...]:
    """Light groups that a header states, if the file has their parts."""
    if not isinstance(stated, list) or not stated or not all(isinstance(name, str) for name in stated):
        raise TypeError("its light groups are no list of names")
    if len(parts) != len(stated) + 1:
        raise FileFormatError(
            f"{path} has {len(parts)} parts, but its header needs {len(stated) + 1}, one for each light group and one "
            "for the coverage: it was edited or damaged; record it again"
        )
    return tuple(stated)


def _plane(path: Path, part: Any, name: str) -> NDArray[np.float32]:
    if name not in part.channels:
        raise FileFormatError(
            f"{path} lacks the channel {name!r} in a part of its transport: it was edited or damaged; record it again"
        )
    return np.ascontiguousarray(part.channels[name].pixels[::-1], dtype=np.float32)


def _checksum(transport: Transport) -> str:
    digest = hashlib.sha256(json.dumps(_meaning(transport), sort_keys=True).encode())
    digest.update(np.ascontiguousarray(transport.channels).tobytes())
    digest.update(np.ascontiguousarray(transport.coverage).tobytes())
    return digest.hexdigest()
