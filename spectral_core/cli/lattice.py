# SPDX-License-Identifier: GPL-3.0-or-later
"""Fill a region of parameters with evenly spread points, and print their figures of merit.

Points are listed coarse levels first: every beginning of the list fills the region. Distances count in shares of the
ranges, so that parameters may have different units. ``--plot`` draws the lattices.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.cli.shared.outputs import require_format, require_outputs
from spectral_core.cli.shared.report import print_json
from spectral_core.errors import InvalidInputError, counted
from spectral_core.files.whole import whole_file

NAMED = {
    "rate": "--rate", "the number of points": "--points", "low": "--low", "high": "--high",
    "the box": "the box of --low and --high", "p": "--ball", "seed": "--seed",
}  # fmt: skip


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``spectral-scene lattice``."""
    parser.add_argument("--dims", type=int, default=2, metavar="N", help="parameters, 1 to 16 (default 2)")
    parser.add_argument("--rate", type=int, default=2, metavar="B", help="points grow by this factor per level: 2 or 3")
    parser.add_argument("--points", type=int, default=64, metavar="M", help="exactly this many points (default 64)")
    parser.add_argument("--low", type=float, nargs="+", metavar="X", help="lower ends of the ranges (default 0)")
    parser.add_argument("--high", type=float, nargs="+", metavar="X", help="upper ends of the ranges (default 1)")
    shape = parser.add_mutually_exclusive_group()
    shape.add_argument(
        "--ball", type=float, metavar="P", help="the p-norm ball in the ranges instead of their box, P >= 1"
    )
    shape.add_argument("--simplex", action="store_true", help="x >= 0 with sum at most 1 instead of a box")
    parser.add_argument("--refine", type=int, default=0, metavar="K", help="add K finer levels; no point moves")
    parser.add_argument(
        "--latin", action="store_true", help="move the points of a box so that they divide each axis evenly"
    )
    parser.add_argument(
        "--criterion", default="packing", help="figure of merit of the lattice: packing, second_moment, covering, unit"
    )
    parser.add_argument("--seed", type=int, default=0, help="draws rotation and offset (default 0)")
    parser.add_argument("--out", type=Path, metavar="FILE.csv", help="write the points, one per line")
    parser.add_argument("--plot", type=Path, metavar="DIR", help="write pictures of the lattices of this rate (PNG)")


def run(arguments: argparse.Namespace) -> int:
    """Fill, measure, write."""
    from spectral_core import lattice

    if arguments.out is not None:
        require_format("--out", arguments.out, "CSV", ".csv", ".txt")
    if not 1 <= arguments.dims <= 16:
        raise InvalidInputError(f"--dims is {arguments.dims}; expected 1 to 16 dimensions")
    if arguments.refine < 0:
        raise InvalidInputError(f"--refine is {arguments.refine}; expected 0 or more finer levels")
    if not 0 <= arguments.points <= lattice.MAX_POINTS:
        raise InvalidInputError(f"--points is {arguments.points}; expected 0 to {lattice.MAX_POINTS:,}")
    expected = arguments.points * float(arguments.rate) ** min(arguments.refine, 1000)
    if expected > lattice.MAX_POINTS:
        raise InvalidInputError(
            f"--points {arguments.points} with --refine {arguments.refine} makes about {expected:.3g} points; expected "
            f"at most {lattice.MAX_POINTS:,}. Take fewer of them"
        )
    low, high = _ranges(arguments)
    region = _region(arguments, low, high)
    if arguments.out is not None:
        require_outputs([arguments.out])
    # Distances between parameters of different units count in shares of their ranges.
    offset, width = (np.zeros_like(low), np.ones_like(low)) if arguments.simplex else (low, high - low)
    chosen = lattice.make_lattice(arguments.dims, arguments.rate, criterion=arguments.criterion)
    progressive = lattice.progressive_fill(region, arguments.points, lattice=chosen, seed=arguments.seed)
    for _ in range(arguments.refine):
        progressive = progressive.refine()
    points = progressive.points
    if arguments.latin:
        points = _latinized(region, points)
    report = _report(chosen, points, region)
    # Rounding must not move a point out of its range.
    points = np.clip(offset + points * width, low, high)
    _require_apart(points, low, high)
    if arguments.out is not None:
        with whole_file(arguments.out) as unfinished, unfinished.open("w", encoding="utf-8") as stream:
            np.savetxt(stream, points, fmt="%.17g", delimiter=",", header=_header(arguments.dims), comments="")
        report["written"] = str(arguments.out)
    if arguments.plot is not None:
        from spectral_core.lattice.measure.plotting import draw_all

        report["pictures"] = {name: str(path) for name, path in draw_all(arguments.plot, arguments.rate).items()}
    _print_report(report)
    if arguments.json:
        print_json(report)
    elif arguments.out is None:
        digits = [_digits(*ends) for ends in zip(low, high, strict=True)]
        lines = (",".join(f"{x:.{n}g}" for x, n in zip(point, digits, strict=True)) for point in points[:20])
        print("\n".join(lines))
        if len(points) > 20:
            print(f"... {len(points) - 20} more; --out FILE.csv writes them all")
    return 0


def _ranges(arguments: argparse.Namespace) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper ends, one number standing for all parameters."""
    ends = []
    for name, given, default in (("low", arguments.low, 0.0), ("high", arguments.high, 1.0)):
        values = np.array([default] if given is None else given)
        if len(values) not in (1, arguments.dims):
            raise InvalidInputError(
                f"--{name} has {counted(len(values), 'value')}; expected 1 or one per parameter ({arguments.dims})"
            )
        ends.append(np.broadcast_to(values, (arguments.dims,)).copy())
    return ends[0], ends[1]


def _region(arguments: argparse.Namespace, low: np.ndarray, high: np.ndarray) -> Any:
    """The region to fill: in shares of the ranges, except for a simplex, whose parameters have one unit."""
    from spectral_core import lattice

    ranges = lattice.box(low, high)  # checks them
    if arguments.simplex:
        return lattice.corner_simplex(arguments.dims) & ranges
    if arguments.ball is not None:
        return lattice.ball(np.full(arguments.dims, 0.5), 0.5, p=arguments.ball)
    return lattice.unit_cube(arguments.dims)


def _digits(low: float, high: float) -> int:
    """Digits of a printed value: six beyond those that all values of its range share."""
    shared = math.log10(max(abs(low), abs(high))) - math.log10(high - low)
    return min(17, 6 + max(0, math.ceil(shared - 1e-9)))


def _require_apart(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Refuse ranges with so few double numbers that points would fall on each other."""
    different = len(np.unique(points, axis=0))
    if different < len(points):
        axis = int(np.argmin((high - low) / np.spacing(np.maximum(np.abs(low), np.abs(high)))))
        raise InvalidInputError(
            f"only {different} of {len(points)} points differ: the range from {float(low[axis])!r} to "
            f"{float(high[axis])!r} of parameter {axis + 1} has too few double numbers. Widen it, or fill the "
            "range from 0 and add its lower end later"
        )


def _latinized(region: Any, points: np.ndarray) -> np.ndarray:
    from spectral_core.lattice import latinized

    if region.box_limits is None:
        raise InvalidInputError(
            "--latin moves values to equal ranks, which only a box keeps; leave out --ball and --simplex"
        )
    return latinized(points)


def _report(chosen: Any, points: np.ndarray, region: Any) -> dict[str, Any]:
    """Figures of the lattice and, for two points or more in a box, of the points in shares of their ranges."""
    from spectral_core import lattice

    merit = lattice.figures_of_merit(chosen.generator, samples=8192)
    report: dict[str, Any] = {
        "points": len(points),
        "lattice": repr(chosen),
        "packing_radius": merit.packing_radius,
        "kissing_number": merit.kissing_number,
        "second_moment": merit.second_moment.value,
        "second_moment_standard_error": merit.second_moment.standard_error,
        "covering_radius": [merit.covering_radius.lower, merit.covering_radius.upper],
        "density": merit.density,
        "faces": merit.face_counts,
    }
    if len(points) >= 2 and region.box_limits is not None:
        low, high = region.box_limits
        report["evenness"] = asdict(lattice.evenness((points - low) / (high - low)))
    return report


def _print_report(report: dict[str, Any]) -> None:
    from spectral_core.lattice.measure.measures import MOST_PAIRED

    print(f"{counted(report['points'], 'point')} of {report['lattice']}")
    print(f"packing radius {report['packing_radius']:.6f}, kissing number {report['kissing_number']}")
    low, high = report["covering_radius"]
    print(f"second moment {report['second_moment']:.6f} ± {report['second_moment_standard_error']:.1g}")
    print(f"covering radius {low:.4f}" + ("" if low == high else f" to {high:.4f}"))
    for name, value in report.get("evenness", {}).items():
        if math.isfinite(value):
            print(f"  {name.replace('_', ' '):14} {value:.4g}")
        elif name == "discrepancy":
            print(f"  {name:14} not computed: more than {MOST_PAIRED:,} points")
    for path in [report.get("written"), *report.get("pictures", {}).values()]:
        if path:
            print(f"wrote {path}")


def _header(dims: int) -> str:
    return ",".join(f"x{i + 1}" for i in range(dims))
