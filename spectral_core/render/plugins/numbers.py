# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that kernels read instead of knowing."""

from __future__ import annotations

from typing import Any

import numpy as np


def opaque_number(mi: Any, dr: Any, value: float) -> Any:
    """A number that kernels read instead of knowing, so that another value needs no new kernel."""
    return dr.opaque(mi.Float, float(value))


def table(kind: Any, values: Any) -> Any:
    """A flat array of the renderer from numbers, at an address that vector instructions like.

    Dr.Jit reads NumPy's own memory, and a kernel for unaligned memory is another kernel: the same scene would be
    compiled again whenever NumPy happens to allocate elsewhere.
    """
    given = np.asarray(values)
    wanted = np.float32 if np.issubdtype(given.dtype, np.floating) else np.uint32
    flat = given.astype(wanted).ravel()
    memory = np.empty(flat.nbytes + 64, np.uint8)
    start = -memory.ctypes.data % 64
    aligned = memory[start : start + flat.nbytes].view(wanted)
    aligned[:] = flat
    return kind(aligned)
