# SPDX-License-Identifier: GPL-3.0-or-later
"""``spectral-scene doctor``: every package is listed, and missing ones have a remedy."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.test_commands import ROOT, without


def test_doctor_lists_missing_parts_with_remedies() -> None:
    done = without(["bpy", "mitsuba", "cvxpy"], "doctor", "--json")
    report = json.loads(done.stdout.splitlines()[-1])

    assert done.returncode == 0
    assert report["ok"]
    assert not report["complete"]
    for absent in ("bpy", "mitsuba"):
        (finding,) = [entry for entry in report["findings"] if entry["name"] == absent]
        assert not finding["ok"]
        assert "pip install 'spectral-scene[" in finding["remedy"]
    assert re.search(r"MISSING  cvxpy .*\n.*no command needs it", done.stdout)


def test_doctor_has_a_line_for_every_optional_package() -> None:
    import tomllib

    from spectral_core.cli.doctor import PACKAGES

    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    named = {re.split(r"[^\w-]", each)[0].lower() for name in set(extras) - {"all", "dev"} for each in extras[name]}
    assert named <= {distribution.lower() for _, distribution, _, _ in PACKAGES}


def test_doctor_knows_every_optional_package() -> None:
    """Pillow, flip-evaluator and dask were not in its list."""
    import tomllib

    from spectral_core.cli.doctor import PACKAGES

    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]
    extras = {name: words for name, words in project["optional-dependencies"].items() if name not in ("all", "dev")}
    wanted = {(re.split(r"[><=;\s]", word)[0], extra) for extra, words in extras.items() for word in words}
    assert wanted == {(distribution, extra) for _, distribution, _, extra in PACKAGES if extra}
    required = {re.split(r"[><=;\s]", word)[0] for word in project["dependencies"]}
    assert required == {distribution for _, distribution, _, extra in PACKAGES if not extra}


def test_doctor_is_not_content_without_a_required_package() -> None:
    """It was content without every package but numpy and scipy."""
    absent = ["daqp", "threadpoolctl"]
    done = without([*absent, "bpy", "mitsuba"], "doctor", "--json")  # without these two, it tries no renders
    report = json.loads(done.stdout.splitlines()[-1])
    assert done.returncode == 1 and not report["ok"]
    for name in absent:
        assert f"MISSING  {name}" in done.stdout and f"pip install {name}\n" in done.stdout


def test_every_preset_is_designed_without_cvxpy(tmp_path: Path) -> None:
    """``doctor`` said that most-distinct palettes need it."""
    for preset in ("Most distinct", "Hidden mark"):
        done = without(["cvxpy"], "design", "--preset", preset, "--out", str(tmp_path / "out"), "--rounds", "1")
        assert done.returncode == 0, done.stderr


def test_doctor_ignores_other_output_of_a_part(monkeypatch) -> None:
    """Blender may print a warning before anything else."""
    from spectral_core.cli import doctor

    printed = f"Unable to find something\n{doctor.MARK}5.0.1\nfreed 3 blocks\n"
    done = subprocess.CompletedProcess([], 0, printed, "")
    monkeypatch.setattr(doctor.subprocess, "run", lambda *args, **options: done)
    assert doctor._trial("bpy")[1] == "5.0.1"


def test_without_llvm_the_renderer_states_no_error_of_its_own() -> None:
    """It said ": a trial render failed", with the whole message once more, and "see the error above"."""
    pytest.importorskip("mitsuba")
    environment = {**os.environ, "DRJIT_LIBLLVM_PATH": "/nowhere/libLLVM.so"}
    line = [sys.executable, "-m", "spectral_core.cli", "doctor"]
    done = subprocess.run(line, capture_output=True, text=True, cwd=ROOT, env=environment)
    lines = done.stdout.splitlines()
    (number,) = [number for number, each in enumerate(lines) if each.startswith("MISSING  renderer")]
    assert lines[number].split(maxsplit=2)[2] == "it cannot start without LLVM"
    assert "DRJIT_LIBLLVM_PATH names /nowhere/libLLVM.so, which is not there" in lines[number - 1]
