# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window, for ``viewport-stalls``: an artist's work, timed by ``stalls_trace``."""

import os
import sys
import time
from pathlib import Path

sys.path[:0] = [path for path in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if path]

import bpy
import mathutils
import numpy as np

import blender_addon
from benchmarks.viewport.window import inside
from benchmarks.viewport.window.inside import shader, space
from benchmarks.viewport.window.stalls_trace import Ticks, Trace, step
from blender_addon import jobs

LONG_MS = 100.0
SETTINGS = inside.settings()
rng = np.random.default_rng(SETTINGS["seed"])
told: dict = {"refused": {}}


def opened_panels():
    """All panels of the extension are drawn: nothing is closed."""
    from blender_addon import registration  # noqa: F401 - its modules declare the panels

    for panel in bpy.types.Panel.__subclasses__():
        if panel.__module__.startswith("blender_addon"):
            panel.bl_options = set(getattr(panel, "bl_options", ())) - {"DEFAULT_CLOSED"}


def build():
    """80,000 triangles in eight balls, a palette of two paints under two lights."""
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.spectral.viewport.samples = 2
    scene.spectral.render.samples = 2
    scene.render.resolution_x, scene.render.resolution_y = 96, 54
    bpy.ops.mesh.primitive_plane_add(size=12)
    for number in range(8):
        bpy.ops.mesh.primitive_uv_sphere_add(location=(number - 4, 1, 1), segments=100, ring_count=50)
        material = bpy.data.materials.new(f"Paint {number}")
        if material.node_tree is None:
            material.use_nodes = True
        bpy.context.object.data.materials.append(material)
    scene.spectral.palette.possible_follows = True
    view = space()
    view.shading.type = "RENDERED"
    view.show_region_ui = True
    bpy.ops.object.select_all(action="DESELECT")


def bind():
    palette = bpy.context.scene.spectral.palette
    for number, entry in enumerate(palette.materials):
        entry.material = bpy.data.materials[f"Paint {number}"]


def pressed(name, **values):
    """What a button does: an operator that works on a thread does so only then."""
    with inside.in_view():
        getattr(bpy.ops.spectral, name)("INVOKE_DEFAULT", **values)


def any_of(items):
    return items[int(rng.integers(len(items)))]


def reshape():
    mesh = bpy.data.objects["Sphere"].data
    mesh.vertices[int(rng.integers(100))].co.z += rng.uniform(-0.02, 0.02)
    mesh.update()


def drag():
    """Thirty wanted colors within a second, as by a pointer."""
    for _ in range(30):
        cell = bpy.context.scene.spectral.palette.materials[0].cells[0]
        cell.mode, cell.target = "FIXED", rng.uniform(0.2, 0.8, 3)
        yield 0.03


def orbit():
    for _ in range(10):
        space().region_3d.view_rotation = mathutils.Euler((1.1, 0, rng.uniform())).to_quaternion()
        yield 0.05


def come_and_go():
    bpy.ops.mesh.primitive_cube_add(location=(*rng.uniform(-3, 3, 2), 3))
    yield 1.5
    bpy.data.objects.remove(bpy.context.object)


def undone():
    bpy.ops.ed.undo_push(message="before")
    bpy.data.objects["Sphere.001"].location.z = rng.uniform(1, 2)
    bpy.ops.ed.undo_push(message="moved")
    yield 0.3
    bpy.ops.ed.undo()
    yield 0.5
    bpy.ops.ed.redo()


def frames():
    """Eight frames of an animation."""
    ball = bpy.data.objects["Sphere.003"]
    for number in (1, 10):
        ball.location.z = number / 5
        ball.keyframe_insert("location", frame=number)
    for number in range(1, 9):
        bpy.context.scene.frame_set(number)
        yield 0.1


def tabs():
    """The properties editor is turned to each tab in which the extension has a panel."""
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "PROPERTIES":
            for name in ("RENDER", "WORLD", "OBJECT", "MATERIAL", "DATA"):
                try:
                    area.spaces.active.context = name
                except TypeError:
                    continue  # not with this object
                yield 0.3


def sidebar():
    for region in inside.area().regions:
        if region.type == "UI":
            try:
                region.active_panel_category = "Spectral"
            except (AttributeError, TypeError):
                return
    inside.area().tag_redraw()


def rendered():
    bpy.ops.render.render("INVOKE_DEFAULT")
    yield 3.0
    while bpy.app.is_job_running("RENDER"):
        yield 0.2


def recorded():
    bpy.context.scene.spectral.dial.storage = "BANDS31"
    pressed("dial_record")
    yield 6.0


def turned():
    dial = bpy.context.scene.spectral.dial
    for _ in range(10):
        dial.selector = rng.uniform(-1, 1, 2)
        yield 0.05


def saved():
    path = str(Path(bpy.app.tempdir) / "session.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    yield 0.5
    bpy.ops.wm.open_mainfile(filepath=path)
    yield 2.0
    sidebar()


def look(kind, **values):
    settings = bpy.context.scene.spectral.viewport.look
    for name, value in values.items():
        setattr(settings, name, value)
    settings.kind = kind


def table():
    """Rows and columns come, change and go."""
    for name, values in (("palette_add", {"side": "MATERIAL"}), ("palette_add", {"side": "LIGHT"}),
                         ("palette_remove", {"side": "MATERIAL"}), ("palette_remove", {"side": "LIGHT"})):  # fmt: skip
        getattr(bpy.ops.spectral, name)(**values)
        yield 1.0


def preset(name=""):
    pressed("palette_preset", preset=name or str(any_of(["HIDDEN_MARK", "METAMER_PAIR", "SPLIT_LIGHT"])))
    bind()
    yield 2.0


STEPS = {
    "orbit": orbit,
    "roughness": lambda: setattr(shader("Paint 3")["Roughness"], "default_value", rng.uniform(0.2, 0.8)),
    "lamp": lambda: setattr(bpy.data.lights["Light"], "energy", rng.uniform(500, 1500)),
    "move": lambda: setattr(bpy.data.objects["Sphere.002"], "location", (*rng.uniform(-2, 2, 2), 1)),
    "mesh": reshape,
    "wanted color": drag,
    "cell": lambda: bpy.ops.spectral.palette_select(row=int(rng.integers(2)), column=int(rng.integers(2))),
    "possible": lambda: pressed("palette_possible"),
    "apply": lambda: bpy.ops.spectral.palette_apply(),
    "solve": lambda: pressed("palette_solve"),
    "object": come_and_go,
    "undo": undone,
    "frames": frames,
    "tabs": tabs,
    "lamp look": lambda: look("LAMP", lamp=str(any_of(["D65", "HP1", "FL11", "A"]))),
    "split view": lambda: bpy.ops.spectral.look_split(),
    "own light": lambda: look("SCENE"),
    "curves": lambda: setattr(bpy.context.scene.spectral.palette, "show_curves", bool(rng.integers(2))),
    "plan": lambda: pressed("plan"),
    "spectrum": lambda: setattr(bpy.data.lights["Light"].spectral, "catalogue_name", str(any_of(["A", "D50", "HP2"]))),
    "spectrum source": lambda: setattr(bpy.data.lights["Light"].spectral, "source", "CATALOGUE"),
    "render": rendered,
    "record": recorded,
    "dial": turned,
    "table": table,
    "preset": preset,
    "file": saved,
}  # fmt: skip


def taken(name):
    """One step, and a rest."""
    step[0] = name
    try:
        found = STEPS[name]()
        if hasattr(found, "send"):
            yield from found
    except RuntimeError as error:
        text = f"{name}: {str(error).strip().splitlines()[-1]}"
        told["refused"][text] = told["refused"].get(text, 0) + 1
    yield 1.2


def drive():
    yield 1.0
    trace.clear()  # the modules and classes of the extension are loaded before anybody works
    build()
    yield from preset("HIDDEN_MARK")
    sidebar()
    views = jobs.live()._views
    yield from inside.until(lambda: any(view.shown for view in views.values()), 300, "the first picture")
    end, begun = time.monotonic() + 60 * SETTINGS["minutes"], time.monotonic()
    told["steps"] = 0
    order: list = list(STEPS)  # each once in this order, then at random
    while time.monotonic() < end:
        yield from taken(order.pop(0) if order else str(rng.choice(list(STEPS))))
        told["steps"] += 1
    told["minutes"] = (time.monotonic() - begun) / 60
    told["functions"] = {name: {
        "calls": len(calls), "clock_ms": max(call[0] for call in calls), "work_ms": max(call[1] for call in calls),
        "median_ms": float(np.median([call[0] for call in calls])),
        "at": max(calls, key=lambda call: call[1])[2], "queued_ms": max(calls)[3], "slow_at": max(calls)[2],
        "apart_ms": max(clock - queued for clock, _, _, queued in calls),
        "long": [call for call in calls if call[0] > LONG_MS or call[1] > LONG_MS],
    } for name, calls in trace.calls.items()}  # fmt: skip
    told["slow"] = sorted(trace.slow, key=lambda call: -call["clock_ms"])[:40]
    told["stood"] = sorted(trace.stood, key=lambda call: -call["clock_ms"])[:10]
    gaps = np.array([gap[0] for gap in ticks.gaps])
    told["ticks"] = {
        "number": len(gaps), "median_ms": float(np.median(gaps)), "p99_ms": float(np.percentile(gaps, 99)),
        "histogram": {f"{low}": int(((gaps >= low) & (gaps < high)).sum())
                      for low, high in ((0, 20), (20, 50), (50, 100), (100, 200), (200, 500), (500, 1e9))},
        "longest": sorted(ticks.gaps, reverse=True)[:12], "own": sorted(ticks.gaps, key=lambda gap: -gap[1])[:12],
    }  # fmt: skip


trace = Trace()
opened_panels()
blender_addon.register_once()
bpy.context.preferences.view.show_splash = False
ticks = Ticks(trace)
inside.drive(drive(), told)
