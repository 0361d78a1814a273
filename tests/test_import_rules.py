# SPDX-License-Identifier: GPL-3.0-or-later
"""The rooms import each other only as CONTRIBUTING.md states, and large packages are imported only when needed."""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HEAVY = ["bpy", "mitsuba", "drjit", "cvxpy", "colour", "matplotlib", "OpenEXR", "daqp", "piqp"]


def in_fresh_python(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)


def room_modules() -> list[str]:
    import spectral_core

    return sorted(
        info.name
        for info in pkgutil.walk_packages(spectral_core.__path__, "spectral_core.")
        if "mitsuba_plugin" not in info.name and not info.name.endswith("__main__")
    )


def test_import_contracts_hold() -> None:
    """Contracts of import-linter in pyproject.toml: layers, sideways imports, and users of Mitsuba and QP back ends."""
    lint = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([str(lint), "--no-cache"], capture_output=True, text=True, cwd=ROOT)

    assert done.returncode == 0, done.stdout + done.stderr


def test_core_imports_without_any_optional_package() -> None:
    """Every module of the core can be imported where no optional package is installed.

    One interpreter for all packages: a module that imports one of them at its top level fails in any case.
    """
    absent = ["bpy", "mitsuba", "drjit", "cvxpy", "colour", "matplotlib", "OpenEXR", "nrrd", "nibabel", "tifffile"]
    code = (
        "import sys, importlib\n"
        f"sys.modules.update(dict.fromkeys({absent!r}))\n"
        f"for name in {room_modules()!r}: importlib.import_module(name)"
    )
    done = in_fresh_python(code)

    assert done.returncode == 0, done.stderr


def test_no_large_package_is_imported_early() -> None:
    """Importing every module of the core, and the command line, loads no solver, renderer, plotter or Blender."""
    code = (
        "import sys, importlib\n"
        f"for name in {room_modules()!r} + ['blender_addon.commands']: importlib.import_module(name)\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])"
    )
    done = in_fresh_python(code)

    assert done.stdout.strip() == "[]", done.stdout + done.stderr


def test_every_source_file_names_its_license() -> None:
    """The first line of each Python file of the project is the SPDX line."""
    ours = [
        path
        for folder in ("spectral_core", "blender_addon", "benchmarks", "tests", "scripts", "examples")
        for path in (ROOT / folder).rglob("*.py")
    ]
    without = [str(path.relative_to(ROOT)) for path in ours if not path.read_text("utf-8").startswith("# SPDX-")]

    assert ours
    assert without == []
