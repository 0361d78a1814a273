# SPDX-License-Identifier: GPL-3.0-or-later
"""All documents: equal words everywhere, documents of earlier versions open, errors state the position."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.documents import Schema, read_document, write_document
from spectral_core.documents.codecs import SpectrumFiles, decoded_color, decoded_grid, decoded_spectrum
from spectral_core.documents.schema import KNOWN_WORDS
from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.explore.board.recording import RECORDING_SCHEMA, Recording
from spectral_core.palette import presets
from spectral_core.palette.files import read_palette, read_solution, write_palette
from spectral_core.palette.files.document import PALETTE_SCHEMA, document_of
from spectral_core.spectra import catalogue
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import SpectralGrid
from spectral_core.volume.documents.transfer_document import TRANSFER_SCHEMA
from spectral_core.volume.documents.transfer_document import document_of as transfer_document_of
from spectral_core.volume.documents.transfer_file import read_transfer, write_transfer

DATA = Path(__file__).parent / "data"
"""Written by version 0.1.0 in November 2026; these files stay unchanged."""
SCHEMAS = [PALETTE_SCHEMA, TRANSFER_SCHEMA, RECORDING_SCHEMA]
TRANSFER = (
    'format = "spectral-scene transfer function"\nversion = 1\n[grid]\nstart_nm = 400\nstop_nm = 700\nstep_nm = 10\n'
)
MATERIAL = '[[materials]]\nname = "a"\nvalues = [0, 1]\nemission = [0, 1]\nlit = false\ncolor = '


@pytest.mark.parametrize("ending", ["toml", "json"])
def test_palettes_of_the_first_version_open(ending: str) -> None:
    stored = json.loads((DATA / "hidden_mark_v1.json").read_text())
    assert json.loads(json.dumps(document_of(read_palette(DATA / f"hidden_mark_v1.{ending}")))) == stored


def test_a_solution_of_the_first_version_opens() -> None:
    solution = read_solution(DATA / "hidden_mark_solution_v1.json")
    assert document_of(solution.problem) == document_of(read_palette(DATA / "hidden_mark_v1.json"))
    assert solution.reflectances


@pytest.mark.parametrize("name", ["painted_v1.toml", "painted_v1.json", "solid_v1.toml"])
def test_transfer_functions_of_the_first_version_open(name: str, tmp_path: Path) -> None:
    stated = read_transfer(DATA / name)
    write_transfer(tmp_path / "again.toml", stated)
    assert transfer_document_of(read_transfer(tmp_path / "again.toml")) == transfer_document_of(stated)


def test_a_recording_of_the_first_version_opens() -> None:
    recording = Recording.load(DATA / "motion_v1.json")
    assert recording.targets == ("a", "b")
    np.testing.assert_array_equal(recording.positions, [[0, 0.25], [0.5, 0.25], [1, 0]])


@pytest.mark.parametrize("words", ['"D65"', '{catalogue = "D65"}', '{catalogue = "D65", luminance = 2}'])
def test_a_transfer_function_uses_the_words_of_a_palette(words: str, tmp_path: Path) -> None:
    (tmp_path / "t.toml").write_text(TRANSFER + MATERIAL + words + "\n")
    color = read_transfer(tmp_path / "t.toml").transfer.colors[0]
    d65 = catalogue.illuminant("D65")
    expected = normalized(d65, luminance=2) if "luminance" in words else d65
    np.testing.assert_allclose(color, expected.resampled(SpectralGrid.uniform(400, 700, 10), average=True).values)


def test_recordings_are_written_in_either_format(tmp_path: Path) -> None:
    recording = Recording(("a",), np.array([0.0, 0.1]), np.array([[0.0], [1.0]]))
    for name in ("r.json", "r.toml"):
        recording.save(tmp_path / name)
        np.testing.assert_array_equal(Recording.load(tmp_path / name).positions, recording.positions)


def test_an_empty_recording_is_read_back(tmp_path: Path) -> None:
    Recording(("a", "b"), np.zeros(0), np.zeros((0, 2))).save(tmp_path / "r.json")
    assert Recording.load(tmp_path / "r.json").positions.shape == (0, 2)


def test_shared_words_have_one_meaning() -> None:
    """Every schema defines grids, spectra and colors equally."""
    ours, theirs = (schema.content["$defs"] for schema in (PALETTE_SCHEMA, TRANSFER_SCHEMA))
    for name in ("grid", "spectrumTable", "color", "triple", "numbers"):
        assert ours[name] == theirs[name], name


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda schema: schema.name)
def test_schemas_use_only_keywords_that_are_checked(schema: Schema) -> None:
    def words(node: Any, named: bool = False) -> set[str]:
        if isinstance(node, list):
            return set().union(*map(words, node)) if node else set()
        if not isinstance(node, dict):
            return set()
        inner = (words(value, not named and key in ("properties", "$defs")) for key, value in node.items())
        return set().union(set() if named else set(node), *inner)

    assert words(schema.content) <= KNOWN_WORDS


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 20_000, "nested deeper than 60"),
        ('{"format": ' + "9" * 5000 + "}", "digit"),
        ('{"a": 1e999}', "has no 'format'|unknown entry"),
        ('{"format": "spectral-scene palette", "version": true}', "has no 'grid'"),
        ("{}", "has no 'format'"),
        ("[]", "expected a table"),
        ("", "empty"),
        ("{", "in JSON"),
        ("\x00", "binary"),
    ],
)
@pytest.mark.parametrize("reader", [read_palette, read_transfer, Recording.load, read_solution])
def test_invalid_documents_are_refused_with_their_file(reader: Any, text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "odd.json"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=message if reader is read_palette else None) as caught:
        reader(path)
    assert str(path) in str(caught.value)


def test_true_is_no_version_number() -> None:
    document = {**document_of(presets.hidden_mark()), "version": True}
    with pytest.raises(FileFormatError, match="version is true; expected 1"):
        PALETTE_SCHEMA.require_valid(document)


@pytest.mark.parametrize("text", ["a = " + "[" * 20_000, "a." * 20_000 + "b = 1", "a = " + "1" * 5000])
def test_invalid_toml_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "odd.toml").write_text(text)
    with pytest.raises(FileFormatError, match=r"odd\.toml"):
        read_palette(tmp_path / "odd.toml")


def test_a_device_as_spectrum_file_is_refused(tmp_path: Path) -> None:
    write_palette(tmp_path / "p.json", presets.hidden_mark())
    document = json.loads((tmp_path / "p.json").read_text())
    document["lights"][0]["spectrum"] = {"file": "/dev/zero"}
    (tmp_path / "p.json").write_text(json.dumps(document))
    with pytest.raises(FileFormatError, match="folder, pipe or device"):
        read_palette(tmp_path / "p.json")


def test_a_small_file_cannot_state_a_huge_table(tmp_path: Path) -> None:
    document = document_of(presets.hidden_mark())
    document["lights"], document["cells"] = document["lights"][:1] * 2000, []
    document["reflectances"] = [{"name": str(k)} for k in range(2000)]
    write_document(tmp_path / "p.json", document)
    with pytest.raises(FileFormatError, match="at most 100,000 cells"):
        read_palette(tmp_path / "p.json")


def test_numbers_beyond_a_float_are_refused() -> None:
    grid = SpectralGrid.uniform(400, 700, 10)
    with pytest.raises(InvalidInputError):
        decoded_spectrum({"values": [10**400] * 31}, "illuminant", grid, SpectrumFiles(Path()))
    with pytest.raises(InvalidInputError):
        decoded_grid({"start_nm": 10**400, "stop_nm": 2, "step_nm": 1})
    with pytest.raises(InvalidInputError, match="#rrggbb"):
        decoded_color("#12")


def test_an_unknown_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match=r"name sweeps \.toml or \.json"):
        write_document(tmp_path / "x.yaml", {}, what="sweeps")
    assert read_document(_written(tmp_path), lambda document, folder: (document, folder), "a sweep") == (
        {"a": [1.5, {"b": "c"}]},
        tmp_path,
    )


def _written(folder: Path) -> Path:
    write_document(folder / "x.toml", {"a": [1.5, {"b": "c"}]}, comment="hello")
    return folder / "x.toml"


def test_an_entry_that_is_stated_twice_is_refused(tmp_path: Path) -> None:
    """Of two entries of a JSON table the first was dropped without a word; TOML files were refused already."""
    write_palette(tmp_path / "p.json", presets.hidden_mark())
    text = (tmp_path / "p.json").read_text()
    (tmp_path / "p.json").write_text(text.replace('"mode": "fixed"', '"mode": "black", "mode": "fixed"', 1))
    with pytest.raises(FileFormatError, match=r"p\.json: one table states the entry 'mode' more than once"):
        read_palette(tmp_path / "p.json")


def test_a_comment_that_toml_cannot_state_is_refused(tmp_path: Path) -> None:
    """The file was written, and could not be read."""
    with pytest.raises(InvalidInputError, match=r"control character '\\x00'; remove it"):
        write_document(tmp_path / "p.toml", {"a": 1}, comment="one\ntwo\0")
    assert not (tmp_path / "p.toml").exists()
