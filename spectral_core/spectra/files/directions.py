# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the wavelengths of a table stand in its first row or in its first column."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from spectral_core.errors import FileFormatError
from spectral_core.spectra.files.columns import is_number
from spectral_core.spectra.files.headings import names_wavelengths

Row = tuple[int, list[str]]
"""Line number in the file, and its cells without blanks around them."""

VISIBLE_NM = (380.0, 780.0)
OF_SAMPLES = ("sample", "specimen", "name", "id", "no", "nr", "number", "patch", "paint", "color", "colour", "material")
"""Words in the heading of a column of names."""


def used(cells: list[str]) -> int:
    """Number of cells up to the last that holds anything: separators at the end of lines are no columns."""
    return max((index for index, cell in enumerate(cells, 1) if cell), default=0)


def runs_across(path: Path, header: Row, body: list[Row]) -> bool:
    """True if the first row contains the wavelengths: only if the first column cannot contain them.

    Raises FileFormatError if both may contain them, and the first heading does not state which of them does.
    """
    line, (corner, *across) = header if header[1] else (0, [""])
    across, down = across[: max(used(header[1]) - 1, 0)], [cells[0] for _, cells in body]
    if len(across) < 2 or not all(map(is_number, across)):
        return False
    is_of_samples = bool(set(re.findall(r"[^\W\d_]+", corner.lower())) & set(OF_SAMPLES))
    if is_of_samples or len(down) < 2 or not _are_in_order(down):
        return True
    # Numbers may be names: samples 1, 2, 3 and 401, 402, 403, or RAL 5014 over 380 to 780 nm.
    if not _is_visible(across) or not _are_in_order(across):
        return not _is_visible(down) and float(across[0]) > max(map(float, down))
    if not _is_visible(down):
        return True
    if names_wavelengths(corner):
        return False
    raise FileFormatError(
        f"{path}, line {line}: the first row ({across[0]}, {across[1]}, …) and the first column ({down[0]}, {down[1]}, "
        f"…) may both be wavelengths; name the first column 'wavelength_nm' or 'sample' (it is {corner!r})"
    )


def _is_visible(cells: Sequence[str]) -> bool:
    return any(VISIBLE_NM[0] <= float(cell) <= VISIBLE_NM[1] for cell in cells)


def _are_in_order(cells: Sequence[str]) -> bool:
    """True for numbers that rise or fall."""
    if not all(map(is_number, cells)):
        return False
    steps = np.diff([float(cell) for cell in cells])
    return bool(np.all(steps > 0) or np.all(steps < 0))
