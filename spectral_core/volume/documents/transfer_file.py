# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions in TOML and JSON files.

::

    format = "spectral-scene transfer function"
    version = 1
    values = "data"                     # knots are data values; "fraction": 0 the volume's least, 1 its greatest
    length = "voxel"                    # extinction per voxel; "world" (the default): per world unit

    [[materials]]
    name = "bone"
    values = [1100, 1300, 2500]         # ascending; two equal ones make a jump
    extinction = [0, 0.6, 0.8]          # of each, at these values
    color = "#e8dcc0"                   # or linear [r, g, b]; with a [grid] a spectrum
    gradient = {values = [10, 40], weights = [0, 1]}    # optional: only where the value changes quickly

    [[materials]]
    name = "x-ray"
    values = [200, 2500]
    emission = [0, 0.02]                # adds light; without extinction it absorbs none
    color = [0.5, 0.7, 1.0]
    lit = false                         # emits its color instead of reflecting the scene's light

A spectrum is written as in every document, see ``spectral_core.documents``.
``transfer.schema.json`` says it all for editors.
"""

from __future__ import annotations

from pathlib import Path

from spectral_core.checks import require_kind
from spectral_core.documents import read_document, write_document
from spectral_core.volume.documents.transfer_document import TransferDocument, document_of, transfer_of
from spectral_core.volume.transfer import TransferFunction


def read_transfer(path: str | Path) -> TransferDocument:
    """The transfer function of a .toml or .json file. Raises FileFormatError (file, and line or place)."""
    return read_document(path, transfer_of, "a transfer function")


def write_transfer(path: str | Path, stated: TransferDocument | TransferFunction, *, comment: str = "") -> None:
    """Write ``.toml`` or ``.json``; read_transfer returns the same numbers. ``comment``: lines above the TOML."""
    if isinstance(stated, TransferFunction):
        stated = TransferDocument(stated)
    require_kind("the transfer function", stated, TransferDocument, "or a TransferFunction")
    write_document(path, document_of(stated), comment=comment, what="transfer functions")
