# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window, for ``viewport-latency``: from a change to the end of the draw that shows it."""

import itertools
import os
import sys
import time

sys.path[:0] = [path for path in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if path]

import bpy
import mathutils
import numpy as np

import blender_addon
from benchmarks.viewport.window import inside
from benchmarks.viewport.window.inside import shader, space
from blender_addon import jobs, viewport
from blender_addon.editing.palette import live
from spectral_core.render.live.link import LiveLink

blender_addon.register_once()
bpy.context.preferences.view.show_splash = False
SETTINGS = inside.settings()
PATIENCE_S = 120.0
LONGEST_STORY = 60
"""Events that are remembered of a change."""
REST_S = 0.15
"""Between two changes: the view refines, as it does while an artist works."""
rng = np.random.default_rng(7)
told: dict = {"times": {}}


class Watch:
    """The change that is waited for. ``before``: number of the last request before it."""

    start = before = 0.0
    took: float | None = None
    how, recordings, old, worded = "", 0, 0, 0
    word = ""
    draws = 0
    update_ms = waited_ms = arrived_ms = 0.0
    story: tuple[str, ...] = ()


def note(text):
    """Remember an event of the present change and its time in ms."""
    watch.story += (f"{1e3 * (time.perf_counter() - watch.start):.0f} {text}",)


watch = Watch()
drawn, updated, words = viewport.Viewport.draw, viewport.Viewport.update, viewport.words
wait, heard = LiveLink.wait, LiveLink._hear


def update(view, engine, context, depsgraph):
    """Translate and send, and add up the time."""
    start = time.perf_counter()
    note("update")
    updated(view, engine, context, depsgraph)
    watch.update_ms += 1e3 * (time.perf_counter() - start)


def waited(link, *arguments):
    """Wait for the first picture, and add up the time."""
    start = time.perf_counter()
    try:
        return wait(link, *arguments)
    finally:
        watch.waited_ms += 1e3 * (time.perf_counter() - start)


def hear(link, worker, kind, content):
    """Remember when the picture of the change arrived."""
    heard(link, worker, kind, content)
    if kind == "frame" and len(watch.story) < LONGEST_STORY:
        note(f"picture of {content.generation - watch.before}, every {content.level}")
    if kind == "frame" and content.generation > watch.before and not watch.arrived_ms:
        watch.arrived_ms = 1e3 * (time.perf_counter() - watch.start)


def draw(view, engine, context, depsgraph):
    """Draw, and see whether the picture is of after the change."""
    note("draw")
    drawn(view, engine, context, depsgraph)
    note("drawn")
    now, watch.draws = time.perf_counter(), watch.draws + 1
    sides = view._session._sides
    if watch.took is not None or not sides:
        return
    shown = [view._session.link.latest(side.name) for side in sides]
    asked = min(side.generation for side in sides)
    if asked > watch.before and all(
        each is not None and each.frame.generation >= side.generation for each, side in zip(shown, sides, strict=True)
    ):
        watch.took, watch.how, watch.recordings = now - watch.start, shown[0].frame.how, shown[0].frame.recordings
    elif asked > watch.before:
        watch.old += shown[0] is not None
        watch.worded += bool(watch.word)


def kept_answer(*arguments, **settings):
    """Remember when the palette's answer is stored."""
    note("answer")
    return keep(*arguments, **settings)


def said(pictures, settings):
    """Remember what the corner of the view says."""
    found = words(pictures, settings)
    watch.word = found[1]
    return found


viewport.Viewport.draw, viewport.Viewport.update, viewport.words = draw, update, said
LiveLink.wait, LiveLink._hear = waited, hear
keep, live.keep = live.keep, kept_answer


def latest_request():
    views = list(jobs.live()._views.values())
    return max((view.request.generation for view in views), default=0)


def settled():
    views = list(jobs.live()._views.values())
    return bool(views) and all(
        view.shown is not None and view.shown.frame.samples >= 1
        and view.shown.frame.generation >= view.request.generation for view in views
    )  # fmt: skip


def changed(act):
    """Make a change, and wait for its picture."""
    watch.before, watch.old, watch.worded = latest_request(), 0, 0
    watch.update_ms = watch.waited_ms = watch.arrived_ms = 0.0
    watch.start, watch.took, watch.draws, watch.story = time.perf_counter(), None, 0, ()
    act()
    note("changed")
    yield from inside.until(lambda: watch.took is not None, PATIENCE_S, act.__name__)


def build():
    """Ten balls on a floor, ten materials, a lamp and a world, as in the benchmark without a window."""
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.spectral.viewport.samples = 64
    for block in (*bpy.data.objects, *bpy.data.materials):
        bpy.data.batch_remove([block])
    bpy.ops.mesh.primitive_plane_add(size=40)
    segments, rings = (40, 26) if SETTINGS["quick"] else (100, 51)
    for number in range(10):
        place = ((number % 5 - 2) * 2.2, (number // 5) * 2.5, 1)
        bpy.ops.mesh.primitive_uv_sphere_add(location=place, segments=segments, ring_count=rings)
        ball = bpy.context.object
        ball.name = ball.data.name = f"Ball {number}"
        ball.data.polygons.foreach_set("use_smooth", np.ones(len(ball.data.polygons), dtype=bool))
        material = bpy.data.materials.new(f"Paint {number}")
        if material.node_tree is None:
            material.use_nodes = True
        ball.data.materials.append(material)
        shader(material.name)["Base Color"].default_value = (0.1 * number, 0.5, 0.9 - 0.08 * number, 1)
    bpy.ops.object.light_add(type="AREA", location=(0, -2, 6))
    lamp = bpy.context.object.data
    lamp.name, lamp.energy, lamp.size = "Key", 500.0, 2.0
    bpy.ops.object.camera_add(location=(0, -10, 4), rotation=(np.radians(75), 0, 0))
    scene.camera = bpy.context.object
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    scene.spectral.palette.materials[0].material = bpy.data.materials["Paint 9"]


def one(kind):
    return f"{kind} {int(rng.integers(10))}"


def orbit(perspective):
    view = space().region_3d
    view.view_perspective = perspective
    view.view_location, view.view_distance = (0, 0, 1), 12.0
    view.view_rotation = mathutils.Euler((rng.uniform(1.1, 1.4), 0, rng.uniform(-0.4, 0.4))).to_quaternion()


def camera_view():
    """Through the camera, whose lens is shifted, with another zoom of the view."""
    view = space().region_3d
    view.view_perspective = "CAMERA"
    view.view_camera_zoom = rng.uniform(25, 35)
    bpy.context.scene.camera.data.shift_x = rng.uniform(-0.1, 0.1)


def edited():
    mesh = bpy.data.meshes[one("Ball")]
    mesh.vertices[int(rng.integers(len(mesh.vertices)))].co.z += rng.uniform(-0.05, 0.05)
    mesh.update()


def dragged():
    cell = bpy.context.scene.spectral.palette.materials[0].cells[0]
    cell.mode, cell.target = "FIXED", rng.uniform(0.2, 0.8, 3)


def added():
    bpy.ops.mesh.primitive_cube_add(location=(*rng.uniform(-3, 3, 2), 2.5), size=0.5)


PAINTS, TEXTURES = 9, ("ShaderNodeTexNoise", "ShaderNodeTexWave", "ShaderNodeTexMagic")
nodes_added = itertools.count()


def with_node():
    """Another texture in a material, never the one that is there, at a socket that no other change sets."""
    number = next(nodes_added)
    tree = bpy.data.materials[f"Paint {number % PAINTS}"].node_tree
    node = tree.nodes.new(TEXTURES[number // PAINTS % len(TEXTURES)])
    tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED").inputs["Specular Tint"])


def numbered(name, *values):  # not of the last material, which shows the palette's spectrum
    shader(f"Paint {int(rng.integers(PAINTS))}")[name].default_value = values if len(values) > 1 else values[0]


def coated():
    coat = shader(f"Paint {int(rng.integers(PAINTS))}")["Coat Weight"]
    coat.default_value = 0.0 if coat.default_value > 0 and rng.random() < 0.4 else rng.uniform(0.1, 1.0)


KINDS = {
    "camera": lambda: orbit("PERSP"),
    "orthographic": lambda: orbit("ORTHO"),
    "shift and zoom": camera_view,
    "roughness": lambda: numbered("Roughness", rng.uniform(0.2, 0.8)),
    "color": lambda: numbered("Base Color", *rng.uniform(0.1, 0.9, 3), 1.0),
    "lamp": lambda: setattr(bpy.data.lights["Key"], "energy", rng.uniform(200, 900)),
    "world": lambda: setattr(bpy.context.scene.world.node_tree.nodes["Background"].inputs[1], "default_value",
                             rng.uniform(0.5, 2.0)),
    "palette cell": dragged,
    "moved": lambda: setattr(bpy.data.objects[one("Ball")], "location", (*rng.uniform(-4, 4, 2), 1.0)),
    "mesh": edited,
}  # fmt: skip
VIEWS = ("camera", "orthographic", "shift and zoom")
RARE = {"object added": added, "node added": with_node}
LAST = {"coat": coated}  # after all others, whose launches coats on all materials would make longer
for kinds in (KINDS, RARE, LAST):
    for kind in [kind for kind in kinds if SETTINGS["only"] and kind not in SETTINGS["only"]]:
        del kinds[kind]


def measured(kind, act):
    act.__name__ = kind
    yield from changed(act)
    how = "" if kind in VIEWS else watch.how  # that of the last change of the scene
    record = {"ms": 1e3 * watch.took, "how": how, "recordings": watch.recordings,
              "old": watch.old, "worded": watch.worded, "draws": watch.draws, "update_ms": watch.update_ms,
              "waited_ms": watch.waited_ms, "arrived_ms": watch.arrived_ms,
              "story": " | ".join(watch.story)}  # fmt: skip
    yield 0.7 if kind == "palette cell" else REST_S  # a wanted color is solved again, with conflicts, at rest
    return record


def views():
    for transport in SETTINGS["transports"]:
        bpy.context.scene.spectral.render.transport = transport.upper()
        space().shading.type = "RENDERED"
        yield from inside.until(settled, 10 * PATIENCE_S, "the first picture")
        for kind, act in KINDS.items():  # the first of each kind may load the scene or record
            yield from measured(kind, act)
        yield from inside.until(settled, PATIENCE_S, "the first changes")
        found: dict = {kind: [] for kind in (*KINDS, *LAST, *RARE)}
        for number in range(SETTINGS["count"]):
            for kind, act in KINDS.items():
                found[kind].append((yield from measured(kind, act)))
            if number < SETTINGS["rare"]:
                for kind, act in RARE.items():
                    found[kind].append((yield from measured(kind, act)))
                    yield from inside.until(settled, PATIENCE_S, kind)
        for kind, act in LAST.items():
            for _ in range(SETTINGS["count"]):
                found[kind].append((yield from measured(kind, act)))
            for number in range(PAINTS):
                shader(f"Paint {number}")["Coat Weight"].default_value = 0.0
        told["times"][transport] = found
        print("MEASURED", transport, {kind: [round(each["ms"]) for each in of] for kind, of in found.items()},
              file=sys.stderr, flush=True)  # fmt: skip
        space().shading.type = "SOLID"
        yield 0.5


def drive():
    yield 1.0
    build()
    yield from inside.only_the_view()
    told["size"] = (inside.region().width, inside.region().height)
    yield from views()


inside.drive(drive(), told)
