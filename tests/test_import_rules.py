# SPDX-License-Identifier: GPL-3.0-or-later
"""The rooms import each other only as CONTRIBUTING.md states, and large packages are imported only when needed."""

from __future__ import annotations

import ast
import pkgutil
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("spectral_core", "blender_addon")
MAY_BE_PRIVATE = re.compile(r"(?<!self)(?<!cls)\._[a-z]|^\s*(from\s.*)?import\s.*\b_[a-z]|^\s+_\w+,?$", re.MULTILINE)
"""Only a file in which this is found can use a private name of others; to parse all files takes seconds."""
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


def private_uses(path: Path) -> Iterator[str]:
    """Names with a leading underscore that a file takes from a package of others, as ``line: name``."""
    source = path.read_text("utf-8")
    tree = ast.parse(source if MAY_BE_PRIVATE.search(source) else "")
    foreign: set[str] = set()
    nodes = list(ast.walk(tree))
    for node in nodes:
        if isinstance(node, ast.Import):
            taken = [(alias.name, alias.asname or alias.name.split(".")[0]) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            taken = [(f"{node.module}.{alias.name}", alias.asname or alias.name) for alias in node.names]
        else:
            continue
        taken = [each for each in taken if each[0].split(".")[0] not in {*PACKAGES, "__future__"}]
        foreign |= {local for _, local in taken}
        yield from (f"{node.lineno}: {name}" for name, _ in taken if "._" in name)
    for node in nodes:
        if isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.endswith("__"):
            base: ast.expr = node.value
            while isinstance(base, ast.Attribute):
                base = base.value
            if isinstance(base, ast.Name) and base.id in foreign and ast.unparse(node) != "os._exit":
                yield f"{node.lineno}: {ast.unparse(node)}"


def test_no_private_name_of_another_package_is_used() -> None:
    """Such a name may change in any release. ``os._exit`` is documented."""
    files = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    assert [f"{path}:{use}" for path in files for use in private_uses(path)] == []


def test_private_uses_are_found(tmp_path: Path) -> None:
    file = tmp_path / "uses.py"
    file.write_text("import nrrd.reader as r\nfrom os import _exit, path\nr._determine(r.x)\npath._y.z\n", "utf-8")
    assert list(private_uses(file)) == ["2: os._exit", "3: r._determine", "4: path._y"]


@pytest.mark.slow
def test_types_are_right() -> None:
    """Here, and not before all tests, as it takes one core for a minute."""
    done = subprocess.run([sys.executable, "-m", "mypy"], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr


def test_types_of_both_packages_are_checked() -> None:
    """mypy, which a test here and `make check` run, reads its packages and rules from here."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["mypy"]
    assert set(PACKAGES) <= set(settings["packages"])
    assert settings["disallow_untyped_defs"] and settings["check_untyped_defs"]
    assert not any("ignore_errors" in each for each in settings["overrides"])
    assert "-m mypy" in (ROOT / "Makefile").read_text("utf-8")


def test_tests_and_benchmarks_share_no_private_name_of_benchmarks() -> None:
    """What two files use is public: a module or name of ``benchmarks`` with a leading underscore is its file's own."""
    taken = []
    for path in [*(ROOT / "benchmarks").rglob("*.py"), *(ROOT / "tests").rglob("*.py")]:
        source = path.read_text("utf-8")
        for node in ast.walk(ast.parse(source)) if "from benchmarks" in source else ():
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "benchmarks":
                names = [f"{node.module}.{alias.name}" for alias in node.names]
                taken += [f"{path.relative_to(ROOT)}: {name}" for name in names if "._" in name]
    assert [each for each in taken if ".__main__" not in each] == []
