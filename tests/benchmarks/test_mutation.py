# SPDX-License-Identifier: GPL-3.0-or-later
"""The mutation benchmark on a small tree: mutants, the tests that meet them, and tests that fail by themselves."""

from __future__ import annotations

import ast
import contextlib
import copy
import io
import random
import shutil
import sys
from pathlib import Path

import pytest

from benchmarks.program import mutation
from benchmarks.program.mutation import Callers, drawn

PRODUCT = """
def kept(low, high):
    return low + 2 * high

def unused(value):
    return value - 1
"""
TESTS = """
from pathlib import Path
from spectral_core.room.part import kept

def test_sum():
    assert kept(1, 2) == 5

def test_broken():
    assert kept(0, 0) == 1

def test_traced():
    import sys
    kept(0, 0)
    assert sys.gettrace() is None
"""


def _small_tree(root: Path) -> Path:
    for folder in ("spectral_core/room", "tests", "benchmarks/program/cases"):
        (root / folder).mkdir(parents=True)
    packages = ("spectral_core", "spectral_core/room", "benchmarks", "benchmarks/program", "benchmarks/program/cases")
    for package in packages:
        (root / package / "__init__.py").touch()
    (root / "spectral_core/room/part.py").write_text(PRODUCT)
    (root / "tests/test_part.py").write_text(TESTS)
    (root / "pytest.ini").write_text("[pytest]\nmarkers = slow\n")
    shutil.copy(Path(mutation.__file__).parent / "cases/touched.py", root / "benchmarks/program/cases")
    return root


@pytest.fixture(autouse=True)
def rooms(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mutation, "ROOMS", {"spectral_core/room": ["tests"]})


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    return _small_tree(tmp_path / "tree")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Callers, str]:
    """A folder with the small tree and its records, and what was printed while they were made."""
    folder, printed = tmp_path_factory.mktemp("recorded"), io.StringIO()
    with pytest.MonkeyPatch.context() as patched, contextlib.redirect_stdout(printed):
        patched.setattr(mutation, "ROOMS", {"spectral_core/room": ["tests"]})
        callers = Callers(_small_tree(folder / "tree"), "spectral_core/room", folder / "kept")
    return folder, callers, printed.getvalue()


@pytest.mark.skipif(sys.platform == "win32", reason="limits of processor time")
def test_mutants_meet_the_tests_that_call_them_and_no_broken_test(tree: Path, recorded) -> None:
    _, callers, printed = recorded
    assert callers.broken == ["tests/test_part.py::test_broken"]
    assert "test_broken fails without any mutant" in printed
    part = Path("spectral_core/room/part.py")
    names = ["tests/test_part.py::test_sum", "tests/test_part.py::test_traced"]
    ((found, seconds),) = callers.tests_of(part, 2, 3)
    assert sorted(found) == names
    # Without a test that is known to call the function, all of the room that pass are tried.
    ((rest, _),) = callers.tests_of(part, 5, 6)
    assert sorted(rest) == names
    assert not mutation._is_caught(tree, names, seconds)
    (tree / part).write_text(PRODUCT.replace("2 * high", "3 * high"))
    assert mutation._is_caught(tree, names, seconds)


@pytest.mark.skipif(sys.platform == "win32", reason="limits of processor time")
def test_records_are_kept_until_the_product_or_the_tests_change(recorded, tmp_path: Path, monkeypatch) -> None:
    made, first, _ = recorded
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    tree, kept = tmp_path / "tree", tmp_path / "kept"
    run = []
    real = mutation._recorded
    monkeypatch.setattr(mutation, "_recorded", lambda *given: (run.append(list(given[1])), real(*given)))
    again = Callers(tree, "spectral_core/room", kept)
    part = Path("spectral_core/room/part.py")
    assert first.tests_of(part, 2, 3) == again.tests_of(part, 2, 3) and first.broken == again.broken
    (tree / "tests/test_part.py").write_text(TESTS + "\n\ndef test_more():\n    assert kept(1, 1) == 3\n")
    ((names, _),) = Callers(tree, "spectral_core/room", kept).tests_of(part, 2, 3)
    assert "tests/test_part.py::test_more" in names
    assert run == [[], ["tests/test_part.py"]]


@pytest.mark.skipif(sys.platform == "win32", reason="limits of processor time")
def test_a_mutant_meets_the_shortest_tests_in_batches_up_to_a_limit(recorded) -> None:
    callers = copy.copy(recorded[1])
    part, functions = Path("spectral_core/room/part.py"), [["spectral_core/room/part.py", 2]]
    lasting = {"a": 1.0, "b": 30.0, "c": 35.0, "d": 100.0, "e": 90.0}
    callers._records = [
        {"test": name, "seconds": seconds, "functions": functions} for name, seconds in sorted(lasting.items())
    ]
    assert callers.tests_of(part, 2, 3) == [(["a", "b"], 31.0), (["c"], 35.0), (["d"], 100.0)]


def test_a_mutant_differs_in_one_place_and_is_drawn_by_its_seed(tree: Path) -> None:
    found = {drawn("spectral_core/room", random.Random(seed), tree)[1:] for seed in range(40)}
    assert len(found) == 5  # two operators and a number, an operator and a number
    plain = ast.unparse(ast.parse(PRODUCT)).splitlines()
    for text, what in found:
        assert sum(a != b for a, b in zip(text.splitlines(), plain, strict=True)) == 1
        assert what[0].isdigit()
    assert drawn("spectral_core/room", random.Random(7), tree) == drawn("spectral_core/room", random.Random(7), tree)


@pytest.mark.skipif(sys.platform == "win32", reason="limits of processor time")
def test_an_endless_loop_is_caught_by_its_processor_time(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mutation, "SECONDS", 2)
    (tree / "spectral_core/room/part.py").write_text(PRODUCT.replace("return low", "while True: pass\n    return low"))
    assert mutation._is_caught(tree, ["tests/test_part.py::test_sum"], 0.1)


def test_the_copied_tree_has_every_module(tmp_path: Path) -> None:
    copied = mutation._copied(tmp_path)
    folders = [folder for folder in copied.iterdir() if folder.is_dir()]
    assert len(folders) > 5
    for folder in folders:
        modules = {path.relative_to(mutation.ROOT) for path in (mutation.ROOT / folder.name).rglob("*.py")}
        assert modules == {path.relative_to(copied) for path in folder.rglob("*.py")}


def test_tests_that_cannot_run_are_reported(tree: Path) -> None:
    (tree / "tests/test_lost.py").write_text("import no_such_module_of_ours\n")
    with pytest.raises(RuntimeError, match="could not run the unchanged tests"):
        Callers(tree, "spectral_core/room")
