# SPDX-License-Identifier: GPL-3.0-or-later
"""Which options a call refuses because it would ignore them: by the other options of the call."""

from __future__ import annotations

import argparse
import importlib

import pytest

from spectral_core.cli import main

SERVED, DRAWN = {"port", "workers"}, {"color", "by", "time", "weights", "norm"}
OF_TEXTURES, SLOPE = {"daylight_share", "led_width"}, {"slope"}
CALLS: dict[str, list[tuple[str, set[str], set[str]]]] = {
    "explore": [
        ("sweep", DRAWN | SERVED | {"columns"}, {"out", "no_thumbnails"}),
        ("sweep --clusters 3", SERVED, {"columns", "out"}),
        ("sweep --embed gaussian", SERVED, {"columns"}),
        ("sweep --figure matrix.png", SERVED | {"by", "time"}, {"columns", "color"}),
        ("sweep --error-time time.png", SERVED | {"color"}, {"columns", "by", "time"}),
        ("sweep --distance 7 --weights a=1", {"columns"}, {"weights", "norm"}),
        ("sweep --serve", {"out", "no_thumbnails"}, SERVED),
    ],
    "sweep": [
        ("s.toml", set(), {"budget", "workers", "retry"}),
        ("s.toml --pending", {"budget"}, {"workers"}),
        ("s.toml --plan", {"retry", "workers", "dask", "shell", "share", "collect"}, {"budget"}),
        ("s.toml --plan --share 1/2", {"workers", "shell", "collect"}, {"budget"}),
        ("s.toml --share 1/2", {"budget", "pending", "retry", "workers"}, {"collect"}),
        ("s.toml --shell 2", {"workers"}, {"budget"}),
        ("s.toml --collect", {"workers", "budget", "pending"}, {"retry"}),
        ("s.toml --dask tcp://one:8786", {"workers"}, {"budget"}),
    ],
    "relight": [("t.exr", {"dial", "frames"}, set()), ("t.exr --out p.npy --dial 0,1", {"frames"}, {"dial"}),
                ("t.exr --out p.npy --dial 0,1;1,0", set(), {"dial", "frames"})],
    "light_model": [("", {"keep"}, set()), ("--out model.json", set(), {"keep"})],
    "recipe": [("lamp lamps.csv", {"paper", "dot_gain", "grams", "target"}, {"cct", "cri"}),
               ("inks surfaces.csv", {"cct", "cri", "grams"}, {"paper", "dot_gain", "target"}),
               ("paints surfaces.csv", {"cct", "dot_gain"}, {"grams", "target"})],
    "texture": [("one.png two.png --out f", set(), OF_TEXTURES | SLOPE), ("project.toml --out f", {"spectra"}, set()),
                ("one.png --out f", {"daylight_share"}, {"spectra"}),
                ("one.png two.png --exact --out f", SLOPE, {"floor"}),
                ("one.png two.png --light A --light FL2 --out f", OF_TEXTURES, {"spectra"})],
    "volume": [("sample:engine --transfer wide", {"field", "component", "raw_shape", "raw_offset"}, {"spacing"}),
               ("a.raw --transfer wide", {"raw_order", "raw_offset"}, {"field", "component", "raw_shape"}),
               ("a.raw --transfer wide --raw-shape 1 2 3", set(), {"raw_order", "raw_offset", "raw_type"})],
    "design": [("palette.toml", set(), {"rounds", "preset"})],
}  # fmt: skip
"""Calls of each command; options that such a call ignores, and options that it does not."""


@pytest.mark.parametrize("command", CALLS)
def test_a_call_refuses_the_options_that_it_would_ignore(command: str) -> None:
    module = importlib.import_module(f"spectral_core.cli.{command}")
    parser = argparse.ArgumentParser()
    module.add_arguments(parser)
    for words, ignored, read in CALLS[command]:
        refused = set(module.unused(parser.parse_args(words.split())))
        assert ignored <= refused and not read & refused, words


def test_an_option_after_the_two_dashes_is_told_where_to_stand(capsys: pytest.CaptureFixture[str]) -> None:
    """The message asked "did you mean --points?" about --points."""
    with pytest.raises(SystemExit) as ended:
        main(["lattice", "--", "--points", "4"])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert "'--points', '4'; write options before '--'" in error and "mean" not in error
