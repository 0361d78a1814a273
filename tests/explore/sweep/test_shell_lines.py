# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines that ``sweep --shell`` prints run the same program, from any folder."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from blender_addon.commands import main as whole_main
from spectral_core import cli
from spectral_core.explore.sweep.store import Store
from tests.explore.sweep.test_sweep import sweep_file


def printed_lines(program: object, path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[list[str]]:
    assert program(["sweep", str(path), "--out", str(folder), "--shell", "2"]) == 0  # type: ignore[operator]
    found = [shlex.split(line) for line in capsys.readouterr().out.splitlines()]
    return [words for words in found if "--share" in words or words[-1:] == ["--collect"]]


def test_the_lines_call_the_program_that_printed_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Those of ``spectral-scene`` called the commands without Blender, which refuse a sweep of a .blend file."""
    path = sweep_file(tmp_path, budget=3)
    for program, module in ((whole_main, "blender_addon"), (cli.main, "spectral_core.cli")):
        lines = printed_lines(program, path, tmp_path / "out", capsys)
        assert len(lines) == 3
        assert {tuple(words[:5]) for words in lines} == {(sys.executable, "-P", "-m", module, "sweep")}


def test_the_lines_of_blender_call_blender(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    blender = SimpleNamespace(app=SimpleNamespace(binary_path="/opt/blender 5/blender"))
    monkeypatch.setitem(sys.modules, "bpy", blender)
    lines = printed_lines(whole_main, sweep_file(tmp_path, budget=3), tmp_path / "out", capsys)
    assert {tuple(words[:4]) for words in lines} == {("/opt/blender 5/blender", "--command", "spectral", "sweep")}


def test_the_lines_name_whole_paths(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A scheduler starts them in a folder of its own, where a relative path names nothing."""
    path = sweep_file(tmp_path, budget=3)
    monkeypatch.chdir(tmp_path)
    for words in printed_lines(cli.main, Path(path.name), Path("out"), capsys):
        assert str(path) in words and str(tmp_path / "out") in words


def test_an_unknown_kind_of_compute_node_lists_each_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = sweep_file(tmp_path, budget=3)
    path.write_text(path.read_text("utf-8").replace('kind = "function"', 'kind = "functoin"', 1), "utf-8")
    assert whole_main(["sweep", str(path), "--out", str(tmp_path / "out")]) == 1
    assert capsys.readouterr().err.count("blend") == 1


def states(folder: Path) -> list[str]:
    with Store.open(folder) as store:
        return [row.state for row in store.ledger.rows()]


def test_collecting_adds_no_point_to_the_list(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It listed the budget of the file, so that shares that started later computed points that nobody had asked for."""
    path, folder = sweep_file(tmp_path, budget=40), tmp_path / "out"
    common = ["sweep", str(path), "--out", str(folder)]
    assert cli.main([*common, "--budget", "6", "--shell", "2"]) == 0
    assert cli.main([*common, "--share", "1/2"]) == 0
    assert cli.main([*common, "--collect"]) == 0
    assert "6 points, 3 to compute, 3 done already" in capsys.readouterr().out
    assert cli.main([*common, "--share", "2/2"]) == 0
    assert "3 points computed, 0 failed" in capsys.readouterr().out
    assert cli.main([*common, "--collect"]) == 0
    assert states(folder) == ["done"] * 6
    assert cli.main([*common, "--collect", "--budget", "9"]) == 1
    assert "--budget has no effect here" in capsys.readouterr().err


def test_collected_points_are_compared_with_the_reference(tmp_path: Path) -> None:
    """The columns of the comparison were missing until the sweep was run once more."""
    path = sweep_file(tmp_path, "picture", budget=4)
    path.write_text(path.read_text("utf-8") + "[reference]\na = 0.5\nb = 0.5\n", "utf-8")
    common = ["sweep", str(path), "--out", str(tmp_path / "out")]
    for step in (["--shell", "1"], ["--share", "1/1"], ["--collect"]):
        assert cli.main([*common, *step]) == 0
    with Store.open(tmp_path / "out") as store:
        assert all(value > 0 for value in store.columns()["rmse"])
