# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `mix`, compared with the mixing laws."""

from __future__ import annotations

import json

import numpy as np
import pytest

from spectral_core import cli
from spectral_core.spectra.catalogue import reflectance
from spectral_core.spectra.files import read_spectra


@pytest.mark.parametrize("law", ["paint", "additive"])
def test_mixtures_follow_their_law(tmp_path, capsys, law) -> None:
    words = ["mix", "cyan:3", "blue:1", "--law", law, "--out", str(tmp_path / "m.csv"), "--json"]
    assert cli.main(words) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    nm = np.array(figures["wavelengths_nm"])
    a, b = (reflectance(name).at(nm) for name in ("cyan", "blue"))
    ratio = 0.75 * (1 - a) ** 2 / (2 * a) + 0.25 * (1 - b) ** 2 / (2 * b)
    expected = 1 + ratio - np.sqrt(ratio**2 + 2 * ratio) if law == "paint" else 0.75 * a + 0.25 * b
    np.testing.assert_allclose(figures["reflectance"], expected, atol=1e-9)
    np.testing.assert_allclose(read_spectra(tmp_path / "m.csv")[0].at(nm), expected, atol=1e-5)
    assert cli.main(["mix", f"{tmp_path / 'm.csv'}@mixture:1"]) == 0


@pytest.mark.parametrize("word", ["cyan", "cyan:none", "cyan:-1", "cyan:0"])
def test_invalid_parts_are_refused(capsys, word) -> None:
    assert cli.main(["mix", word]) == 1
    assert "expected NAME:PARTS" in capsys.readouterr().err


def test_a_color_that_no_display_shows_is_stated(tmp_path, capsys) -> None:
    """The hexadecimal color was cut at the ends of its channels without a word."""
    path = tmp_path / "red.csv"
    path.write_text("nm,red\n" + "".join(f"{nm},{1.0 if nm > 600 else 0.0}\n" for nm in range(380, 781, 5)))
    assert cli.main(["mix", f"{path}@red:1", "--law", "additive", "--light", "A"]) == 0
    assert "no display shows it" in capsys.readouterr().out
    assert cli.main(["mix", "dark skin:1", "--light", "D65"]) == 0
    assert "no display" not in capsys.readouterr().out
