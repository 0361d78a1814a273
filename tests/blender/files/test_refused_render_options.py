# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of ``render`` that are refused before Blender opens the file, which may take minutes."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

from blender_addon.commands import main


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--bands 0 --out a.exr", "--bands is 0"),
        ("--bands 5000 --out a.exr", "--bands is 5000"),
        ("--samples 0", "--samples is 0"),
        ("--seed -1", "--seed is -1"),
        ("--percentage 0", "--percentage is 0"),
        ("--target-error 0", "--target-error is 0"),
        ("--time-budget 0", "--time-budget is 0"),
        ("--samples 4 --time-budget 9", "--samples has no effect with --time-budget"),
        ("--set bounces", "--set 'bounces' is not of the form"),
        ("--frame 9999999", "--frame is 9999999"),
    ],
)
def test_values_that_no_file_takes_are_refused_before_the_file_is_opened(tmp_path, capfd, words, message) -> None:
    (tmp_path / "large.blend").write_text("no Blender file, as its opening would say")
    assert main(["render", str(tmp_path / "large.blend"), *words.split()]) == 1
    assert message in capfd.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        "--denoise",
        "--no-denoise",
        "--target-error 2",
        "--time-budget 9",
        "--bands 7",
        "--multilayer",
        "--passes Depth",
        "--animation",
        "--out a.exr",
    ],
)
def test_a_scene_for_mitsuba_refuses_the_options_of_pictures(tmp_path, capfd, words) -> None:
    """It ignored --denoise, --target-error and --time-budget."""
    (tmp_path / "large.blend").write_text("no Blender file, as its opening would say")
    command = ["render", str(tmp_path / "large.blend"), "--write-mitsuba", str(tmp_path / "folder"), *words.split()]
    assert main(command) == 1
    expected = f"{words.split()[0]} has no effect here: --write-mitsuba writes a scene and no picture"
    assert expected in capfd.readouterr().err
