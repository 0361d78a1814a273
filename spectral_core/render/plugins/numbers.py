# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that kernels read from memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

CACHE_LINE = 64


def opaque_number(mi: Any, dr: Any, value: float) -> Any:
    """A number that kernels read from memory, so that another value needs no new kernel."""
    return dr.opaque(mi.Float, float(value))


def aligned(values: NDArray[Any]) -> NDArray[Any]:
    """The same values, flat, aligned to a cache line.

    Dr.Jit uses NumPy's memory without a copy, and reads pairs of numbers differently if they are not aligned: the
    kernel would then depend on chance.
    """
    flat = np.ravel(values)
    room = np.empty(flat.nbytes + CACHE_LINE, np.uint8)
    start = -room.ctypes.data % CACHE_LINE
    placed = room[start : start + flat.nbytes].view(flat.dtype)
    placed[:] = flat
    return placed


def table(kind: Any, values: Any) -> Any:
    """A flat array of the renderer: of 32-bit floats or, for a type of whole numbers, of 32-bit integers.

    It is in Dr.Jit's own memory, so that an edit can replace it: see ``own_copy``.
    """
    import drjit as dr

    return own_copy(kind, np.asarray(values).astype(np.float32 if dr.is_float_v(kind) else np.uint32, copy=False))


@dataclass(frozen=True, eq=False)
class Rows:
    """A table by number, and its length, which kernels read too.

    The length is made with the table: a number that is made within a recorded launch may be read after it was freed.
    """

    values: Any
    length: Any

    @staticmethod
    def of(values: Any) -> Rows:
        """The rows of an array of whole numbers of the renderer."""
        import drjit as dr

        return Rows(values, dr.opaque(type(values), dr.width(values)))

    def look_up(self, number: Any, missing: int = 0, active: Any = True) -> Any:
        """A row; ``missing`` past the last, and for inactive lanes."""
        import drjit as dr

        known = (number < self.length) & active
        return dr.select(known, dr.gather(type(self.values), self.values, number, known), missing)


def channel_mean(dr: Any, value: Any) -> Any:
    """Mean over the channels of a color or spectrum.

    ``dr.mean`` divides by the number of all entries, lanes included: outside of calls, the size of the picture would
    become a constant of the kernel.
    """
    return dr.sum(value) * (1.0 / len(value))


def lightness(mi: Any, dr: Any, value: Any, wavelengths: Any) -> Any:
    """Luminance of a linear color. Of a spectrum, about the same by the few wavelengths of a path, which are drawn
    where the observer's three functions are large.
    """
    if not mi.is_spectral:
        return mi.luminance(mi.Color3f(value))
    responses = [mi.cie1931_xyz(wavelength) for wavelength in wavelengths]
    share = mi.Spectrum(*(xyz[1] / dr.maximum(xyz[0] + xyz[1] + xyz[2], 1e-3) + 1e-3 for xyz in responses))
    return channel_mean(dr, value * share) / channel_mean(dr, share)


def own_copy(kind: Any, array: NDArray[Any]) -> Any:
    """Numbers in Dr.Jit's own memory.

    Dr.Jit maps the memory of a NumPy array. A recorded launch takes such an array for another type than one of Dr.Jit;
    and where one mapped array replaces another, a replay may read the old one, or the freed memory of a third.
    """
    import drjit as dr

    values = kind(array.ravel())
    if dr.width(values) == 0:
        return values
    if dr.flag(dr.JitFlag.SymbolicScope):  # within a loop that is recorded nothing can be scattered
        return kind(array.ravel().tolist())
    result = dr.empty(kind, dr.width(values))
    dr.scatter(result, values, dr.arange(dr.uint32_array_t(kind), dr.width(values)))
    dr.eval(result)
    return result
