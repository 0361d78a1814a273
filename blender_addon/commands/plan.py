# SPDX-License-Identifier: GPL-3.0-or-later
"""Print which effects a render of a .blend file simulates, why, and the error of leaving each out."""

from __future__ import annotations

import argparse
import sys

from spectral_core.cli.shared.report import print_json
from spectral_core.errors import InvalidInputError, RenderError
from spectral_core.scene import Scene

from . import _blend

NAMED = {"the tolerance (ΔE2000)": "--tolerance"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    _blend.add_scene_arguments(parser)
    parser.add_argument("--tolerance", type=float, metavar="E", help="color error (ΔE2000) that the plan may cause")
    parser.add_argument(
        "--no-pilot", action="store_true", help="decide from the scene's data alone: no light path is traced"
    )


def run(arguments: argparse.Namespace) -> int:
    """Print the plan, an effect per line, then the notes."""
    from spectral_core.render import RenderProcess, plan_from_data
    from spectral_core.render.cost.asked import tightened
    from spectral_core.render.plan.decision import table

    tolerance = arguments.tolerance
    if tolerance is not None and not tolerance >= 0:
        raise InvalidInputError(f"--tolerance is {tolerance:g}; expected a color error (ΔE2000) of 0 or more")

    with _blend.chatter_to_stderr():
        _blend.open_scene(arguments)
        scene = translated_scene(arguments)
    if arguments.no_pilot:
        plan = plan_from_data(tightened(scene), tolerance)
    else:
        with RenderProcess() as process:
            plan = process.plan(scene, tolerance)
    notes = [*_blend.missing_files(), *(f"{note.subject}: {note.message}" for note in (*scene.notes, *plan.notes))]
    print(table(plan))
    paths = f"{plan.pilot_paths} light paths" if plan.pilot_paths else "no light path"
    print(f"tolerance ΔE {plan.tolerance_delta_e:g}, accepted ΔE {plan.accepted:.2g} at most; {paths} traced to decide")
    for note in notes:
        print(f"note: {note}")
    if arguments.json:
        figures = {"tolerance": plan.tolerance_delta_e, "accepted": plan.accepted, "pilot_paths": plan.pilot_paths}
        print_json({"plan": plan.as_rows(), **figures, "notes": notes})
    return 0


def translated_scene(arguments: argparse.Namespace) -> Scene:
    """Scene data of the open file as a render reads them: a render begins, and ends once the scene is translated.

    They are those of the first view layer that is rendered; others are named on standard error.
    """
    import bpy

    from ..editing.dial.as_rendered import Layers, first_layer, translated_at_once

    source = bpy.context.scene
    layers = Layers.of(source, first_layer(source))
    try:
        scene = translated_at_once(source, lambda found: _blend.with_variant(found, arguments.variant))
    except RuntimeError as error:
        raise RenderError(_blend.blender_message(error)) from error
    if layers.told:
        print(f"note: {layers.told}", file=sys.stderr)
    return scene
