# SPDX-License-Identifier: GPL-3.0-or-later
"""Print the cost of accuracy for a .blend file: error against time, measured on some of its pixels and predicted."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

from spectral_core.cli.shared.parser import without_companion
from spectral_core.cli.shared.report import print_json

from . import _blend
from .plan import translated_scene


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    _blend.add_scene_arguments(parser)
    _blend.add_accuracy_arguments(parser)
    parser.add_argument(
        "--plot", type=Path, metavar="FILE.png",
        help="also draw error over time (.png, .svg or .pdf); needs the Python package matplotlib",
    )  # fmt: skip
    parser.add_argument(
        "--axis", default="samples", help="variable of the plot: samples, bounces, transport, volume step"
    )


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    return without_companion(arguments, {"axis": "plot"})


def run(arguments: argparse.Namespace) -> int:
    """Print the table, then the prediction for the file's settings."""
    from spectral_core.render import RenderProcess
    from spectral_core.render.cost.curve import table
    from spectral_core.render.cost.figure import require_drawable, write_figure

    if arguments.plot is not None:
        require_drawable(arguments.plot, arguments.axis)  # the measurement takes minutes
    with _blend.chatter_to_stderr():
        _blend.open_scene(arguments)
        if arguments.plot is not None:
            _blend.require_outputs([arguments.plot])
        scene = translated_scene(arguments)
    with RenderProcess() as process:
        curve = process.cost_curve(scene)
    if arguments.plot is not None:  # before printing, because the reader of the table may close the pipe
        write_figure(arguments.plot, curve, arguments.axis, arguments.scene.stem)
    print(table(curve))
    print(f"measured on {curve.probe_pixels} pixels in {curve.seconds:.1f} s")
    notes = [*_blend.missing_files(), *(f"{note.subject}: {note.message}" for note in scene.notes)]
    for note in notes:
        print(f"note: {note}")
    if arguments.plot is not None:
        print(f"{arguments.plot}: error over time")
    if arguments.json:
        report = {
            "points": [dataclasses.asdict(point) for point in curve.points],
            "now": dataclasses.asdict(curve.now),
            "at_error_1": dataclasses.asdict(curve.at_error),
            "probe_pixels": curve.probe_pixels,
            "seconds": curve.seconds,
            "notes": notes,
        }
        print_json(report)
    return 0
