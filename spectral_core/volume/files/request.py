# SPDX-License-Identifier: GPL-3.0-or-later
"""Options beside the path: which field, which of its components, and the layout of raw bytes."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike

from spectral_core.checks import frozen_array, read_only_when_copied
from spectral_core.errors import InvalidInputError

_NAMED_LAYOUT = re.compile(
    r"(?P<x>\d+)x(?P<y>\d+)x(?P<z>\d+)[_.-](?P<type>u?int(?:8|16|32|64)|float(?:16|32|64))"
    r"(?:[_.-](?P<order>le|be|little|big)(?![a-z0-9]))?",
    re.IGNORECASE,
)


@read_only_when_copied
@dataclass(frozen=True)
class RawLayout:
    """Layout of a file of bare numbers; x varies fastest.

    ``shape`` is (nx, ny, nz); ``dtype`` names a NumPy integer or float type; ``offset`` is the number of bytes before
    the data, -1 takes the data from the end of the file; ``spacing`` and ``origin`` are in world units.
    """

    shape: tuple[int, int, int]
    dtype: DTypeLike
    byte_order: str = "little"
    offset: int = 0
    spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        counts = frozen_array("shape of the raw layout", self.shape)
        if counts.shape != (3,) or np.any((counts % 1 != 0) | (counts < 1)):
            raise InvalidInputError(
                f"raw layout has shape {self.shape}; expected three counts (nx, ny, nz), each at least 1"
            )
        if self.byte_order not in ("little", "big"):
            raise InvalidInputError(f"raw layout has byte order {self.byte_order!r}; expected 'little' or 'big'")
        if not isinstance(self.offset, int | np.integer) or self.offset < -1:
            raise InvalidInputError(
                f"raw layout has offset {self.offset}; expected a whole number of bytes, or -1 for the file's end"
            )
        try:
            kind = np.dtype(self.dtype).kind
        except TypeError as error:
            raise InvalidInputError(
                f"raw layout has type {self.dtype!r}; expected a NumPy type such as 'uint8'"
            ) from error
        if kind not in "iuf":
            raise InvalidInputError(f"raw layout has type {np.dtype(self.dtype)}; expected an integer or float type")
        stated = np.dtype(self.dtype).str[0]
        if not np.dtype(self.dtype).isnative and stated != self.stored_dtype.str[0]:
            raise InvalidInputError(
                f"raw layout has type {self.dtype!r} beside byte_order {self.byte_order!r}, which differ; state the "
                "order as byte_order='big' or 'little', and the type without an order, such as 'uint16'"
            )
        frozen_array("spacing of the raw layout", self.spacing, (3,))
        frozen_array("origin of the raw layout", self.origin, (3,))

    @property
    def stored_dtype(self) -> np.dtype:
        """The type with the file's byte order."""
        return np.dtype(self.dtype).newbyteorder("<" if self.byte_order == "little" else ">")

    @classmethod
    def from_name(cls, name: str) -> RawLayout | None:
        """Layout in a file name such as ``foot_256x256x256_uint8.raw``; None if it contains none."""
        found = _NAMED_LAYOUT.search(name)
        if found is None:
            return None
        shape = (int(found["x"]), int(found["y"]), int(found["z"]))
        big = (found["order"] or "").lower() in ("be", "big")
        return cls(shape, found["type"].lower(), "big" if big else "little")


@dataclass(frozen=True)
class ReadRequest:
    """Arguments of ``read_volume`` for a reader."""

    field: str | None = None
    """Name of the array, grid or key in a file with several."""
    component: int | None = None
    """Index on a non-spatial axis: a vector's component, a color channel or a time step."""
    raw: RawLayout | None = None

    def __post_init__(self) -> None:
        # here, since inside of a reader the error would look like a damaged file
        whole = isinstance(self.component, int | np.integer) and not isinstance(self.component, bool)
        if self.component is not None and not whole:
            raise InvalidInputError(f"component is {self.component!r}; expected a whole number from 0, or None")
        if self.field is not None and not isinstance(self.field, str):
            raise InvalidInputError(f"field is {self.field!r}; expected the name of an array, or None")
        if self.raw is not None and not isinstance(self.raw, RawLayout):
            raise InvalidInputError(f"raw is {self.raw!r}; expected a RawLayout, such as RawLayout((2, 3, 4), 'uint8')")
