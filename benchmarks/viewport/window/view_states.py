# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Rendered views of a Blender with a window show, for ``tests/live/states_drive.py``: is any stale?

SPECTRAL_OUT is a folder for pictures of the screen.
"""

import os
import subprocess
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np

from blender_addon import jobs, viewport
from blender_addon.editing.palette.picture import shown_in
from blender_addon.editing.viewport import session
from blender_addon.translate.scene import translate_scene
from spectral_core.render.live.in_place.changes import difference
from spectral_core.scene import Camera

OUT = os.environ.get("SPECTRAL_OUT", "")
PATIENCE_S = 240.0
told: dict = {"states": {}, "errors": []}
drawn, fail = viewport.Viewport.draw, session.ViewSession.fail
failures: list[str] = []


def draw(self, engine, context, depsgraph):
    """Note errors, which Blender only prints."""
    try:
        drawn(self, engine, context, depsgraph)
    except Exception:
        told["errors"].append(traceback.format_exc(limit=5))
        raise


def failed(self, text):
    """Note what a view says in place of a picture."""
    failures.append(text)
    fail(self, text)


viewport.Viewport.draw, session.ViewSession.fail = draw, failed


def views():
    return list(jobs.live()._views.values())


def settled():
    return bool(views()) and all(
        view.trouble or (view.shown is not None and view.shown.frame.is_done
                         and view.shown.frame.generation >= view.request.generation) for view in views()
    )  # fmt: skip


def stale():
    """Kinds of data in which the scene of a view differs from a whole translation; local views are left out."""
    found = {}
    for stage, kept in session._stages.items():
        if stage.count("/") > 1:
            continue
        depsgraph = bpy.context.evaluated_depsgraph_get()
        known = jobs.live()._scenes.get(f"{stage}.0")
        if known is None:
            continue
        true = translate_scene(
            depsgraph,
            film=known.film,
            seen_from=Camera(world_from_camera=np.eye(4)),
            designed=shown_in(depsgraph.scene),
        )
        left = difference(known, true)
        kinds = [*left.items, *(each for each in left.singles if each != "notes")]
        if kinds:
            found[stage] = kinds
        assert kept.users
    return found


def told_of(name, is_compared):
    """Wait until the views rest, then note what they show."""
    yield 0.7
    start = time.monotonic()
    patience = PATIENCE_S if is_compared else 4.0  # an animation that plays never rests
    while not settled() and time.monotonic() - start < patience:
        yield 0.1
    yield 0.5
    shown = [view.shown for view in views() if view.shown is not None]
    told["states"][name] = {
        "settled": settled(), "views": len(views()), "stale": stale() if is_compared else {},
        "trouble": [view.trouble for view in views() if view.trouble] + failures,
        "means": [round(float(each.pixels[..., :3].mean()), 4) for each in shown],
        "sizes": [each.pixels.shape[:2] for each in shown], "corners": [each.frame.corner for each in shown],
        "instances": [len(scene.instances) for scene in jobs.live()._scenes.values()],
        "triangles": [sum(len(mesh.triangles) for mesh in scene.meshes) for scene in jobs.live()._scenes.values()],
        "notes": [note.message for scene in jobs.live()._scenes.values() for note in scene.notes],
        "seconds": round(time.monotonic() - start, 1),
    }  # fmt: skip
    failures.clear()
    print("STATE", name, told["states"][name], file=sys.stderr, flush=True)
    if OUT:
        subprocess.run(["import", "-window", "root", str(Path(OUT) / f"{name.replace(' ', '_')}.png")], check=False)
