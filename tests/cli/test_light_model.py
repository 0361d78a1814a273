# SPDX-License-Identifier: GPL-3.0-or-later
"""The command that compares light models: its figures compared with the library, and its files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.spectra import catalogue, observer
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.files import write_spectra
from spectral_core.spectra.observer import xyz_from_product
from spectral_core.spectra.spectrum import SpectralGrid


def printed(capsys: pytest.CaptureFixture[str]) -> dict[str, dict[str, float]]:
    return json.loads(capsys.readouterr().out.splitlines()[-1])["models"]


def test_errors_of_each_model_have_the_known_size(capsys) -> None:
    """Nodes of the surfaces are exact, eight natural nodes have ΔE below 1, RGB is far off under a sodium lamp."""
    assert main(["light-model", "--light", "HP1", "--json"]) == 0
    models = printed(capsys)
    assert models["nodes of the surfaces"]["largest"] < 1e-6
    assert models["8 nodes"]["mean"] < 1 < 5 < models["RGB under D65"]["mean"]
    assert models["8 nodes"]["mean"] < models["6 nodes"]["mean"]


def test_the_written_model_gives_the_colors_of_surfaces_from_a_file(tmp_path: Path) -> None:
    red, gray = catalogue.reflectance("red"), catalogue.reflectance("neutral 5 (.70 D)")
    write_spectra(tmp_path / "mine.csv", [red, gray])
    out = tmp_path / "model.json"
    words = ["light-model", "--surface", f"{tmp_path / 'mine.csv'}@red", "--light", "A", "--out", str(out)]
    assert main([*words, "--keep", "nodes of the surfaces"]) == 0
    model = json.loads(out.read_text("utf-8"))
    shown = np.array(model["linear_rgb_from_coefficients"]["A"]) @ model["surfaces"]["red"]
    grid = SpectralGrid(model["wavelengths_nm"])
    light = observer.normalized(catalogue.illuminant("A"))
    exact = RGB_FROM_XYZ @ xyz_from_product(light, grid) @ red.at(grid.wavelengths_nm)
    np.testing.assert_allclose(shown, exact, atol=1e-9)


def test_unknown_models_and_files_are_reported(tmp_path: Path, capsys) -> None:
    assert main(["light-model", "--keep", "11 nodes", "--out", str(tmp_path / "model.json")]) == 1
    assert "did you mean '9 nodes'" in capsys.readouterr().err
    write_spectra(tmp_path / "mine.csv", [catalogue.reflectance("red"), catalogue.reflectance("green")])
    assert main(["light-model", "--surface", str(tmp_path / "mine.csv")]) == 1
    assert "holds 2 spectra" in capsys.readouterr().err


def test_a_light_without_blue_is_named(tmp_path: Path, capsys) -> None:
    """The message was that intervals of a basis sharpen two vectors into one."""
    (tmp_path / "lamp.csv").write_text("nm,red\n690,0\n700,1\n900,1\n")
    assert main(["light-model", "--light", "D65", "--light", str(tmp_path / "lamp.csv")]) == 1
    assert "light 'red' has the white XYZ" in capsys.readouterr().err


def test_a_model_that_the_lights_do_not_determine_is_left_out(tmp_path: Path, capsys) -> None:
    """One lamp that is dark in a third of the spectrum has no factors, and the other models are compared."""
    (tmp_path / "lamp.csv").write_text("nm,lamp\n380,0\n550,0\n560,1\n570,1\n580,0\n780,0\n")
    lamp, surface = str(tmp_path / "lamp.csv"), "cyan"
    assert main(["light-model", "--light", lamp, "--surface", surface, "--json"]) == 0
    models = printed(capsys)
    assert "8 nodes" in models and "3 components" in models and "3 factors" not in models


def test_a_peak_between_steps_of_five_nanometers_counts(tmp_path: Path, capsys) -> None:
    """Surfaces were sampled each 5 nm: an error of 0 was stated for a filter whose color was off by ΔE 12."""
    nm = np.arange(380.0, 781.0)
    peak = np.exp(-0.5 * ((nm - 587.6) / 1.2) ** 2)
    lines = [f"{wavelength:g},{value:.17g}" for wavelength, value in zip(nm, peak, strict=True)]
    (tmp_path / "filter.csv").write_text("\n".join(["nm,filter", *lines]) + "\n")
    out = tmp_path / "model.json"
    words = ["light-model", "--surface", str(tmp_path / "filter.csv"), "--light", "FL11", "--out", str(out), "--json"]
    assert main([*words, "--keep", "nodes of the surfaces"]) == 0
    assert printed(capsys)["nodes of the surfaces"]["largest"] < 1e-6
    model = json.loads(out.read_text("utf-8"))
    shown = np.array(model["linear_rgb_from_coefficients"]["FL11"]) @ model["surfaces"]["filter"]
    light = observer.normalized(catalogue.illuminant("FL11"))
    fine, eye = np.linspace(380, 780, 80_001), observer.observer("cie_1931_2deg")
    power = np.interp(fine, light.grid.wavelengths_nm, light.values) * np.interp(fine, nm, peak)
    matching = np.array([np.interp(fine, eye.wavelengths_nm, row) for row in eye.cmfs])
    white = np.interp(fine, light.grid.wavelengths_nm, light.values) @ matching[1]
    np.testing.assert_allclose(shown, RGB_FROM_XYZ @ (matching @ power) / white, rtol=1e-4, atol=1e-6)
