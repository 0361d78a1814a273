# SPDX-License-Identifier: GPL-3.0-or-later
"""Say which effects a render of a .blend file simulates, and why; nothing is rendered."""

from __future__ import annotations

import argparse
import json

from spectral_core.errors import RenderCancelled, RenderError
from spectral_core.scene import Scene

from . import _blend


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    _blend.add_scene_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print the plan, an effect per line, then the notes."""
    from spectral_core.render import plan_effects

    with _blend.chatter_to_stderr():
        _blend.open_scene(arguments)
        scene = translated_scene(arguments)
    plan = plan_effects(scene)
    notes = [*_blend.missing_files(), *(f"{note.subject}: {note.message}" for note in scene.notes)]
    for row in plan.as_rows():
        print(f"{row['effect']:16} {row['value']:10} {row['reason']}")
    for note in notes:
        print(f"note: {note}")
    if arguments.json:
        print(json.dumps({"plan": plan.as_rows(), "notes": notes}))
    return 0


def translated_scene(arguments: argparse.Namespace) -> Scene:
    """The open file as scene data, exactly as a render sees it: the render is left as soon as it is translated."""
    import bpy

    from .. import jobs

    caught: list[Scene] = []

    def catch(scene: Scene) -> Scene:
        caught.append(_blend.with_variant(scene, arguments.variant))
        raise RenderCancelled("only the plan was asked for")

    with jobs.request(jobs.RenderRequest(translated=catch)):
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            raise RenderError(_blend.blender_message(error)) from error
    if not caught:
        raise RenderError("Blender did not start the render; its messages above say why")
    return caught[0]
