# SPDX-License-Identifier: GPL-3.0-or-later
"""Gathers of x86 processors in Dr.Jit's kernels.

LLVM counts the gather instruction of AMD's processors as slow, and splits each gather into a branch, a load and an
insertion per lane. On an EPYC of the third generation this doubles the time to compile a path-tracing kernel as well as
the time to run it. Dr.Jit has no setting for LLVM's features in Python, but its library has a function.
"""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from pathlib import Path
from typing import Any

GATHER = "+fast-gather"
"""LLVM's feature: the processor's gathers are worth using."""
NEEDED = "+avx2"
"""The feature of processors with gathers."""
SET_TARGET, CPU, FEATURES, WIDTH = (
    "_Z19jit_llvm_set_targetPKcS0_j",
    "_Z19jit_llvm_target_cpuv",
    "_Z24jit_llvm_target_featuresv",
    "_Z21jit_llvm_vector_widthv",
)
"""C++ functions of libdrjit-core as Linux and macOS name them; elsewhere kernels stay as they are."""


@cache
def use_gathers() -> bool:
    """Let kernels that are compiled from now on use the processor's gathers; False if that is not possible.

    Call it after Mitsuba's variant for LLVM is set.
    """
    core = _core()
    if core is None:
        return False
    text, number = ctypes.CFUNCTYPE(ctypes.c_char_p), ctypes.CFUNCTYPE(ctypes.c_uint32)
    try:
        features, cpu, width = text((FEATURES, core))(), text((CPU, core))(), number((WIDTH, core))()
        change = ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_uint32)((SET_TARGET, core))
    except AttributeError:  # another version of Dr.Jit
        return False
    known = (features or b"").decode().split(",")
    if not cpu or NEEDED not in known:
        return False
    if GATHER not in known:
        change(cpu, ",".join([*known, GATHER]).encode(), width)
    return True


def _core() -> Any | None:
    """The library behind the Python module ``drjit``, which has loaded it; None if it has another name."""
    import drjit

    name = "libdrjit-core.dylib" if sys.platform == "darwin" else "libdrjit-core.so"
    path = Path(drjit.__file__).with_name(name)
    return ctypes.CDLL(str(path)) if path.exists() else None
