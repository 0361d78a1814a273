# SPDX-License-Identifier: GPL-3.0-or-later
"""The LLVM library that Dr.Jit is to load: by itself it takes the first it finds, and one before 17 ends the process.

Those before 17 cannot select x86's fminimum and fmaximum, which Dr.Jit emits for every min and max (tried: 15.0.6 and
16.0.6 abort, 19.1.7 works).
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

OLDEST_LLVM = 17
LLVM_INSTALL_HINT = (
    f"install LLVM {OLDEST_LLVM} or newer (Debian and Ubuntu: sudo apt install libllvm19 or the newest libllvm; macOS: "
    "brew install llvm; Windows: the LLVM installer), or name its shared library in DRJIT_LIBLLVM_PATH"
)
_PLACES = {
    "linux": (
        "/usr/lib/*/libLLVM*.so*", "/usr/lib/libLLVM*.so*", "/usr/lib64/libLLVM*.so*", "/usr/local/lib/libLLVM*.so*",
        "/usr/lib/llvm*/lib/libLLVM*.so*", "/usr/lib64/llvm*/lib/libLLVM*.so*", "/opt/*/lib/libLLVM*.so*",
    ),
    "darwin": (
        "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib", "/usr/local/opt/llvm*/lib/libLLVM*.dylib",
        "/opt/local/libexec/llvm-*/lib/libLLVM*.dylib",
    ),
    "win32": (r"C:\Program Files\LLVM\bin\LLVM-C.dll",),
}  # fmt: skip


def find_llvm() -> tuple[str, int] | None:
    """Path and major version of the newest LLVM shared library from ``OLDEST_LLVM`` on; None where there is none.

    ``DRJIT_LIBLLVM_PATH`` wins when it is set. A library whose name tells no version counts as new enough.
    """
    chosen = os.environ.get("DRJIT_LIBLLVM_PATH")
    if chosen:
        version = llvm_version(Path(chosen)) or OLDEST_LLVM
        return (chosen, version) if Path(chosen).exists() and version >= OLDEST_LLVM else None
    found = []
    for pattern in _PLACES.get(sys.platform, _PLACES["linux"]):
        anchor = Path(pattern).anchor
        for path in Path(anchor).glob(pattern[len(anchor) :]):
            real = path.resolve()
            version = llvm_version(path) or llvm_version(real) or OLDEST_LLVM
            if version >= OLDEST_LLVM:
                found.append((version, str(real)))
    return (max(found)[1], max(found)[0]) if found else None


def use_newest_llvm() -> None:
    """Name this machine's newest LLVM in DRJIT_LIBLLVM_PATH, unless that is set; call it before Dr.Jit starts."""
    found = find_llvm()
    if found is not None:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", found[0])


def llvm_version(path: Path) -> int | None:
    """Major version that a library's file name tells, None where it tells none."""
    match = re.search(r"libLLVM(?:-(\d+)|\.so\.(\d+)|\.(\d+))", path.name) or re.search(
        r"llvm[@-]?(\d+)", str(path), re.IGNORECASE
    )
    return int(next(group for group in match.groups() if group)) if match else None
