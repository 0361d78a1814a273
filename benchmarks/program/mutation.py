# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutants drawn at random in palette, volume, board and relight: share that the tests of each room detect.

A mutant changes one place of one file: an operator, a comparison, a constant, a condition, or a statement that is left
out. Each is tried in a copy of the tree with the tests of its room, until one fails. Arguments: how many mutants in
all, and the first seed (60 and 0; 4 with ``--quick``). Mutants within docstrings, messages and imports are not drawn.
Each room's tests run once unchanged, and what they call is written down in ``--out``, where the next draw finds it for
tests that call functions of unchanged files alone. A mutant meets the tests that call its function, the shortest first,
or all of the room where no test is known to call it. One that survives the tests of ``ENOUGH`` seconds counts as a
survivor, although longer tests might catch it. A test that fails without any mutant is left out and named. Mutants that
change nothing that could be observed count as survivors like all others.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks import ROOT, Options

WORDS = "MUTANTS FIRST_SEED"
ROOMS = {
    "spectral_core/palette": ["tests/palette", "tests/palette_models"],
    "spectral_core/volume": ["tests/volume", "tests/volume_scene", "tests/volume_files", "tests/volume_analysis"],
    "spectral_core/explore/board": ["tests/board"],
    "spectral_core/render/relight": ["tests/relight"],
}
BATCH, ENOUGH = 40.0, 240.0
"""Seconds of tests, as measured without mutants, of one run of pytest, and of all that a mutant meets."""
SECONDS, SLOWDOWN = 60, 6
"""Processor time, and times the measured one on top of it, beyond which a run contains an endless loop, so that its
mutant counts as caught; on a busy machine elapsed time says nothing.
"""
PATIENCE = 10
"""Elapsed time, in processor time that is allowed, after which a mutant whose tests wait counts as caught."""
WANTED = 0.85
SWAPPED: dict[type, type] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Lt: ast.LtE, ast.LtE: ast.Lt,
    ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip


def run(options: Options) -> dict:
    """Print and return which mutants survived."""
    given = options.counts("mutants", "first seed")
    count, first = (*given, *(4 if options.quick else 60, 0)[len(given) :])
    tally: Counter[str] = Counter()
    survivors = []
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copied = _copied(Path(folder))
        callers: dict[str, Callers] = {}
        for seed in range(first, first + count):
            room = list(ROOMS)[seed % len(ROOMS)]
            path, text, what = drawn(room, random.Random(seed), copied)
            if room not in callers:
                callers[room] = Callers(copied, room, options.out / "records")
            batches = callers[room].tests_of(path, *_function_lines(copied / path, int(what.split(":")[0])))
            target, kept = copied / path, (copied / path).read_text("utf-8")
            target.write_text(text, "utf-8")
            is_caught = any(_is_caught(copied, tests, seconds) for tests, seconds in batches)
            target.write_text(kept, "utf-8")
            tally["caught" if is_caught else "survived"] += 1
            met = sum(len(tests) for tests, _ in batches)
            print(f"{'caught  ' if is_caught else 'SURVIVED'} seed {seed}: {path}:{what} ({met} tests)", flush=True)
            if not is_caught:
                survivors.append(f"{path}:{what}")
    share = tally["caught"] / max(count, 1)
    print(f"{count} mutants: {tally['caught']} caught ({100 * share:.0f} %)")
    return {
        "mutants": count,
        "caught": tally["caught"],
        "survivors": survivors,
        "holds": {f"at least {100 * WANTED:.0f} % of mutants are caught": share >= WANTED},
    }


def drawn(room: str, rng: random.Random, root: Path = ROOT) -> tuple[Path, str, str]:
    """A mutant of a room in the tree at ``root``: its path, its text, and a description of the change.

    Files weigh as many places as they have, so that each place is as likely as any other.
    """
    places: list[tuple[Path, int]] = []
    for path in sorted((root / room).rglob("*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        places += [(path.relative_to(root), number) for number in range(len(list(_mutations(tree))))]
    path, number = rng.choice(places)
    tree = ast.parse((root / path).read_text("utf-8"))
    line, words, mutate = list(_mutations(tree))[number]
    mutate()
    return path, ast.unparse(ast.fix_missing_locations(tree)) + "\n", f"{line}: {words}"


Mutation = tuple[int, str, Callable[[], None]]


def _mutations(tree: ast.Module) -> Iterator[Mutation]:
    """All possible mutations: line, description, and a function that changes the tree."""
    inside: set[int] = set()
    for node in ast.walk(tree):
        if _is_skipped(node):
            inside.update(id(each) for each in ast.walk(node))
    for node in ast.walk(tree):
        if id(node) in inside:
            continue
        yield from _of_expression(node)
        yield from _of_body(node, inside)


def _is_skipped(node: ast.AST) -> bool:
    """Messages, annotations and imports: no test should depend on their letters."""
    if isinstance(node, ast.Raise | ast.Import | ast.ImportFrom | ast.JoinedStr | ast.AnnAssign):
        return not (isinstance(node, ast.AnnAssign) and node.value is not None)
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def _of_expression(node: ast.AST) -> Iterator[Mutation]:
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign) and type(node.op) in SWAPPED:
        new = SWAPPED[type(node.op)]
        yield node.lineno, f"{type(node.op).__name__} → {new.__name__}", lambda: setattr(node, "op", new())
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPPED:
        comparison = SWAPPED[type(node.ops[0])]
        yield (
            node.lineno,
            f"{type(node.ops[0]).__name__} → {comparison.__name__}",
            lambda: node.ops.__setitem__(0, comparison()),
        )
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        value = node.value
        # 2 for 1, 1 for 0; floats by a factor that no tolerance forgives.
        other = value + 1 if isinstance(value, int) else value * 3.0 + (value == 0.0)
        yield node.lineno, f"{value} → {other}", lambda: setattr(node, "value", other)
    if isinstance(node, ast.If | ast.IfExp):
        yield node.lineno, "condition turned round", lambda: setattr(node, "test", ast.UnaryOp(ast.Not(), node.test))


def _of_body(node: ast.AST, inside: set[int]) -> Iterator[Mutation]:
    """Statements that are left out: calls and assignments that change something."""
    body = getattr(node, "body", None)
    if not isinstance(body, list) or isinstance(node, ast.ClassDef | ast.Module):
        return
    for number, statement in enumerate(body):
        is_call = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call)
        if id(statement) not in inside and (is_call or isinstance(statement, ast.AugAssign)):
            text = ast.unparse(statement).split("\n")[0][:60]

            def leave_out(body: list[ast.stmt] = body, number: int = number) -> None:
                body[number] = ast.copy_location(ast.Pass(), body[number])

            yield statement.lineno, f"left out: {text}", leave_out


def _copied(folder: Path) -> Path:
    """A copy of the files that the tests need."""
    target = folder / "tree"
    target.mkdir()
    for name in ("spectral_core", "blender_addon", "benchmarks", "tests", "examples", "docs", "scripts"):
        unneeded = ("__pycache__", "pictures") if name == "docs" else ("__pycache__",)
        shutil.copytree(ROOT / name, target / name, ignore=shutil.ignore_patterns(*unneeded))
    for name in ("pyproject.toml", "README.md", "CHANGELOG.md"):
        shutil.copy2(ROOT / name, target / name)
    return target


class Callers:
    """Functions called by each test of a room, from a run of the unchanged tests with ``cases/touched.py``."""

    def __init__(self, tree: Path, room: str, kept: Path | None = None) -> None:
        """Run the room's tests in a copied tree, but for those whose records are in the folder ``kept``."""
        files = sorted(path for folder in ROOMS[room] for path in (tree / folder).rglob("test_*.py"))
        folder = kept or tree.parent / "records"
        folder.mkdir(parents=True, exist_ok=True)
        names = [str(path.relative_to(tree)) for path in files]
        kept_in = {name: folder / f"{name.replace('/', '-')}-{_digest(tree / name)}.jsonl" for name in names}
        _recorded(tree, {name: record for name, record in kept_in.items() if not _is_valid(record, tree)})
        lines = [line for record in kept_in.values() for line in record.read_text("utf-8").splitlines()[1:]]
        records = [json.loads(line) for line in lines]
        self.broken = [each["test"] for each in records if each["broken"]]
        for test in self.broken:
            print(f"left out: {test} fails without any mutant", flush=True)
        records = [each for each in records if not each["broken"]]
        self._records = sorted(records, key=lambda each: float(each["seconds"]))
        if _pytest(tree, ["--collect-only", *(each["test"] for each in records)], {}, None) != 0:
            raise RuntimeError(
                f"pytest does not find the tests of {room} by their names, so every mutant would be caught"
            )

    def tests_of(self, path: Path, first: int, last: int) -> list[tuple[list[str], float]]:
        """The tests that call a function of these lines, the shortest first; all of the room where none does.

        In batches with their seconds, which together take at most ``ENOUGH``.
        """
        found = [
            record
            for record in self._records
            if any(name == str(path) and first <= line <= last for name, line in record["functions"])
        ]
        batches: list[tuple[list[str], float]] = []
        total = 0.0
        for record in found or self._records:
            total += record["seconds"]
            if batches and total > ENOUGH:
                break
            # A test that is longer than a batch is one by itself.
            if not batches or batches[-1][1] + record["seconds"] > BATCH:
                batches.append(([], 0.0))
            tests, seconds = batches[-1]
            batches[-1] = ([*tests, record["test"]], seconds + record["seconds"])
        return batches


def _recorded(tree: Path, wanted: dict[str, Path]) -> None:
    """Write what each test of some files calls, and whether it fails, to a record for each file."""
    raw = tree.parent / "raw.jsonl"
    raw.unlink(missing_ok=True)
    if wanted:
        recorder = ["-p", "benchmarks.program.cases.touched"]
        status = _pytest(tree, [*recorder, *wanted], {"TOUCHED": str(raw), "TOUCHED_TREE": str(tree)}, None)
        if status not in (0, 1):
            raise RuntimeError(f"pytest ended with status {status} in {tree}: it could not run the unchanged tests")
    records = [json.loads(line) for line in raw.read_text("utf-8").splitlines()] if raw.exists() else []
    for each in records:
        # Some tests fail under a tracer alone (they count threads or open files): their mutants meet them all the
        # same. One that fails here without it would catch every mutant.
        each["broken"] = not each["passed"] and _pytest(tree, [each["test"]], {}, None) != 0
    for name, record in wanted.items():
        own = [each for each in records if each["test"].startswith(name + "::")]
        met = sorted({path for each in own for path, _ in each["functions"]})
        lines = [{path: _digest(tree / path) for path in met}, *own]
        record.write_text("".join(json.dumps(line) + "\n" for line in lines), "utf-8")


def _is_valid(record: Path, tree: Path) -> bool:
    """True if a record exists, and the files whose functions its tests call are the same."""
    if not record.exists():
        return False
    met = json.loads(record.read_text("utf-8").splitlines()[0])
    return all((tree / path).exists() and _digest(tree / path) == digest for path, digest in met.items())


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _function_lines(path: Path, line: int) -> tuple[int, int]:
    """First and last line of the innermost function around a line; the whole file's if there is none."""
    text = path.read_text("utf-8")
    around = [
        (min([node.lineno, *(each.lineno for each in node.decorator_list)]), node.end_lineno or node.lineno)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    inside = [pair for pair in around if pair[0] <= line <= pair[1]]
    return max(inside) if inside else (1, len(text.splitlines()))


def _is_caught(tree: Path, tests: list[str], seconds: float) -> bool:
    """True if one of these tests, which take ``seconds`` without a mutant, fails."""
    try:
        return _pytest(tree, tests, {}, SECONDS + SLOWDOWN * seconds) not in (0, 5)
    except subprocess.TimeoutExpired:
        return True


def _pytest(tree: Path, arguments: list[str], environment: dict[str, str], seconds: float | None) -> int:
    """Exit status of pytest in a tree; it stops at the first failure where time is limited."""
    environment = {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1", **environment}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not slow", *arguments]
    command += ["-x"] if seconds else []

    def limited() -> None:
        if seconds:
            resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 5))

    return subprocess.run(
        command, cwd=tree, env=environment, capture_output=True, check=False, preexec_fn=limited,
        timeout=PATIENCE * seconds if seconds else None,
    ).returncode  # fmt: skip
