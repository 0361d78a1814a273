# SPDX-License-Identifier: GPL-3.0-or-later
"""Documents in TOML and JSON: one set of functions for palettes, transfer functions, recordings, sweeps.

A document is a table of strings, numbers, lists and tables; ``format`` and ``version`` state its type.
``read_document`` reads the file within limits and converts every failure to a FileFormatError with the file's name;
``Schema`` checks it and reports the position of errors; ``codecs`` has the encodings that all documents share:

========== ============================================================================================
a grid     ``{start_nm = 380, stop_nm = 780, step_nm = 10}`` or ``{wavelengths_nm = [...]}``
a spectrum ``"D65"``, ``{catalogue = "D65", luminance = 2}``, ``{file = "paint.csv", name = "ochre"}``,
           ``{values = [...]}`` on the document's grid or with ``wavelengths_nm`` of its own,
           ``{sine_nm = 62}``
a color    ``"#rrggbb"`` as a screen is sent it, or linear sRGB ``[r, g, b]``
========== ============================================================================================
"""

from spectral_core.documents.document import decode_document, document_text, read_document, write_document
from spectral_core.documents.schema import Schema
from spectral_core.documents.toml import toml_text

__all__ = ["Schema", "decode_document", "document_text", "read_document", "toml_text", "write_document"]
