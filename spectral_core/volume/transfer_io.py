# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions as text: TOML for people, JSON inside scene files; both hold the same fields."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.transfer import Material, TransferFunction

_CURVES = ("values", "extinction", "color", "emission", "gradient_values", "gradient_weights")
_KNOWN = {"name", "lit", *_CURVES}


def transfer_to_dict(transfer: TransferFunction) -> dict[str, Any]:
    """Plain lists and strings: ``materials`` and, where the colours are spectra, ``wavelengths_nm``."""
    materials = []
    for material in transfer.materials:
        entry: dict[str, Any] = {"name": material.name, "lit": material.lit}
        for key in _CURVES:
            curve = getattr(material, key)
            if curve is not None:
                entry[key] = curve.tolist()
        materials.append(entry)
    grid = {} if transfer.wavelengths_nm is None else {"wavelengths_nm": transfer.wavelengths_nm.tolist()}
    return {**grid, "materials": materials}


def transfer_from_dict(data: dict[str, Any]) -> TransferFunction:
    """The inverse of ``transfer_to_dict``; raises InvalidInputError for a field that is missing, unknown or wrong."""
    unknown = set(data) - {"materials", "wavelengths_nm"}
    if unknown or not isinstance(data.get("materials"), list):
        raise InvalidInputError(
            f"a transfer function has the fields {sorted(data)}; expected materials (a list) and maybe wavelengths_nm"
        )
    materials = []
    for entry in data["materials"]:
        missing, strange = {"name", "values", "extinction", "color"} - set(entry), set(entry) - _KNOWN
        if missing or strange:
            raise InvalidInputError(
                f"material {entry.get('name', '?')!r}: missing {sorted(missing)}, unknown {sorted(strange)}; "
                f"known are {sorted(_KNOWN)}"
            )
        materials.append(Material(**entry))
    return TransferFunction(tuple(materials), data.get("wavelengths_nm"))


def dump_transfer(transfer: TransferFunction) -> str:
    """JSON text, as the integrator's ``transfer`` property takes it."""
    return json.dumps(transfer_to_dict(transfer))


def parse_transfer(text: str) -> TransferFunction:
    """From JSON or TOML text; raises FileFormatError where it is neither."""
    try:
        data = json.loads(text) if text.lstrip().startswith("{") else tomllib.loads(text)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise FileFormatError(f"a transfer function's text is neither JSON nor TOML: {error}") from error
    return transfer_from_dict(data)


def load_transfer(path: str | Path) -> TransferFunction:
    """From a .toml or .json file."""
    file = Path(path)
    try:
        return parse_transfer(file.read_text("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(f"cannot read the transfer function {file}: {error}") from error
