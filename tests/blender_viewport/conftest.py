# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender with a small scene and a stand-in for a 3D view, because bpy from PyPI has no window."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


class Link:
    """A stand-in for the renderer that records its calls."""

    def __init__(self) -> None:
        self.scenes, self.requests, self.dropped, self.closed = {}, [], [], []
        self.paused = {}

    def show(self, stage, scene):
        from spectral_core.render.live.in_place.changes import difference

        old = self.scenes.get(stage)
        change = None if old is None else difference(old, scene)
        self.scenes[stage] = scene if change is None else change.applied_to(old)
        return frozenset(("scene",) if change is None else (*change.items, *change.singles))

    def look(self, view, request, on_news):
        self.requests.append(request)
        return len(self.requests)

    def wait(self, view, generation, seconds, level=0):
        return False

    def latest(self, view):
        return None

    def trouble(self, view):
        return ""

    def pause(self, view, *, is_paused):
        self.paused[view] = is_paused

    def close_view(self, view):
        self.closed.append(view)

    def drop(self, stage):
        self.dropped.append(stage)


@pytest.fixture
def stage(blender, monkeypatch):
    """Plane, ball and lamp, and a view of them with the recording stand-in as renderer."""
    from blender_addon import jobs
    from blender_addon.editing.viewport import session as sessions
    from blender_addon.editing.viewport.session import ViewSession

    link = Link()
    monkeypatch.setattr(jobs, "live", lambda: link)
    monkeypatch.setattr(sessions, "UPDATE_S", float("inf"))  # a busy machine must not divide the updates of tests
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    material = bpy.data.materials.new("Paint")
    if material.node_tree is None:  # before Blender 5
        material.use_nodes = True
    bpy.ops.mesh.primitive_plane_add(size=6)
    bpy.context.object.name = "Floor"
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 1), segments=12, ring_count=8)
    bpy.context.object.name = "Ball"
    bpy.data.objects["Ball"].data.materials.append(material)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location = (2, -2, 4)
    scene.collection.objects.link(lamp)
    projection = np.diag([2.0, 3.0, -1.0, 0.0])
    projection[3, 2] = -1.0
    region_data = SimpleNamespace(
        window_matrix=projection, view_matrix=np.eye(4), is_perspective=True, view_perspective="PERSP"
    )
    own = {"local_view": None, "use_local_collections": False, "camera": None, "use_local_camera": False}
    own |= {"use_render_border": False, "as_pointer": lambda: 1}
    space = SimpleNamespace(**own, clip_start=0.1, clip_end=100.0)
    region, area = SimpleNamespace(width=90, height=60), SimpleNamespace(regions=())
    context = SimpleNamespace(space_data=space, area=area, region=region, region_data=region_data)
    session = ViewSession(lambda: None)
    return SimpleNamespace(session=session, context=context, link=link, scene=scene, material=material)


@pytest.fixture
def coarse(stage, monkeypatch):
    """The same with coarse pictures of skies and coarse grids of media: what a view sends does not depend on them."""
    from blender_addon.translate.lighting import patterns
    from blender_addon.translate.shading.media import regions
    from blender_addon.translate.shading.nodes import skies as sky_nodes

    monkeypatch.setattr(patterns, "ROWS", 64)
    monkeypatch.setattr(sky_nodes, "SKY_ROWS", 64)
    monkeypatch.setattr(sky_nodes, "LAST_ROWS", (0.5 / 64, 1 - 0.5 / 64))
    monkeypatch.setattr(regions, "SIZES", (8, 12))
    monkeypatch.setattr(regions, "PROBES", 256)
    patterns._latest.clear()
    yield stage
    patterns._latest.clear()
