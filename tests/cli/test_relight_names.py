# SPDX-License-Identifier: GPL-3.0-or-later
"""Light groups on the command line of ``relight`` by any name that Blender allows."""

from __future__ import annotations

from pathlib import Path

import pytest

from spectral_core.cli import _parsed
from spectral_core.cli.relight import _dial_weights, _pairs
from spectral_core.errors import InvalidInputError

GROUPS = ("Key", "Lamp, left", "Lamp", "a=b", "", "Lamp, left, far", " Rim", " Key", "Sky ")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Key=0.3,Lamp=1", {"Key": "0.3", "Lamp": "1"}),
        ("Lamp, left=0.3 , Lamp=2", {"Lamp, left": "0.3", "Lamp": "2"}),
        ("Lamp=2,Lamp, left, far=3,Lamp, left = 1", {"Lamp": "2", "Lamp, left, far": "3", "Lamp, left": "1"}),
        ("a=b=4,=0.5", {"a=b": "4", "": "0.5"}),
        ("Key=my, own.csv@x,Lamp=HP1", {"Key": "my, own.csv@x", "Lamp": "HP1"}),
        ("Kye=1,Key=2", {"Kye": "1", "Key": "2"}),
        (" Rim=1, Lamp=2", {" Rim": "1", "Lamp": "2"}),
        ("Lamp=2,  Rim=1, Key=3,Key=4,Sky =5", {"Lamp": "2", " Rim": "1", " Key": "3", "Key": "4", "Sky ": "5"}),
        ("", {}),
        ("Key=1, ,", {"Key": "1"}),
    ],
)
def test_names_and_files_may_contain_commas_and_equal_signs(text: str, expected: dict[str, str]) -> None:
    assert _pairs("--mix", text, GROUPS) == expected


@pytest.mark.parametrize("text", ["Key", "Key=", "Lamp, left", "0.3,Key=1"])
def test_a_part_without_group_or_value_is_named(text: str) -> None:
    with pytest.raises(InvalidInputError, match="not of the form GROUP=VALUE"):
        _pairs("--mix", text, GROUPS)


@pytest.mark.parametrize("text", [",", " , "])
def test_a_text_without_any_group_is_refused(text: str) -> None:
    with pytest.raises(InvalidInputError, match="names no light group; expected GROUP=VALUE"):
        _pairs("--mix", text, GROUPS)


def test_a_group_is_named_once(tmp_path: Path) -> None:
    """The last of two amounts was taken without a word."""
    with pytest.raises(InvalidInputError, match="'Lamp, left' twice"):
        _pairs("--mix", "Lamp, left=1,Key=2,Lamp, left=3", GROUPS)


def test_a_dial_may_have_one_light() -> None:
    """As in Blender, where it has all of the weight everywhere."""
    arguments = _parsed(["relight", "t.exr", "--dial", "-0.5,0.3;1,0", "--frames", "3", "--out", "p.png"], ())[0]
    assert _dial_weights(arguments, 1).tolist() == [[1.0]] * 3


@pytest.mark.parametrize("dial", ["-0.5,0.3", "-.5,0.3", "-1e-3,0;0,-1", "0,1"])
def test_a_place_on_the_dial_may_be_negative(dial: str) -> None:
    """The parser took it for an option."""
    assert _parsed(["relight", "t.exr", "--dial", dial, "--out", "p.png"], ())[0].dial == dial


def test_ranges_may_begin_with_a_small_negative_number(capsys: pytest.CaptureFixture[str]) -> None:
    found = _parsed(["lattice", "--low", "-1e-3", "-2", "-.5", "--high", "1E2"], ())[0]
    assert (found.low, found.high) == ([-1e-3, -2.0, -0.5], [100.0])
    with pytest.raises(SystemExit):
        _parsed(["lattice", "--low", "--high", "1"], ())
    with pytest.raises(SystemExit):
        _parsed(["lattice", "-1e-3"], ())
    assert "'-1e-3'" in capsys.readouterr().err
