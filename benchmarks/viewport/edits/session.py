# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of a session of Blender beyond edits of data: undo, redo, files, mode, camera, palette; and their start."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

WIDTH, HEIGHT, SAMPLES = 96, 64, 2
Change = Callable[[np.random.Generator], None]
TIMED = ("camera", "number", "lamp", "world", "palette", "move", "reshape", "add", "node added")
"""Types of change whose first picture has a time limit in the acceptance; kills are counted by the same types."""


def kinds_of(trial: Any) -> dict[str, Change]:
    """All types of change. ``trial``: has ``context``, ``folder`` and ``new_view``."""
    from benchmarks.viewport.edits.objects import EDITS

    def undo(rng: np.random.Generator) -> None:
        _edited_and_undone(rng)

    def redo(rng: np.random.Generator) -> None:
        import bpy

        _edited_and_undone(rng)
        bpy.ops.ed.redo()

    def mode(_rng: np.random.Generator) -> None:
        trial.new_view()

    def same_file(_rng: np.random.Generator) -> None:
        import bpy

        path = str(trial.folder / "scene.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        trial.new_view()

    def other_file(_rng: np.random.Generator) -> None:
        import bpy

        bpy.ops.wm.open_mainfile(filepath=str(trial.folder / "start.blend"))
        trial.new_view()

    def append(_rng: np.random.Generator) -> None:
        import bpy

        with bpy.data.libraries.load(str(trial.folder / "library.blend")) as (there, here):
            here.objects = there.objects[:1]
        for each in here.objects:
            bpy.context.scene.collection.objects.link(each)

    def camera(rng: np.random.Generator) -> None:
        trial.context = context(*rng.uniform(-1.5, 1.5, 2))

    def palette(rng: np.random.Generator) -> None:
        """Drag a wanted color of a paint that some material of the scene has."""
        import bpy

        table = bpy.context.scene.spectral.palette
        if not len(table.materials):
            bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
        table.materials[0].material = next(iter(bpy.data.materials), None)
        table.materials[0].cells[0].mode = "FIXED"
        table.materials[0].cells[0].target = rng.uniform(0.2, 0.8, 3)

    own = {"undo": undo, "redo": redo, "mode": mode, "file": same_file, "other file": other_file}
    return dict(EDITS) | own | {"append": append, "camera": camera, "palette": palette}


def _edited_and_undone(rng: np.random.Generator) -> None:
    import bpy

    from benchmarks.viewport.edits.objects import EDITS

    bpy.ops.ed.undo_push(message="before")
    EDITS[str(rng.choice(list(EDITS)))](rng)
    bpy.ops.ed.undo_push(message="edited")
    bpy.ops.ed.undo()


def start(folder: Path) -> None:
    """Plane, ball and lamp, saved as start.blend and as library.blend."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.spectral.viewport.samples = SAMPLES
    material = bpy.data.materials.new("Paint")
    if material.node_tree is None:
        material.use_nodes = True
    bpy.ops.mesh.primitive_plane_add(size=6)
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 1), segments=12, ring_count=8)
    bpy.context.object.data.materials.append(material)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location, lamp.data.energy = (2, -2, 4), 300.0
    scene.collection.objects.link(lamp)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "start.blend"))
    shutil.copy2(folder / "start.blend", folder / "library.blend")  # Blender appends nothing from the open file


def context(x: float = 0.0, y: float = 0.0) -> Any:
    """A stand-in for a 3D view, from above (x, y)."""
    projection = np.diag([1.2, 1.8, -1.0, 0.0])
    projection[3, 2] = -1.0
    placed = np.eye(4)
    placed[:3, 3] = x, y, 12.0
    region = SimpleNamespace(
        window_matrix=projection, view_matrix=np.linalg.inv(placed), is_perspective=True, view_perspective="PERSP"
    )
    space = SimpleNamespace(
        local_view=None,
        use_local_collections=False,
        camera=None,
        use_local_camera=False,
        use_render_border=False,
        clip_start=0.1,
        clip_end=100.0,
    )
    return SimpleNamespace(space_data=space, region=SimpleNamespace(width=WIDTH, height=HEIGHT), region_data=region)


def followed(session: Any, seen: Any, edit: Any) -> None:
    """The calls that Blender makes after an edit: its handlers receive the same list of updates as the view of an
    engine. Where Blender evaluates objects again after its handlers, the view reads them after that, as an engine does.
    """
    import bpy

    from blender_addon.editing.palette.picture import shown_in
    from blender_addon.editing.viewport import freed
    from blender_addon.editing.viewport import session as sessions

    def follow(_scene: Any, depsgraph: Any) -> None:
        if freed.is_evaluated_again(depsgraph):
            stage = session()._enter(seen, depsgraph)
            sessions._stages[stage].keep_up(depsgraph, shown_in(depsgraph.scene))
        else:
            session().update(seen, depsgraph)

    def lists() -> tuple[Any, Any]:
        return bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post

    for handlers in lists():
        handlers.append(follow)
    try:
        edit()
        bpy.context.view_layer.update()
    finally:
        for handlers in lists():
            if follow in handlers:  # opening a file removes them
                handlers.remove(follow)
    session().update(seen, bpy.context.view_layer.depsgraph)
