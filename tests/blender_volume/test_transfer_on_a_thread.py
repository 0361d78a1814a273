# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions that are fitted to the voxels of a volume: a thread reads them, and Blender goes on."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from spectral_core.errors import InvalidInputError  # noqa: E402
from tests.blender_volume.test_volumes_of_nodes import with_cube  # noqa: E402


def on_thread(work: Any) -> Any:
    """The result of ``work`` on a thread of its own."""
    found: list[Any] = []
    thread = threading.Thread(target=lambda: found.append(work()))
    thread.start()
    thread.join()
    return found[0]


@pytest.fixture
def fog(blender: Any) -> Any:
    thing = with_cube(bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog")))
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    return thing


def as_operator(kind: Any, **settings: Any) -> Any:
    """What the methods of an operator use of it: Blender alone can make one."""
    made = SimpleNamespace(_uid=0, stopping=threading.Event(), **settings)
    made.remember = lambda context: kind.remember(made, context)
    made.fitting = lambda *given: kind.fitting(made, *given)
    return made


@pytest.mark.parametrize("kind", ["transfer_preset", "transfer_import"])
def test_voxels_are_read_on_the_thread(fog: Any, kind: str, tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The main thread read and fitted them, so that Blender waited."""
    from blender_addon.operators import volume
    from blender_addon.translate import volumes
    from spectral_core.volume.documents.transfer_file import read_transfer, write_transfer
    from spectral_core.volume.presets import preset

    readers, usual = [], volumes._read
    monkeypatch.setattr(volumes, "_read", lambda *given: readers.append(threading.current_thread()) or usual(*given))
    path = tmp_path / "transfer.toml"
    depsgraph = bpy.context.evaluated_depsgraph_get()
    write_transfer(path, preset("narrow", volumes.voxels_of(fog.evaluated_get(depsgraph).data)))
    assert read_transfer(path).values != "fraction", "so that it must be fitted"
    readers.clear()
    operator = getattr(volume, f"SPECTRAL_OT_{kind}")
    made = as_operator(operator, preset="narrow", filepath=str(path))
    work = operator.begin(made, bpy.context)
    assert readers == []
    answer = on_thread(work)
    assert readers and threading.main_thread() not in readers
    assert not len(fog.data.spectral.materials)
    operator.end(made, bpy.context.scene, answer)
    assert [each.name for each in fog.data.spectral.materials] == list(answer.look.transfer.names)
    bpy.data.volumes.remove(fog.data)
    with pytest.raises(InvalidInputError, match="was deleted while its voxels were read"):
        operator.end(made, bpy.context.scene, answer)
