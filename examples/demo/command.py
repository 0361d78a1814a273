# SPDX-License-Identifier: GPL-3.0-or-later
"""Build a still life, design two glazes for it, render it under two lights, and write pictures and a report."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from spectral_core.checks import require_range
from spectral_core.cli.shared.report import print_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("--out", type=Path, default=Path("out/demo"), help="folder to write into (out/demo)")
    parser.add_argument("--samples", type=int, default=48, help="light paths per pixel (48)")
    parser.add_argument("--percentage", type=int, default=100, help="size of the pictures in percent (100)")


def run(arguments: argparse.Namespace) -> int:
    """Make the demo; the figures are those of its rendered pixels."""
    require_range("--samples", arguments.samples, 1, 1 << 20)
    require_range("--percentage", arguments.percentage, 20, 400, " %")
    start = time.perf_counter()
    from blender_addon.commands import _blend
    from examples.demo.report import write_report
    from examples.demo.run import run_demo

    with _blend.chatter_to_stderr():
        demo = run_demo(arguments.out, samples=arguments.samples, percentage=arguments.percentage, say=_say)
    report = write_report(demo)
    seconds = round(time.perf_counter() - start, 1)
    for rendered in demo.rendered:
        print(f"under {rendered.light.name:4} the mark differs from the ground by ΔE2000 "
              f"{rendered.contrast.mean:.2f}: {rendered.picture}")  # fmt: skip
    print(f"report: {report} ({seconds:.0f} s in all)")
    if arguments.json:
        figures = {r.light.name: round(r.contrast.mean, 3) for r in demo.rendered}
        print_json({"mark_delta_e": figures, "spp": demo.rendered[0].result.samples, "seconds": seconds})
    return 0


def _say(text: str) -> None:
    print(f"demo: {text}", file=sys.stderr, flush=True)
