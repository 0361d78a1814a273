# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: help, exit status, errors in one line, and commands that work without optional packages."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from blender_addon.commands import command_names, main
from spectral_core.cli import command_packages
from spectral_core.cli.shared.terminal import completed

ROOT = Path(__file__).resolve().parents[1]
OF_BLENDER = sorted(set(command_names()) - set(command_packages()) - {"demo"})
"""Commands that open a .blend file."""


def without(absent: list[str], *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a command in a Python where some packages cannot be imported."""
    code = (
        f"import sys\nfor name in {absent!r}: sys.modules[name] = None\n"
        f"from blender_addon.commands import main; sys.exit(main({list(arguments)!r}))"
    )
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, timeout=200)


def test_every_command_has_help(capsys: pytest.CaptureFixture[str]) -> None:
    for name in command_names():
        with pytest.raises(SystemExit) as ended:
            main([name, "--help"])
        assert ended.value.code == 0
        assert "--json" in capsys.readouterr().out
    assert {"demo", "design", "render", "plan", "doctor", "relight", "transport", "volume", "lattice"} <= set(
        command_names()
    )


def test_the_list_of_commands_has_whole_sentences(capsys: pytest.CaptureFixture[str]) -> None:
    """The line of ``render`` ended in the middle: "or write it as a"."""
    with pytest.raises(SystemExit):
        main(["--help"])
    listed = capsys.readouterr().out.partition("  COMMAND\n")[2].partition("\noptions:")[0]
    entries = re.findall(r"^    (\S.*(?:\n      .*)*)", listed, re.M)
    assert len(entries) == len(command_names())
    assert [entry for entry in entries if not entry.endswith(".")] == []


def test_an_error_gives_one_line_and_an_exit_status(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["relight", str(tmp_path / "absent.exr"), "--out", "x.png", "--json"]) == 1
    printed = capsys.readouterr()

    assert printed.err.startswith("spectral-scene relight: ")
    assert printed.err.count("\n") == 1
    assert json.loads(printed.out)["kind"] == "FileFormatError"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["lattice", "--dims", "0"], "--dims is 0; expected 1 to 16"),
        (["lattice", "--refine", "-1"], "--refine is -1; expected 0 or more"),
        (["design", "--preset", "Hidden mark", "--out", "FILE"], "taken is a file; choose another folder"),
        (["design", "examples/transfer/solid.toml"], 'format is "spectral-scene transfer function"'),
        (["relight", "docs", "--out", "x.png"], "docs is a folder, pipe or device; expected a file"),
        (["recipe", "lamp", "docs", "--cct", "4000"], "docs is a folder, pipe or device; expected a file"),
        (["sweep", "docs"], "docs is a folder, pipe or device; expected a file"),
        (["plan", "docs"], "docs is a folder, pipe or device; expected a file"),
        (["texture", "docs", "docs"], "docs is a folder, pipe or device; expected a file"),
        (["explore", "examples/leds.csv"], "examples/leds.csv is a file; name the folder of the sweep"),
        (["design", "absent.toml"], "there is no file absent.toml; check its name and its folder"),
        (["relight", "absent.exr", "--out", "x.png"], "there is no file absent.exr"),
        (
            ["recipe", "paints", "absent.csv", "--target", "red"],
            "there is no file absent.csv; give a file of spectra such",
        ),
        (["explore", "absent"], "absent.cdb holds no sweep (neither project.json nor data.csv); run one first"),
    ],
)
def test_simple_mistakes_give_one_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.chdir(ROOT)
    taken = tmp_path / "taken"
    taken.write_text("a file, no folder")
    assert main([str(taken) if word == "FILE" else word for word in arguments]) == 1
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "spectral-scene: no command is given; expected one of: cost, demo, "),
        (["desing"], "no command is named 'desing'; did you mean 'design'"),
        (
            ["mix", "blue:1", "--ligth", "A"],
            "spectral-scene mix: not understood: '--ligth', 'A'; did you mean --light?",
        ),
        (["volume", "x.nrrd"], "required: --transfer. See `spectral-scene volume --help`"),
        (["recipe"], "required: lamp|paints|inks|filters, SPECTRA.csv. See `spectral-scene recipe --help`"),
        (["recipe", "inks"], "required: SPECTRA.csv. See"),
        (["lattice", "--out", "-"], "argument --out: '-' names no file, as commands read and write files only"),
    ],
)
def test_words_that_no_command_takes_give_one_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    said = capsys.readouterr().err
    assert ended.value.code == 2 and message in said
    assert said.count("\n") == 1


def test_design_works_without_blender_and_renderer(tmp_path: Path) -> None:
    palette = next((ROOT / "examples").glob("hidden*.toml"))
    done = without(
        ["bpy", "mitsuba", "drjit", "colour", "cvxpy"], "design", str(palette), "--out", str(tmp_path), "--json"
    )

    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])
    assert list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("absent", "arguments", "message"),
    [
        ("bpy", ("demo",), r"spectral-scene\[blender\]"),
        *(("bpy", (name, "pyproject.toml"), r"spectral-scene\[blender\]") for name in OF_BLENDER),
    ],
)
def test_commands_name_missing_packages_with_a_remedy(absent: str, arguments: tuple[str, ...], message: str) -> None:
    done = without([absent], *arguments)

    assert done.returncode == 1
    assert message.replace("\\", "") in done.stderr
    assert "Traceback" not in done.stderr


def test_benchmarks_are_listed_and_unknown_ones_refused() -> None:
    listed = subprocess.run([sys.executable, "-m", "benchmarks"], capture_output=True, text=True, cwd=ROOT, timeout=60)
    unknown = subprocess.run(
        [sys.executable, "-m", "benchmarks", "x"], capture_output=True, text=True, cwd=ROOT, timeout=60
    )

    assert "palette-speed" in listed.stdout
    assert all(len(line.split(None, 1)) == 2 for line in listed.stdout.splitlines())
    assert unknown.returncode == 2
    assert "no benchmark is named 'x'" in unknown.stderr


def test_benchmarks_refuse_unknown_options(capsys, tmp_path):
    from benchmarks.__main__ import main as benchmarks

    assert benchmarks(["palette-spead"]) == 2 and "palette-speed" in capsys.readouterr().err
    assert benchmarks(["palette-speed", "--quik"]) == 2 and "no option --quik" in capsys.readouterr().err
    assert benchmarks(["reachable", "--out", __file__]) == 2 and "test_commands.py is a file" in capsys.readouterr().err
    assert benchmarks(["spectral-textures", "--pictures", "absent.png", "b.png", "--out", str(tmp_path)]) == 2
    assert "there is no file absent.png" in capsys.readouterr().err


CLI = [sys.executable, "-P", "-m", "spectral_core.cli"]
POSIX = pytest.mark.skipif(sys.platform == "win32", reason="pipes and /dev/full as Unix has them")


@POSIX
@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_a_terminal_without_utf_8_shows_plain_letters(encoding: str, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "LC_ALL": "C", "PYTHONUTF8": "0"}
    line = [*CLI, "design", "--preset", "hidden_mark", "--out", str(tmp_path / "out")]
    done = subprocess.run(line, capture_output=True, cwd=tmp_path, env=environment)

    assert done.returncode == 0, done.stderr
    assert b"dE2000" in done.stdout
    assert (tmp_path / "out" / "solution.json").is_file()


@POSIX
def test_a_closed_pipe_gives_no_error_and_the_files_are_written(tmp_path: Path) -> None:
    line = [*CLI, "design", "--preset", "hidden_mark", "--out", str(tmp_path / "out")]
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(line, stdout=writing, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    os.close(writing)

    assert "Traceback" not in done.stderr and "Exception" not in done.stderr
    assert done.returncode == 141
    assert (tmp_path / "out" / "solution.json").is_file()


CHILDREN = ("spectral_core/child", "spectral_core/explore/sweep", "spectral_core/render/", "spectral_core/cli/shared")
"""Programs that only other programs start."""


@POSIX
@pytest.mark.parametrize(
    "line",
    [
        ["-m", "benchmarks"],
        ["-m", "benchmarks", "--help"],
        ["-m", "spectral_core.cli", "--help"],
        ["-m", "spectral_core.cli", "--version"],
        ["-m", "blender_addon", "lattice", "--dims", "2", "--points", "8"],
        ["-m", "examples.more_scenes", "--help"],
        ["scripts/build_extension.py", "--help"],
        ["-c", "import runpy; say = runpy.run_path('scripts/setup.py')['say']; say('a'); say('b')"],
    ],
    ids=" ".join,
)
def test_every_program_ends_quietly_if_its_output_is_closed(line: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([sys.executable, *line], stdout=writing, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    os.close(writing)

    assert done.stderr == ""
    # argparse drops what it cannot print; the set-up finishes its work without a reader
    silent = {"-c", "--help", "--version"}.intersection(line)
    assert done.returncode in ((0, -13, 141) if silent else (141,))


def test_every_entry_point_expects_that_its_output_is_closed() -> None:
    """A program that lacks one of the three ways is named here."""
    folders = ("benchmarks", "examples", "scripts", "spectral_core", "blender_addon")
    found = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    entries = [
        path for path in found if path.name == "__main__.py" or '__name__ == "__main__"' in path.read_text("utf-8")
    ]
    ways = ("completed(main)", "SIG_DFL", "except BrokenPipeError", "cli import main", "commands import main")
    lacking = [
        name
        for path in entries
        if not (name := str(path.relative_to(ROOT))).startswith(CHILDREN)
        and not any(way in path.read_text("utf-8") for way in ways)
    ]
    assert len(entries) > 10
    assert lacking == []


def test_a_closed_pipe_of_a_child_is_not_taken_for_a_closed_output() -> None:
    def program() -> int:
        raise BrokenPipeError("of a child")

    with pytest.raises(BrokenPipeError, match="of a child"):
        completed(program)


def test_ctrl_c_ends_every_program_with_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    """While the modules of a command were imported, it gave a traceback."""

    def program() -> int:
        raise KeyboardInterrupt

    assert completed(program) == 130
    assert capsys.readouterr().err == "stopped\n"


@POSIX
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_a_stream_that_is_closed_from_the_start_is_no_fault(closed: str, tmp_path: Path) -> None:
    """Python has None in place of such a stream: its flush ended a finished command with a traceback."""
    line = shlex.join([*CLI, "lattice", "--points", "8", "--out", "points.csv"])
    done = subprocess.run(["sh", "-c", f"{line} {closed}"], capture_output=True, text=True, cwd=tmp_path)

    assert (done.returncode, done.stderr) == (0, "")
    assert len((tmp_path / "points.csv").read_text("utf-8").splitlines()) == 9


@POSIX
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("command", [["lattice", "--dims", "2", "--points", "8"], ["mix", "cyan:1"], []])
def test_an_output_without_space_gives_one_line(tmp_path: Path, command: list[str], unbuffered: str) -> None:
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered, "PYTHONPATH": str(ROOT)}
    words = [*CLI, *command] if command else [sys.executable, "-m", "benchmarks"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path, env=environment)

    assert done.returncode == 1
    prefix = "spectral-scene: " * bool(command)
    assert done.stderr == f"{prefix}the output cannot be written: No space left on device\n"


def test_json_has_no_nan(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lattice", "--dims", "1", "--points", "3", "--json"]) == 0
    printed = capsys.readouterr().out.splitlines()[-1]
    assert "NaN" not in printed and json.loads(printed)["evenness"]["fill_2d"] is None
