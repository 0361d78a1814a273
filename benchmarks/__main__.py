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
from spectral_core.cli.shared.report import print_json
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


def _words_of(name: str, file: Path) -> str:
    """What a benchmark does, and the further words that it reads."""
    module = importlib.import_module(f"benchmarks.{file.parent.name}.{file.stem}")
    words = [*getattr(module, "OPTIONS", ()), getattr(module, "WORDS", "")]
    lines = [(module.__doc__ or "").strip(), "", f"words of {name}: {', '.join(filter(None, words)) or 'none'}"]
    return "\n".join(lines)


def _without_name(
    parser: argparse.ArgumentParser, modules: dict[str, Path], given: argparse.Namespace, extra: list[str]
) -> int:
    """Print the help or the list of benchmarks."""
    if given.help:
        parser.print_help()
        return 0
    if extra:
        print(f"not understood: {' '.join(extra)}; the name of a benchmark comes first", file=sys.stderr)
        return 2
    listed = {name: _description(file) for name, file in modules.items()}
    print(json.dumps(listed) if given.json else "\n".join(f"{name:28} {text}" for name, text in listed.items()))
    return 0


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__, add_help=False)
    parser.add_argument("-h", "--help", action="store_true", help="print this, or after a name the words that it reads")
    parser.add_argument("name", nargs="?", help="name of a benchmark; without it the list is printed")
    parser.add_argument("--json", action="store_true", help="print one JSON object of figures as the last line")
    parser.add_argument("--quick", action="store_true", help="smaller inputs: a test that it runs")
    parser.add_argument("--out", type=Path, default=Path("out/benchmarks"), help="folder for pictures and tables")
    given, extra = parser.parse_known_args(arguments)
    modules = known()
    if given.name is None:
        return _without_name(parser, modules, given, extra)
    if given.name not in modules:
        print(UnknownNameError.among("benchmark", given.name, modules), file=sys.stderr)
        return 2
    file = modules[given.name]
    if given.help:
        print(_words_of(given.name, file))
        return 0
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
        print_json(json.loads(json.dumps(figures, default=_plain)))
    return 0


if __name__ == "__main__":
    sys.exit(completed(main))
