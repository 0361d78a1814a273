# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheel, installed alone, has its data and its command line."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the contents of the built wheel."""
    out = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "build", "--wheel", "--outdir", str(out), str(ROOT)]
    done = subprocess.run(build, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    (wheel,) = out.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(out / "site")
    return out / "site"


def run_installed(site: Path, code: str) -> str:
    """Run code that can import the unpacked wheel and the dependencies, but not this checkout."""
    hidden = f"import sys; sys.path[:] = [{str(site)!r}] + [p for p in sys.path if p not in ('', {str(ROOT)!r})]\n"
    environment = {**os.environ, "PYTHONPATH": ""}
    done = subprocess.run([sys.executable, "-c", hidden + code], capture_output=True, text=True, cwd=site,
                          env=environment)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_wheel_contains_its_data(installed: Path) -> None:
    """Tables, schemas and license are included; tests and benchmarks are not."""
    names = {path.relative_to(installed).as_posix() for path in installed.rglob("*") if path.is_file()}

    assert {"spectral_core/spectra/data/observers.csv", "spectral_core/spectra/data/illuminants.csv"} <= names
    assert any(name.endswith("LICENSE") for name in names)
    assert not [name for name in names if name.startswith(("tests/", "benchmarks/", "docs/"))]


def test_installed_core_solves_a_palette(installed: Path) -> None:
    out = run_installed(
        installed,
        "import spectral_core; print(spectral_core.__file__)\n"
        "from spectral_core.palette import presets, solve_palette\n"
        "print(solve_palette(presets.hidden_mark()).status)",
    )
    file, status = out.splitlines()

    assert file.startswith(str(installed))
    assert status == "solved"


def test_the_installed_command_line_runs(installed: Path) -> None:
    out = run_installed(installed, "from blender_addon.commands import main; main(['doctor', '--json'])")

    report = json.loads(out.splitlines()[-1])
    assert report["ok"]
    assert {finding["name"] for finding in report["findings"]} >= {"Python", "numpy", "mitsuba", "bpy"}
