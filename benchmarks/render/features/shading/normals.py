# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading normals: smooth-shaded hard edges, and meshes that emit light, flat and smooth."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _lathe(profile: list[tuple[float, float]], segments: int = 48) -> Any:
    """A mesh turned about z, smooth shaded whatever its angles: hard edges as an artist's first cup has them."""
    turns = np.arange(segments) * 2 * np.pi / segments
    points = [(r * np.cos(a), r * np.sin(a), z) for r, z in profile for a in turns]
    faces = [
        (k * segments + j, k * segments + after, (k + 1) * segments + after, (k + 1) * segments + j)
        for k in range(len(profile) - 1)
        for j, after in zip(range(segments), [*range(1, segments), 0], strict=True)
    ]
    mesh = bpy.data.meshes.new("Lathe")
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    mesh.update()
    return mesh


CUP = [(0.01, 0.0), (0.8, 0.0), (0.9, 1.6), (0.8, 1.6), (0.7, 0.15), (0.01, 0.15)]


def cup(smooth: bool, shader: str = "") -> Callable[[Stage], None]:
    """A cup with hard edges on the floor, in place of the ball."""

    def build(stage: Stage) -> None:
        bpy.data.objects.remove(stage.ball)
        if shader:
            stage.shader(shader)
        stage.ball = stage.object("Cup", _lathe(CUP))
        stage.ball.data.materials.append(stage.material_of_ball)
        if not smooth:
            stage.ball.data.polygons.foreach_set("use_smooth", np.zeros(len(stage.ball.data.polygons), bool))
        stage.camera.location, stage.camera.rotation_euler = (0, -5.0, 4.0), (0.95, 0, 0)

    return build


def _emissive(kind: str, smooth: bool) -> Callable[[Stage], None]:
    """A mesh that illuminates the floor."""

    def build(stage: Stage) -> None:
        bpy.data.objects.remove(stage.ball)
        bpy.data.objects.remove(stage.lamp)
        stage.set_world((0, 0, 0))
        getattr(bpy.ops.mesh, f"primitive_{kind}_add")(location=(0, 0, 1.2), rotation=(1.2, 0.3, 0))
        stage.ball = bpy.context.object
        stage.ball.data.polygons.foreach_set("use_smooth", np.full(len(stage.ball.data.polygons), smooth))
        stage.shader("ShaderNodeEmission", Strength=5.0)
        stage.ball.data.materials.append(stage.material_of_ball)

    return build


for _smooth in (False, True):
    _how = "smooth" if _smooth else "flat"
    feature(f"normals/cup {_how}", cup(_smooth))
    feature(f"normals/emissive torus {_how}", _emissive("torus", _smooth))
    feature(f"normals/emissive cylinder {_how}", _emissive("cylinder", _smooth))
    feature(f"normals/emissive ball {_how}", _emissive("uv_sphere", _smooth))
feature("normals/emissive cube smooth", _emissive("cube", True))
feature("normals/cup smooth glossy", cup(True, "ShaderNodeBsdfAnisotropic"))
feature("normals/cup smooth principled", cup(True, "ShaderNodeBsdfPrincipled"))
feature("normals/cup smooth glass", cup(True, "ShaderNodeBsdfGlass"), 4)
