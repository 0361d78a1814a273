# SPDX-License-Identifier: GPL-3.0-or-later
"""Every entry of a sweep's document reaches the sweep, its project, and the project that a store reads back."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.explore.sweep.designs import Design
from spectral_core.explore.sweep.document import compute_node, read_sweep, sweep_of
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.project import Project
from spectral_core.explore.sweep.region import RegionOfInterest
from spectral_core.explore.sweep.sweep import difference, meanings
from tests.settings_walk import ignored_settings

EXAMPLES = Path(__file__).parents[3] / "examples"
PLAIN: dict[str, Any] = {
    "compute": {"kind": "function", "function": "package.module:name"},
    "parameters": [
        {"name": "a", "low": 1.0, "high": 2.0, "unit": "W", "scale": "linear", "kind": "real", "path": "p",
         "group": "g"},
        {"name": "b", "low": 1.0, "high": 3.0},
        {"name": "c", "kind": "choice", "choices": ["x", "y", "z"]},
    ],
    "design": {"kind": "lattice", "budget": 8, "seed": 0, "rate": 2},
    "region": {
        "ranges": {"a": [1.0, 2.0]}, "choices": {"c": ["x", "y"]}, "constraints": ["b <= 2.8"], "name": "middle",
        "ball": {"center": {"a": 1.5, "b": 2.0}, "radii": {"a": 0.5}, "p": 2.0},
    },
    "columns": {"d": "a + b"}, "reference": {"a": 1.0, "b": 2.0, "c": "x"}, "seed": 0,
}  # fmt: skip
OTHERS: dict[str, Any] = {
    "compute.function": "package.module:other", "compute.kind": "command",
    "parameters.name": None, "parameters.low": 0.9, "parameters.high": 2.5, "parameters.unit": "kW",
    "parameters.scale": "log", "parameters.kind": "integer", "parameters.path": "q", "parameters.group": "h",
    "parameters.choices": None,
    "design.kind": "sobol", "design.budget": 9, "design.seed": 5, "design.rate": 3,
    "design.points": None,
    "region.ranges": {"a": [1.2, 1.9]}, "region.choices": {"c": ["x"]}, "region.constraints": ["b <= 2.5"],
    "region.name": "edge", "region.ball": {"center": {"a": 1.5, "b": 2.0}, "radii": {"a": 0.25}, "p": 2.0},
    "columns.d": "a - b", "reference.a": 2.0, "seed": 1,
}  # fmt: skip
"""Another value for each entry; None where another test changes it (a name changes the whole document)."""


def test_every_entry_has_a_case() -> None:
    """Entries of the dataclasses of a document, so that a new field fails the test."""
    stated = {
        *(f"parameters.{each.name}" for each in fields(Parameter)),
        *(f"design.{each.name}" for each in fields(Design)),
        *(f"region.{each.name}" for each in fields(RegionOfInterest)),
    }
    made_here = {"design.frame", "design.shifts"}  # computed by the first run, which places the lattice
    assert stated - made_here == {
        name for name in OTHERS if name.partition(".")[0] in ("parameters", "design", "region")
    }


def document() -> dict[str, Any]:
    return json.loads(json.dumps(PLAIN))


def stored(plain: dict[str, Any]) -> Any:
    """Data of the sweep of a document, and of its project after a round trip through project.json."""
    sweep = sweep_of(plain, Path())
    project = sweep.project("fingerprint")
    again = Project.from_dict(json.loads(json.dumps(project.to_dict())), "project.json")
    assert again == project
    own = replace(again, store_id="")
    return [sweep.reference, sweep.seed, sweep.compute, own.to_dict()]


def test_every_entry_of_a_document_is_kept() -> None:
    plain = document()

    def holder(name: str) -> tuple[Any, str]:
        table, _, key = name.partition(".")
        return (plain, name) if not key else (plain[table][0] if table == "parameters" else plain[table], key)

    def read(name: str) -> Any:
        owner, key = holder(name)
        return owner[key]

    def write(name: str, value: Any) -> None:
        owner, key = holder(name)
        owner[key] = value

    names = [name for name, other in OTHERS.items() if other is not None]
    assert ignored_settings(names, read, write, OTHERS.__getitem__, lambda: stored(plain)) == {}


def test_names_and_options_of_a_document_are_kept() -> None:
    plain = document()
    plain["parameters"][2]["choices"].append("w")
    assert stored(plain) != stored(document())
    assert [parameter.name for parameter in sweep_of(plain, Path()).space.parameters] == ["a", "b", "c"]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [("b", "two", "b is 'two'; expected a finite number"), ("b", [2.0], "b is .2.0.; expected a finite number"),
     ("a", 1.5, "a is 1.5; expected a whole number"), ("c", 3, "c is 3; the choices are .'x', 'y', 'z'.")],
)  # fmt: skip
def test_a_reference_that_no_point_can_be_is_refused_before_the_points_are_computed(
    name: str, value: Any, reason: str
) -> None:
    """The points were computed, and compared with a point of half a count, or not at all."""
    plain = document()
    plain["parameters"][0]["kind"] = "integer"
    plain["reference"][name] = value
    with pytest.raises(InvalidInputError, match=rf"the value of the \[reference\] is wrong: {reason}"):
        sweep_of(plain, Path())


def test_a_reference_may_lie_beyond_the_ranges_and_has_the_types_of_the_parameters() -> None:
    plain = document()
    plain["parameters"][0]["kind"] = "integer"
    plain["reference"] = {"a": 40.0, "b": 7, "c": "exact"}
    found = sweep_of(plain, Path()).reference
    assert found == {"a": 40, "b": 7.0, "c": "exact"} and [type(one) for one in found.values()] == [int, float, str]


def test_listed_points_of_a_document_are_kept() -> None:
    point = {"a": 1.5, "b": 2.0, "c": "x"}
    plain, other = (document() | {"design": {"points": [each]}} for each in (point, point | {"a": 1.4}))
    assert stored(plain) != stored(other)
    assert sweep_of(plain, Path()).design.points == (point,)


def test_a_computed_column_does_not_take_the_name_of_a_parameter() -> None:
    """The expression replaced the values of the parameter in the table."""
    plain = document() | {"columns": {"b": "2 * a"}}
    with pytest.raises(InvalidInputError, match="computes 'b', which is a parameter; take another name"):
        sweep_of(plain, Path())


def test_a_value_is_set_once(tmp_path: Path) -> None:
    """The later of two entries for the same value counted, and the other one was lost without a word."""
    (tmp_path / "f.py").write_text("def f(a, b=1.0): return {'v': a + b}\n", "utf-8")
    shown = {"kind": "volume", "volume": "sample:gaussians:8", "size": [8, 8]}
    volume = {"kind": "volume", "volume": "sample:gaussians:8", "size": [8, 8], "transfer": "tf.json"}
    (tmp_path / "tf.json").write_text(json.dumps({
        "format": "spectral-scene transfer function", "version": 1,
        "materials": [{"name": "m", "values": [0, 1], "extinction": [0, 1], "color": "#ffffff"}],
    }), "utf-8")  # fmt: skip
    palette = {"kind": "palette", "palette": str(EXAMPLES / "metamer_pair.toml")}
    function = {"kind": "function", "function": "f.py:f"}

    def made(compute: dict[str, Any], *paths: str) -> Any:
        tables = [
            {"name": name, "low": 1.0, "high": 2.0, "path": path} for name, path in zip("ab", paths, strict=False)
        ]
        sweep = sweep_of({"compute": compute, "parameters": tables}, tmp_path)
        return compute_node(sweep.compute, sweep.space, tmp_path)

    first, again = "transfer.materials[m].extinction[1]", "transfer.materials[0].extinction[-1]"
    for compute, paths in (
        (function | {"fixed": {"a": 3.0}}, ("",)),
        (shown | {"settings": {"zoom": 2.0}}, ("zoom",)),
        (shown, ("zoom", "zoom")),
        (volume, (first, again)),
        (palette, ("smoothness", "smoothness")),
    ):
        with pytest.raises(InvalidInputError, match="leave out one of them"):
            made(compute, *paths)
    made(function | {"fixed": {"b": 3.0}}, "")
    made(shown | {"settings": {"zoom": 2.0}}, "azimuth", "elevation")
    made(volume, first, "transfer.materials[0].extinction[0]")


def test_a_path_that_nothing_reads_is_refused(tmp_path: Path) -> None:
    """A function got the value under the parameter's name, whatever its path."""
    (tmp_path / "f.py").write_text("def f(a, b=1.0): return {'v': a + b}\n", "utf-8")
    tables = [{"name": "a", "low": 0.0, "high": 1.0, "path": "b"}]
    for compute in ({"kind": "function", "function": "f.py:f"}, {"kind": "command", "command": "echo {a}"}):
        sweep = sweep_of({"compute": compute, "parameters": tables}, tmp_path)
        with pytest.raises(InvalidInputError, match="path 'b', which kind = .* does not read"):
            compute_node(sweep.compute, sweep.space, tmp_path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_sweep_file_is_read_in_the_encodings_of_all_documents(tmp_path: Path, encoding: str) -> None:
    """Editors on Windows save with a mark of the encoding: a palette was read, a sweep was "not TOML"."""
    text = '[compute]\nkind = "function"\nfunction = "a.py:f"\n[[parameters]]\nname = "é"\nlow = 0\nhigh = 1\n'
    (tmp_path / "s.toml").write_text(text, encoding)
    assert read_sweep(tmp_path / "s.toml").space.names == ("é",)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'name = "caf\xe9"\n', "line 1: not UTF-8 text; save the file as UTF-8"),
        (b"", "line 1: the file is empty"),
        (b"a = " + b"[" * 5000, "nested"),
        (b"x" + b".x" * 40000 + b" = 1\n", "dots"),
        (b"[compute\n", "expected a sweep in TOML"),
    ],
)
def test_a_sweep_file_that_is_none_is_refused_by_the_reader_of_all_documents(
    tmp_path: Path, content: bytes, message: str
) -> None:
    (tmp_path / "s.toml").write_bytes(content)
    with pytest.raises(FileFormatError, match=message) as refused:
        read_sweep(tmp_path / "s.toml")
    assert "s.toml" in str(refused.value)


def test_a_refused_folder_names_the_first_difference_of_its_parameters() -> None:
    """That they differ was said alone, and a renamed lamp was to be guessed."""
    lamp = Parameter("watts", 1, 100, path='bpy.data.lights["Key"].energy')
    kind = Parameter("kind", kind="choice", choices=("POINT", "AREA"))
    stored = Space((lamp, kind))
    for here, said in (
        (Space((lamp,)), "this sweep has no 'kind'"),
        (Space((lamp, kind, Parameter("more"))), "the folder has no 'more'"),
        (Space((Parameter("watts", 2, 9, path='bpy.data.lights["Sun"].energy'), kind)),
         f"""'watts' has the path bpy.data.lights["Sun"].energy here, and {lamp.path} in the folder"""),
        (Space((lamp, Parameter("kind", kind="choice", choices=("POINT", "SUN")))),
         "'kind' has the choices POINT, SUN here, and POINT, AREA in the folder"),
        (Space((kind, lamp)), "they have another order, which is watts, kind in the folder"),
    ):  # fmt: skip
        assert meanings(here) != meanings(stored) and difference(here, stored) == said
    assert meanings(Space((Parameter("watts", 5, 6, "W", path=lamp.path), kind))) == meanings(stored)
