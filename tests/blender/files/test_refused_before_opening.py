# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands on .blend files refuse what no file takes, before Blender opens the file."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

from blender_addon.commands import main
from spectral_core.render.plan.effects import require_possible


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--set", "bounce=4"], "no effect is named 'bounce'; did you mean 'bounces'"),
        (["--set", "bounces=many"], "effect 'bounces' is 'many'; expected a whole number, 0 to 1024"),
        (["--set", "transport=xyz"], "effect 'transport' cannot be 'xyz'; choose rgb or spectral"),
        (["--set", "textures=off"], "effect 'textures' follows from the scene"),
        (["--passes", "Depht", "--out", "a.exr"], "no pass is named 'Depht'; did you mean 'Depth'"),
    ],
)
def test_what_no_file_takes_is_refused_before_the_file_is_opened(tmp_path, capfd, words, message) -> None:
    """The file was opened and translated first, which may take minutes."""
    path = tmp_path / "scene.blend"
    path.write_bytes(b"no .blend file")
    assert main(["render", str(path), *words]) == 1
    error = capfd.readouterr().err
    assert message in error and "cannot be opened" not in error


@pytest.mark.parametrize(("effect", "value"), [("environment", "image"), ("dispersion", "on"), ("media", "off")])
def test_what_another_scene_may_take_is_left_to_the_plan(effect, value) -> None:
    require_possible({effect: value})


def test_an_estimate_writes_no_file_and_says_so(tmp_path, capfd) -> None:
    assert main(["transport", str(tmp_path / "scene.blend"), "--estimate", "--out", "kept.exr"]) == 1
    assert "--out has no effect here: --estimate writes nothing" in capfd.readouterr().err
