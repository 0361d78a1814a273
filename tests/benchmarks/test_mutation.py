# SPDX-License-Identifier: GPL-3.0-or-later
"""The mutation benchmark on a small tree: mutants, the tests that meet them, and tests that fail by themselves."""

from __future__ import annotations

import ast
import random
import shutil
import sys
from pathlib import Path

import pytest

from benchmarks import mutation
from benchmarks.mutation import Callers, drawn

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

def test_profiled():
    import sys
    kept(0, 0)
    assert sys.getprofile() is None
"""


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    root = tmp_path / "tree"
    for folder in ("spectral_core/room", "tests", "benchmarks"):
        (root / folder).mkdir(parents=True)
    for package in ("spectral_core", "spectral_core/room", "benchmarks"):
        (root / package / "__init__.py").touch()
    (root / "spectral_core/room/part.py").write_text(PRODUCT)
    (root / "tests/test_part.py").write_text(TESTS)
    (root / "pytest.ini").write_text("[pytest]\nmarkers = slow\n")
    shutil.copy(Path(mutation.__file__).with_name("_touched.py"), root / "benchmarks")
    monkeypatch.setattr(mutation, "ROOMS", {"spectral_core/room": ["tests"]})
    return root


@pytest.mark.skipif(sys.platform == "win32", reason="limits of processor time")
def test_mutants_meet_the_tests_that_call_them_and_no_broken_test(tree: Path, capsys) -> None:
    callers = Callers(tree, "spectral_core/room")
    assert callers.broken == ["tests/test_part.py::test_broken"]
    assert "test_broken fails without any mutant" in capsys.readouterr().out
    part = Path("spectral_core/room/part.py")
    names = ["tests/test_part.py::test_profiled", "tests/test_part.py::test_sum"]
    assert sorted(callers.tests_of(part, 2, 3)) == names
    rest = callers.tests_of(part, 5, 6)
    assert rest == ["tests", "--deselect=tests/test_part.py::test_broken"]
    assert not mutation._is_caught(tree, names) and not mutation._is_caught(tree, rest)
    (tree / part).write_text(PRODUCT.replace("2 * high", "3 * high"))
    assert mutation._is_caught(tree, names)


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
    assert mutation._is_caught(tree, ["tests/test_part.py::test_sum"])
