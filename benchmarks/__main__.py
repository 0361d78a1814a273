# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m benchmarks [NAME] [--json] [--quick] [--out DIR]``: the list, or one benchmark's figures."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from pathlib import Path
from typing import Any

from benchmarks import ROOT, Options
from spectral_core.cli.shared.terminal import completed
from spectral_core.errors import FileWriteError, MissingDependencyError, UnknownNameError
from spectral_core.files.whole import make_folder


def known() -> dict[str, Path]:
    """Benchmark name -> file, of all modules that stand directly in a folder of this package."""
    files = sorted((ROOT / "benchmarks").glob("*/*.py"), key=lambda file: file.stem)
    return {file.stem.replace("_", "-"): file for file in files if file.stem != "__init__"}


def _description(file: Path) -> str:
    import ast

    tree = ast.parse(file.read_text("utf-8"))
    return (ast.get_docstring(tree) or "").strip().split("\n")[0]


def _plain(value: Any) -> Any:
    """NumPy scalars and arrays as plain Python, for JSON."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not a figure")


def _not_read(name: str, module: Any, options: Options) -> str:
    """Why a benchmark cannot read its arguments, "" if it can: an ignored word would give figures of other cases."""
    declared = getattr(module, "OPTIONS", ())
    known = {each.split()[0] for each in declared}
    strange = [word for word in options.extra if word.startswith("-") and word not in known]
    if strange:
        return f"{name} has no option {', '.join(strange)}; all have --json, --quick and --out DIR"
    lone = options.lone(declared)
    if not lone or hasattr(module, "WORDS"):
        return ""
    return f"{name} takes no words; got {' '.join(lone)}" + (f"; expected {', '.join(declared)}" if declared else "")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("name", nargs="?", help="name of a benchmark; without it the list is printed")
    parser.add_argument("--json", action="store_true", help="print one JSON object of figures as the last line")
    parser.add_argument("--quick", action="store_true", help="smaller inputs: a test that it runs")
    parser.add_argument("--out", type=Path, default=Path("out/benchmarks"), help="folder for pictures and tables")
    given, extra = parser.parse_known_args(arguments)
    modules = known()
    if given.name is None:
        for name, file in modules.items():
            print(f"{name:28} {_description(file)}")
        return 0
    if given.name not in modules:
        print(UnknownNameError.among("benchmark", given.name, modules), file=sys.stderr)
        return 2
    file = modules[given.name]
    module = importlib.import_module(f"benchmarks.{file.parent.name}.{file.stem}")
    options = Options(quick=given.quick, out=given.out / given.name, extra=extra)
    if refused := _not_read(given.name, module, options):
        print(refused, file=sys.stderr)
        return 2
    try:
        make_folder(options.out)
        figures = module.run(options)
    except (UnknownNameError, MissingDependencyError, FileWriteError) as error:
        print(error, file=sys.stderr)
        return 2
    for claim, held in figures.get("holds", {}).items():
        print(f"{'holds' if held else 'FAILS'}  {claim}")
    if given.json:
        print(json.dumps(figures, default=_plain))
    return 0


if __name__ == "__main__":
    sys.exit(completed(main))
