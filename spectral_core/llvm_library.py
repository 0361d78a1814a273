# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of the LLVM library for Dr.Jit: on its own, Dr.Jit takes the first one, and one before 17 ends the process.

Those before 17 cannot select x86's fminimum and fmaximum, which Dr.Jit emits for every min and max (tried: 15.0.6 and
16.0.6 abort, 19.1.7 works).
"""

from __future__ import annotations

import ctypes
import os
import re
import sys
from functools import cache
from pathlib import Path

OLDEST_LLVM = 17
DRJIT_VARIABLE = "DRJIT_LIBLLVM_PATH"
OWN_VARIABLE = "SPECTRAL_SCENE_LLVM"
"""Environment variable with a library, or with the folder of one."""
LLVM_INSTALL_HINT = (
    f"install LLVM {OLDEST_LLVM} or newer (Debian and Ubuntu: sudo apt install libllvm19 or the newest libllvm; macOS: "
    "brew install llvm; Windows: the LLVM installer), or name its shared library in the extension's preferences or in "
    "the environment variable SPECTRAL_SCENE_LLVM"
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
    """Path and major version of the newest LLVM shared library from ``OLDEST_LLVM`` on; None if there is none.

    ``DRJIT_LIBLLVM_PATH`` has precedence, then the library or folder that ``SPECTRAL_SCENE_LLVM`` names: the artist's
    choice in the preferences, or the library of the extension. A name without a version counts as new enough.
    """
    chosen = os.environ.get(DRJIT_VARIABLE)
    if chosen:
        version = llvm_version(Path(chosen)) or OLDEST_LLVM
        return (chosen, version) if Path(chosen).exists() and version >= OLDEST_LLVM else None
    own = _own_library()
    if own is not None:
        return own
    found = []
    for pattern in _PLACES.get(sys.platform, _PLACES["linux"]):
        anchor = Path(pattern).anchor
        for path in Path(anchor).glob(pattern[len(anchor) :]):
            real = path.resolve()
            version = llvm_version(path) or llvm_version(real) or OLDEST_LLVM
            if version >= OLDEST_LLVM:
                found.append((version, str(real)))
    return (max(found)[1], max(found)[0]) if found else None


def llvm_remedy() -> str:
    """What to do where ``find_llvm`` finds none; it names a library of the environment that cannot be used."""
    for variable in (DRJIT_VARIABLE, OWN_VARIABLE):
        chosen = os.environ.get(variable)
        if chosen:
            why = "holds none that can be loaded" if Path(chosen).exists() else "is not there"
            return f"{variable} names {chosen}, which {why}: correct or unset it, or {LLVM_INSTALL_HINT}"
    return LLVM_INSTALL_HINT


def use_newest_llvm() -> None:
    """Set DRJIT_LIBLLVM_PATH to this machine's newest LLVM, unless it is set; call it before Dr.Jit starts."""
    found = find_llvm()
    if found is not None:
        use_llvm(found[0])


def use_llvm(library: str) -> None:
    """Let Dr.Jit load this library, unless DRJIT_LIBLLVM_PATH names one; call it before Dr.Jit starts."""
    load_neighbors(Path(library))
    os.environ.setdefault(DRJIT_VARIABLE, library)


def load_neighbors(library: Path) -> bool:
    """Load a library of the extension, with those in the same folder; True on success.

    The loader searches the system's folders only for the dependencies of a library. Libraries that are already loaded
    are found by name.
    """
    if not (library.parent / "licenses").is_dir():  # a library of the system
        return True
    left = [path for path in library.parent.iterdir() if ".so" in path.name]
    while left:
        failed = [path for path in left if not _loads(path)]
        if len(failed) == len(left):
            return library not in failed
        left = failed
    return True


def _loads(path: Path) -> bool:
    try:
        ctypes.CDLL(str(path), mode=ctypes.RTLD_LOCAL)  # their symbols stay local
    except OSError:
        return False
    return True


@cache
def _checked(library: Path) -> bool:
    """True if a library of the extension can be loaded: it needs a C library as new as its own."""
    return load_neighbors(library)


def _own_library() -> tuple[str, int] | None:
    chosen = os.environ.get(OWN_VARIABLE)
    if not chosen:
        return None
    place = Path(chosen)
    candidates = sorted(place.glob("libLLVM*")) if place.is_dir() else [place]
    for path in candidates:
        version = llvm_version(path) or OLDEST_LLVM
        if path.is_file() and version >= OLDEST_LLVM and _checked(path):
            return str(path), version
    return None


def llvm_version(path: Path) -> int | None:
    """Major version in a library's file name; None without one."""
    match = re.search(r"libLLVM(?:-(\d+)|\.so\.(\d+)|\.(\d+))", path.name) or re.search(
        r"llvm[@-]?(\d+)", str(path), re.IGNORECASE
    )
    return int(next(group for group in match.groups() if group)) if match else None
