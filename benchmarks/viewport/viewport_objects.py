# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of large scenes in a 3D view: how long they hold up Blender's main thread.

1,000 objects and 20,000 instances of geometry nodes (a fifth with ``--quick``), without a window and a renderer, from
Blender's list of updates to the change that is sent: the longest call, the processor time of all of them, the redraws
over which the update is divided, and how many of them walk over objects. A second table has single meshes, which are
translated as a whole. A third has the renderer's launches in a view of 5,000 copies of a mesh, as one mesh and as
single instances.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.viewport.edits.session import context

OBJECTS, INSTANCES = 1000, 20_000
LIMIT_MS = 100.0
MESHES = (100, 316, 1000)
"""Segments of balls with half as many rings."""
COPIES = 5000


class Unsent:
    """A stand-in for the link to the renderer, which compares scenes as it does."""

    def __init__(self) -> None:
        self.scenes: dict[str, Any] = {}

    def show(self, stage: str, scene: Any) -> frozenset[str]:
        """The fields that differ from the scene before."""
        from spectral_core.render.live.in_place.changes import difference

        old, self.scenes[stage] = self.scenes.get(stage), scene
        change = None if old is None else difference(old, scene)
        return frozenset(("scene",) if change is None else (*change.items, *change.singles))

    def look(self, *_: Any) -> int:
        return 1

    def wait(self, *_: Any) -> bool:
        return False

    def latest(self, _view: str) -> None:
        return None

    def trouble(self, _view: str) -> str:
        return ""

    def pause(self, _view: str, *, is_paused: bool) -> None:
        pass

    def close_view(self, _view: str) -> None:
        pass

    drop = close_view


def run(options: Options) -> dict[str, Any]:
    """Print the tables and return them."""
    import blender_addon
    from blender_addon import jobs
    from blender_addon.translate import objects

    blender_addon.register_once()
    walks: list[int] = []
    walked, live = objects._walked, jobs.live
    figures: dict[str, Any] = {}
    share = 5 if options.quick else 1
    try:
        objects._walked = lambda *given: walks.append(1) or walked(*given)
        for kind, count in (("objects", OBJECTS // share), ("instances", INSTANCES // share)):
            link = Unsent()
            jobs.live = lambda link=link: link
            figures[f"{count} {kind}"] = _edited(kind, count, walks)
    finally:
        objects._walked, jobs.live = walked, live
    figures["meshes"] = _meshes(MESHES[: 2 if options.quick else 3])
    rows = [row for scene, rows in figures.items() if scene != "meshes" for row in rows.values()]
    figures["copies"] = _copies(COPIES // share)
    numbers = [row for row in rows if row["number"]]
    figures["holds"] = {
        "an edited number walks over no object": all(row["walks"] == 0 for row in numbers),
        f"an edited number takes at most {LIMIT_MS:g} ms of the main thread": all(
            row["ms"] <= LIMIT_MS for row in numbers
        ),
        f"no call of any edit takes more than {LIMIT_MS:g} ms": all(row["longest_ms"] <= LIMIT_MS for row in rows),
    }
    return figures


def _edited(kind: str, count: int, walks: list[int]) -> dict[str, dict[str, Any]]:
    """Milliseconds and walks of each edit of a scene of cubes."""
    import bpy

    from blender_addon.editing.viewport.session import ViewSession

    _build(kind, count)
    shader = next(node for node in bpy.data.materials["Paint"].node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    cube, lamp = bpy.data.objects["Cube"], bpy.data.objects["Lamp"]
    edits = {
        "first": lambda: setattr(lamp, "location", (1, 0, 4)),
        "roughness": lambda: setattr(shader.inputs["Roughness"], "default_value", 0.3),
        "power of the lamp": lambda: setattr(lamp.data, "energy", 50),
        "lamp moved": lambda: setattr(lamp, "location", (2, 0, 4)),
        "cube moved": lambda: setattr(cube, "location", (0, 0, 2)),
        "cube hidden": lambda: cube.hide_set(True),
    }
    session, seen, found = ViewSession(lambda: None), context(), {}
    print(f"{count} {kind}\n{'edit':<20}{'longest call':>15}{'in all':>13}{'redraws':>9}{'walks':>7}")
    for name, edit in edits.items():
        walks.clear()
        calls = _main_thread_ms(session, seen, edit)
        number = name in ("roughness", "power of the lamp", "lamp moved") or (name, kind) == ("cube moved", "objects")
        found[name] = row = {
            "longest_ms": max(calls), "ms": sum(calls), "redraws": len(calls) - 1, "walks": len(walks),
            "number": number,
        }  # fmt: skip
        print(f"{name:<20}{row['longest_ms']:>12.1f} ms{row['ms']:>10.1f} ms{row['redraws']:>9}{row['walks']:>7}")
    session.leave()
    return found


def _main_thread_ms(session: Any, seen: Any, edit: Any) -> list[float]:
    """Times of the calls that Blender makes after an edit: an update with its list of changes, and the redraws."""
    import bpy

    times: list[float] = []
    asked: list[int] = []
    session._redraw = lambda: asked.append(1)

    def timed(call: Any, depsgraph: Any) -> None:
        start = time.thread_time()
        call(seen, depsgraph)
        times.append(1e3 * (time.thread_time() - start))

    def follow(_scene: Any, depsgraph: Any) -> None:
        timed(session.update, depsgraph)

    bpy.app.handlers.depsgraph_update_post.append(follow)
    try:
        edit()
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(follow)
    asked.append(1)
    while asked:
        asked.clear()
        timed(session.look, bpy.context.view_layer.depsgraph)
    return times


def _build(kind: str, count: int) -> None:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    material = bpy.data.materials.new("Paint")
    if material.node_tree is None:  # before Blender 5
        material.use_nodes = True
    bpy.ops.mesh.primitive_cube_add(size=0.1)
    cube = bpy.context.object
    cube.data.materials.append(material)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(lamp)
    if kind == "objects":
        for number in range(count):
            item = bpy.data.objects.new(f"Cube {number}", cube.data)
            item.location = (number % 100, number // 100, 0)
            scene.collection.objects.link(item)
        return
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    names = ("GeometryNodeMeshGrid", "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo", "NodeGroupOutput")
    grid, on, info, out = map(tree.nodes.new, names)
    grid.inputs["Vertices X"].default_value = grid.inputs["Vertices Y"].default_value = round(count**0.5)
    info.inputs["Object"].default_value = cube
    tree.links.new(grid.outputs["Mesh"], on.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], on.inputs["Instance"])
    tree.links.new(on.outputs["Instances"], out.inputs[0])
    holder = bpy.data.objects.new("Holder", bpy.data.meshes.new("Nothing"))
    scene.collection.objects.link(holder)
    holder.modifiers.new("Scatter", "NODES").node_group = tree


def _meshes(sizes: tuple[int, ...]) -> dict[str, float]:
    """Milliseconds of the translation of smooth balls, by their triangles."""
    import bpy

    from blender_addon.translate.meshes.triangles import translate_mesh

    found = {}
    for size in sizes:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=size, ring_count=size // 2 + 1)
        data = bpy.context.object.data
        data.polygons.foreach_set("use_smooth", np.ones(len(data.polygons), dtype=bool))
        start = time.thread_time()
        mesh = translate_mesh("ball", data)
        ms = 1e3 * (time.thread_time() - start)
        assert mesh is not None
        found[f"{len(mesh.triangles)} triangles"] = ms
        print(f"a mesh of {len(mesh.triangles):,} triangles is translated in {ms:.0f} ms")
    return found


def _copies(count: int) -> dict[str, float]:
    """Median milliseconds of a launch in a view of many copies."""
    from spectral_core.render.live import gathered

    found, fewest = {}, gathered.FEWEST
    try:
        for name, gathered.FEWEST in (("one mesh", fewest), ("single instances", count + 1)):
            found[name] = ms = _launched(count)
            print(f"a launch in a view of {count:,} copies as {name} takes {ms:.0f} ms")
    finally:
        gathered.FEWEST = fewest
    return found


def _launched(count: int) -> float:
    from dataclasses import replace

    from benchmarks.viewport.cases.latency_scene import HEIGHT, WIDTH, balls
    from spectral_core.render.live.picture import ViewPicture
    from spectral_core.render.live.stage import Stage
    from spectral_core.render.live.view import Viewpoint, ViewRequest
    from spectral_core.scene import Instance, Mesh

    corners = np.array([(0, 0, 0), (0.05, 0, 0), (0, 0.05, 0), (0, 0, 0.2)], np.float32)
    seed = Mesh("seed", corners, np.array([(0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)], np.uint32))
    scene, rng, items = balls(True, "rgb"), np.random.default_rng(1), []
    for number in range(count):
        matrix = np.eye(4)
        matrix[:2, 3] = rng.uniform(-3, 3, 2)
        items.append(Instance(f"copy {number}", "seed", matrix, scene.instances[-1].materials))
    scene = replace(scene, meshes=(*scene.meshes, seed), instances=(*scene.instances, *items))
    stage, viewpoint = Stage(), Viewpoint.of_camera(scene.camera, scene.film)
    stage.show(scene)
    stage.activate()
    picture = ViewPicture(stage.launcher, ViewRequest("copies", viewpoint, WIDTH, HEIGHT, 2, 0), 4)
    stage.look_from(viewpoint)
    times = []
    while not picture.is_done:
        start = time.perf_counter()
        picture.step()
        times.append(1e3 * (time.perf_counter() - start))
    return float(np.median(times))
