# SPDX-License-Identifier: GPL-3.0-or-later
"""Two scenes with equal parameters and one folder, and the documents of a run that refuses its folder."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

import bpy

from blender_addon.editing.sweep import documents as sweep_documents
from blender_addon.editing.sweep import live as sweeps
from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.store import Store
from tests.blender_sweep.test_runs_and_files import _table, swept  # noqa: F401 - a fixture
from tests.blender_sweep.test_sweep_in_blender import KEY, scene  # noqa: F401 - a fixture


def documents(folder: Path) -> dict[str, bytes]:
    return {
        path.name: path.read_bytes() for path in folder.parent.iterdir() if path.name.startswith(folder.stem + ".s")
    }


def ended(monkeypatch: Any, code: str) -> None:
    """Runs are processes with this code."""
    monkeypatch.setattr(sweeps, "command_line", lambda *_: [sys.executable, "-c", code])


def test_a_second_scene_of_equal_parameters_is_refused(swept: Any) -> None:  # noqa: F811
    """Only the process refused it, after the copy of the file was replaced."""
    folder = _table(swept, KEY)
    sweeps.start(swept)
    sweeps.cancel()
    kept = documents(folder)
    other = swept.copy()  # with the sweep and its settings
    with pytest.raises(InvalidInputError, match=r"holds the sweep of the scene 'Scene'\. Choose another folder"):
        sweeps.start(other)
    assert documents(folder) == kept
    assert sweeps.start(swept).process.poll() is None  # its own
    sweeps.cancel()
    other.spectral.sweep.folder = "//other.cdb"
    sweeps.start(other)
    sweeps.cancel()
    bpy.data.scenes.remove(other)
    swept.name = "Renamed"
    assert sweeps.start(swept).process.poll() is None


def test_a_run_that_refuses_the_folder_puts_the_documents_back(swept: Any, monkeypatch: Any) -> None:  # noqa: F811
    """The points that the page adds were then refused, too: the copy was of the edited file."""
    folder = _table(swept, KEY)
    sweeps.start(swept)
    sweeps.cancel()
    kept = documents(folder)
    assert set(kept) == {f"{folder.stem}.sweep.blend", f"{folder.stem}.sweep.toml"}
    bpy.data.objects["Camera"].location.x += 1.0
    ended(monkeypatch, "print('spectral-scene sweep: it holds another sweep'); exit(1)")
    sweeps.start(swept).process.wait()
    assert set(documents(folder)) > set(kept)
    assert sweeps.tick() is None
    assert documents(folder) == kept
    assert swept.spectral.sweep.status == "it holds another sweep"


def test_a_run_that_cannot_start_puts_the_documents_back(swept: Any, monkeypatch: Any) -> None:  # noqa: F811
    """As after an update of the running Blender; the earlier documents stayed aside, and the next run lost them."""
    folder = _table(swept, KEY)
    sweeps.start(swept)
    sweeps.cancel()
    kept = documents(folder)
    bpy.data.objects["Camera"].location.x += 1.0
    monkeypatch.setattr(sweeps, "command_line", lambda *_: [str(folder / "no Blender")])
    with pytest.raises(FileNotFoundError, match="no Blender"):
        sweeps.start(swept)
    assert documents(folder) == kept
    assert not swept.spectral.sweep.is_under_way


def test_a_run_that_takes_the_folder_keeps_its_documents(swept: Any, monkeypatch: Any) -> None:  # noqa: F811
    folder = _table(swept, KEY)
    sweeps.start(swept)
    sweeps.cancel()
    kept = documents(folder)
    bpy.data.objects["Camera"].location.x += 1.0
    ended(monkeypatch, "exit(1)")
    run = sweeps.start(swept)
    run.process.wait()
    with Store.open(folder) as store:  # as the process does once it has accepted the folder
        store.save_project()
    assert sweeps.tick() is None
    assert set(documents(folder)) == set(kept)
    assert documents(folder)[f"{folder.stem}.sweep.blend"] != kept[f"{folder.stem}.sweep.blend"]


def test_the_swept_scene_is_rendered_and_not_that_of_the_first_window(scene: Any) -> None:  # noqa: F811
    """A second window may show another scene; a file opens with the scene of its first window."""
    from blender_addon.editing.sweep.node import blend_node
    from spectral_core.explore.sweep.document import read_sweep
    from spectral_core.explore.sweep.parameters import Parameter, Space

    other = scene.copy()
    other.name, other.use_fake_user = "Night", True
    other.render.resolution_x = 2 * scene.render.resolution_x
    sweeps.add(other, KEY)
    written = sweep_documents.write_documents(other)
    assert bpy.context.window.scene == scene
    table = dict(read_sweep(written.document).compute)
    space = Space((Parameter("energy", 10.0, 20.0, path=KEY),))
    kind = table.pop("kind")
    made = blend_node(table, space, written.folder.parent).scene({"energy": 12.0}, 0)
    assert kind == "blend" and made.film.width == 2 * 32
    first = blend_node(table | {"scene": "Scene"}, space, written.folder.parent)
    assert first.scene({"energy": 12.0}, 0).film.width == 32
    with pytest.raises(InvalidInputError, match="has no scene 'Dawn'; it has Night, Scene"):
        blend_node(table | {"scene": "Dawn"}, space, written.folder.parent)
    with pytest.raises(InvalidInputError, match="scene = 3; expected the name"):
        blend_node(table | {"scene": 3}, space, written.folder.parent)
