# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of numbers and colors that textures read row by row: what leaves of equal build differ in."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.paints.computed import computed_classes


@dataclass
class Cursor:
    """The row that textures read; ``closures`` moves it.

    ``row`` is 0 outside of its loops: Dr.Jit traces every BSDF that exists, also where it is only a part of another.
    """

    row: Any = 0


@dataclass(frozen=True, eq=False)
class Rows:
    """Plain numbers (n,) or colors (n, 3), one per leaf."""

    cursor: Cursor
    values: NDArray[np.float64]


@cache
def row_classes(variant: str) -> tuple[Any, Any]:
    """The classes of number and color tables under ``variant``, which must be the active one."""
    import drjit as dr
    import mitsuba as mi

    base: Any = computed_classes(variant)[1].__mro__[1]

    class RowNumber(base):
        """A number per row."""

        def __init__(self, rows: Rows) -> None:
            super().__init__()
            self.cursor, self.values = rows.cursor, mi.Float([float(value) for value in rows.values])

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return dr.gather(mi.Float, self.values, mi.UInt32(self.cursor.row), active)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(self.eval_1(si, active))

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(self.eval_1(si, active))

    class RowColor(base):
        """A reflectance per row; in spectral transport the coefficients of its smooth spectrum."""

        def __init__(self, rows: Rows) -> None:
            super().__init__()
            self.cursor = rows.cursor
            table = np.asarray(rows.values, dtype=np.float32)
            if mi.is_spectral:
                table = np.array([np.array(mi.srgb_model_fetch(mi.ScalarColor3f(row))) for row in table])
            # lists, not arrays: Dr.Jit would map NumPy's memory, which a recorded launch takes for another kind
            self.columns = [mi.Float([float(value) for value in column]) for column in table.T]

        def row(self, active: Any) -> list[Any]:
            return [dr.gather(mi.Float, column, mi.UInt32(self.cursor.row), active) for column in self.columns]

        def eval(self, si: Any, active: Any = True) -> Any:
            found = self.row(active)
            if mi.is_spectral:
                return mi.srgb_model_eval(mi.Vector3f(*found), si.wavelengths)
            return mi.Color3f(*found)

    return RowNumber, RowColor
