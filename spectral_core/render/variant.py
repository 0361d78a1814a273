# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of Mitsuba's variant: CUDA on request, else LLVM, whose library must be installed and new enough.

Nothing here imports Mitsuba before the LLVM library is chosen: Dr.Jit loads the library in ``DRJIT_LIBLLVM_PATH`` at
its first use, and LLVM older than 17 ends the process.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from spectral_core.errors import InvalidInputError, MissingDependencyError, RenderError, UnknownNameError
from spectral_core.llvm_library import OLDEST_LLVM, find_llvm, llvm_remedy, use_llvm
from spectral_core.render.gathers import use_gathers

Transport = Literal["rgb", "spectral"]


@dataclass(frozen=True, slots=True)
class Backend:
    """Renderer on this machine. ``variant``: Mitsuba's name for it. ``notes``: remarks on the choice for the user."""

    variant: str
    notes: tuple[str, ...] = ()
    llvm_library: str | None = None


def choose_backend(transport: Transport, wanted: str | None = None) -> Backend:
    """Variant for a transport; ``wanted`` is None (the CPU), "llvm", "cuda" or a full variant name.

    Raises InvalidInputError if ``wanted`` is unknown or contradicts ``transport``, MissingDependencyError if this
    machine has no LLVM library. A missing CUDA device is replaced by the CPU, with a note.
    """
    if transport not in get_args(Transport):
        raise UnknownNameError.among("transport", str(transport), get_args(Transport))
    kind = (wanted or "llvm").lower()
    kind = next((name for name in ("cuda", "llvm") if kind == name or kind.startswith(f"{name}_")), "")
    if not kind or (wanted and "_" in wanted and wanted not in _names(transport)):
        raise InvalidInputError(
            f"variant {wanted!r} cannot render {transport} transport; choose cuda or llvm, "
            f"or one of {', '.join(_names(transport))}"
        )
    notes: list[str] = []
    if kind == "cuda":
        if _has_cuda():
            return Backend(f"cuda_ad_{transport}")
        notes.append("no usable CUDA device was found, so the CPU renders")
    llvm = find_llvm()
    if llvm is None:
        raise MissingDependencyError(_no_llvm())
    return Backend(f"llvm_ad_{transport}", tuple(notes), llvm[0])


def _no_llvm() -> str:
    return f"rendering needs the LLVM library, version {OLDEST_LLVM} or newer, and none was found; {llvm_remedy()}"


def _names(transport: Transport) -> tuple[str, ...]:
    return (f"llvm_ad_{transport}", f"cuda_ad_{transport}")


def _has_cuda() -> bool:
    if not any(Path(path).exists() for path in ("/dev/nvidia0", "/dev/dxg", r"C:\Windows\System32\nvcuda.dll")):
        return False
    drjit = _import("drjit")
    return bool(drjit.has_backend(drjit.JitBackend.CUDA))


def activate(backend: Backend) -> Any:
    """Import Mitsuba with ``backend`` as the variant of this thread, and register our plugins; returns the module.

    Raises MissingDependencyError without Mitsuba, RenderError if the variant cannot start.
    """
    if backend.llvm_library and "DRJIT_LIBLLVM_PATH" not in os.environ:
        use_llvm(backend.llvm_library)
    # Blender loads Mitsuba's libraries after its own; deep binding would make them use Blender's copies of shared
    # symbols.
    os.environ.setdefault("DRJIT_NO_RTLD_DEEPBIND", "1")
    mitsuba = _import("mitsuba")
    try:
        if mitsuba.variant() != backend.variant:
            mitsuba.set_variant(backend.variant)
    except Exception as error:
        raise RenderError(f"Mitsuba cannot start its variant {backend.variant}: {error}") from error
    if backend.variant.startswith("llvm"):
        use_gathers()
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    from spectral_core.render import plugins

    plugins.register(backend.variant)
    return mitsuba


def _import(name: str) -> Any:
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise MissingDependencyError.package(name, "rendering", "render") from error


def describe_backend() -> dict[str, Any]:
    """Report on the renderer of this machine: versions, LLVM library, variant, problems with their remedies.

    Starts no renderer, so it is safe even if starting one would fail.
    """
    from importlib import metadata

    report: dict[str, Any] = {"problems": []}
    for package in ("mitsuba", "drjit", "OpenEXR"):
        try:
            report[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            report[package] = None
            report["problems"].append(str(MissingDependencyError.package(package, "rendering", "render")))
    llvm = find_llvm()
    report["llvm_library"], report["llvm_version"] = llvm if llvm else (None, None)
    if llvm is None:
        report["problems"].append(_no_llvm())
    elif report["mitsuba"] is not None:
        report["variant"] = {name: choose_backend(name).variant for name in ("rgb", "spectral")}
    return report
