# SPDX-License-Identifier: GPL-3.0-or-later
"""A long text that was pasted into the field of a path: no file can have that name, and the panels say so."""

from __future__ import annotations

from pathlib import Path

import pytest

LONG = "/tmp/" + "x" * 500
REASON = "File name too long"


@pytest.fixture
def owner(blender):
    """The spectrum of a new material, which is read from a file that is not there."""
    made = blender.data.materials.new("Pasted")
    made.spectral.source = "FILE"
    made.spectral.filepath = "/nowhere.csv"
    assert made.spectral.message.startswith("there is no file /nowhere.csv")
    return made.spectral


def test_the_message_is_of_the_path_that_was_pasted(owner) -> None:
    owner.filepath = LONG
    assert owner.message == f"{LONG} cannot be read: {REASON}; choose it again, or pack the file"


def test_a_job_that_reads_or_writes_there_names_the_remedy(blender) -> None:
    spectral = blender.context.scene.spectral
    spectral.recipe.kind, spectral.recipe.filepath = "INKS", LONG
    with pytest.raises(RuntimeError, match=f"cannot be read: {REASON}; choose one with a column per component"):
        blender.ops.spectral.recipe_find()
    picture = blender.data.images.new("Pasted", 4, 4)
    spectral.texture.first = spectral.texture.second = picture
    spectral.texture.folder = LONG
    with pytest.raises(RuntimeError, match=f"cannot be made: {REASON}; choose another folder"):
        blender.ops.spectral.texture_design()
    blender.data.images.remove(picture)


def test_a_saved_copy_keeps_its_other_paths(blender, owner, tmp_path) -> None:
    """An error at the first path would leave all others as they were, leading to no file."""
    (tmp_path / "there").mkdir()
    (tmp_path / "k.csv").write_text("x")
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    blender.context.scene.spectral.recipe.filepath = "//" + "x" * 500  # scenes are the first
    owner.filepath = "//k.csv"
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "there" / "a.blend"))
    assert Path(blender.path.abspath(owner.filepath)).resolve() == (tmp_path / "k.csv").resolve()
