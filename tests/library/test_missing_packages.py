# SPDX-License-Identifier: GPL-3.0-or-later
"""A missing package is named with a remedy that its reader can carry out, in a terminal and within Blender."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

from spectral_core import errors
from spectral_core.cli import doctor

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def within_blender(monkeypatch):
    """The core as Blender installs it: alone, from a wheel."""
    found = importlib.util.find_spec
    for name in [each for each in sys.modules if each.partition(".")[0] == "blender_addon"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(errors, "find_spec", lambda name: None if name == "blender_addon" else found(name))


def test_a_terminal_gets_the_extra() -> None:
    error = errors.MissingDependencyError.package("python-rtmidi", "a MIDI mixing board", "board")
    assert str(error).endswith("needs the Python package 'python-rtmidi'; install it with: "
                               "pip install 'spectral-scene[board]'")  # fmt: skip


@pytest.mark.usefixtures("within_blender")
def test_blender_gets_a_command_for_its_own_python(monkeypatch) -> None:
    """pip of a terminal installs packages where Blender does not look for them."""
    monkeypatch.setattr(errors.sys, "executable", "/opt/blender/5.2/python/bin/python3.13")
    text = str(errors.MissingDependencyError.package("python-rtmidi", "a MIDI mixing board", "board"))
    assert "/opt/blender/5.2/python/bin/python3.13 -m pip install python-rtmidi" in text
    assert "spectral-scene[" not in text


@pytest.mark.usefixtures("within_blender")
@pytest.mark.parametrize("package", sorted(errors.CARRIED))
def test_what_the_extension_carries_is_installed_with_it(package) -> None:
    """pip was named for packages without an extra, such as the solvers, and for those of faders."""
    text = str(errors.MissingDependencyError.package(package, "rendering", "render"))
    assert "install the extension again" in text and "pip" not in text


@pytest.mark.usefixtures("within_blender")
def test_doctor_within_blender_names_remedies_for_it(monkeypatch) -> None:
    """It printed the extras of a distribution that Blender's extension is not."""
    monkeypatch.setattr(errors.sys, "executable", "/opt/blender/5.2/python/bin/python3.13")
    monkeypatch.setattr(doctor.util, "find_spec", lambda _: None)
    remedies = {entry[1]: doctor._package(*entry).remedy for entry in doctor.PACKAGES}
    assert not [remedy for remedy in remedies.values() if "spectral-scene[" in remedy]
    for carried in ("mitsuba", "daqp", "piqp", "mido", "python-osc"):
        assert "install the extension again" in remedies[carried]
    assert remedies["matplotlib"].startswith("install it with: /opt/blender/5.2/python/bin/python3.13 -m pip install ")


def test_the_extension_carries_these_packages() -> None:
    """All that it contains, but what its packages need themselves and no message names."""
    spec = importlib.util.spec_from_file_location("_build", ROOT / "scripts" / "build_extension.py")
    assert spec is not None and spec.loader is not None
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    of_others = {"importlib_resources", "typing_extensions", "packaging"}
    assert set(build.BUNDLED) - of_others == set(errors.CARRIED)
    named = {entry[1] for entry in doctor.PACKAGES}
    assert named >= errors.CARRIED and not of_others & named
