# SPDX-License-Identifier: GPL-3.0-or-later
"""Lattices: radii, second moment, classes, residuals, exact fills of 1000 polytopes, prefixes, time and memory."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.lattice.cases.polytopes import KINDS, random_polytope
from spectral_core import lattice
from spectral_core.errors import SpectralError
from spectral_core.lattice.construction import MAX_LOG_SCALE
from spectral_core.lattice.measure.plotting import distinct_planar_lattices

PUBLISHED = {
    (2, 2): 0.500000, (2, 3): 0.537285, (3, 2): 0.482535, (3, 3): 0.482911, (4, 2): 0.524091, (4, 3): 0.547386,
    (5, 2): 0.525590, (5, 3): 0.516484, (6, 2): 0.562464, (6, 3): 0.574755, (7, 2): 0.566882, (7, 3): 0.569270,
    (8, 2): 0.601126, (8, 3): 0.619160, (9, 2): 0.600738, (9, 3): 0.603955, (10, 2): 0.638897, (10, 3): 0.641870,
}  # fmt: skip
"""Packing radii by (n, rate) of an earlier search; ours for (5, 3) is larger, that value is a local optimum."""


def run(options: Options) -> dict[str, Any]:
    """Print and return every acceptance figure of the lattice room."""
    figures: dict[str, Any] = {}
    figures["radii"] = _radii()
    figures["shipped"] = shipped()
    figures["ready_lattice_us"] = _look_up()
    figures["best_3d"] = _best_3d()
    figures["planar_lattices"] = {str(rate): len(distinct_planar_lattices(rate)) for rate in (2, 3)}
    print(f"lattices of the plane: {figures['planar_lattices']}")
    figures["residuals"] = _residuals()
    figures["whiteness"] = _whiteness(16384 if options.quick else 131072)
    figures["polytopes"] = _polytopes(40 if options.quick else 1000)
    figures["cube"] = _cube(512 if options.quick else 4096)
    figures["prefixes"] = _prefixes(512 if options.quick else 4096)
    figures["hard_cases"] = _hard_cases()
    return figures | {"holds": holds(figures, 16384 if options.quick else 131072)}


def holds(figures: dict[str, Any], samples: int) -> dict[str, bool]:
    """Claims of docs/lattice.md. Blocks of equal error differ by the noise of the samples alone."""
    best, residuals, prefixes = figures["best_3d"], figures["residuals"], figures["prefixes"].values()
    return {
        "no packing radius is below that of the earlier search": all(
            row["radius"] > row["published"] - 5e-7 for row in figures["radii"].values()
        ),
        "the cell of the best 3D lattice of rate 2 has 14 faces and 24 vertices": (
            (best["faces"], best["vertices"], round(best["second_moment"], 7)) == (14, 24, 0.0819044)
        ),
        "three lattices of the plane have rate 2, four have rate 3": figures["planar_lattices"] == {"2": 3, "3": 4},
        "QG = GK and QᵀQ = α²I to 2e-14": max(residuals["similarity"], residuals["rotation"]) < 2e-14,
        "blocks of the frozen second-moment scales have equal errors": (
            max(figures["whiteness"].values()) < 4 / samples**0.5
        ),
        "every polytope is filled with exactly m points": figures["polytopes"]["succeeded"]
        == figures["polytopes"]["count"],
        "no prefix is closer than 0.496, and refined points keep their bits": all(
            row["least"] >= 0.496 and row["refined_same_bits"] for row in prefixes
        ),
    }


def _radii() -> dict[str, Any]:
    print("\n n rate  packing radius  published  difference  kissing  S = I (companion, best C)")
    rows: dict[str, Any] = {}
    for (n, rate), published in PUBLISHED.items():
        radius, kissing = lattice.packing(lattice.make_lattice(n, rate, criterion="packing").generator)
        companions = [one for one in lattice.all_lattices(n, rate) if one.lattice_class.index == 0]
        plain = max(lattice.packing(one.generator)[0] for one in companions)
        rows[f"{n},{rate}"] = {"radius": radius, "published": published, "kissing": kissing, "unit_scales": plain}
        print(
            f"{n:2} {rate:4}  {radius:14.7f}  {published:9.6f}  {radius - published:+10.1e}  {kissing:7}  {plain:.5f}"
        )
    return rows


def shipped() -> list[str]:
    """The frozen lattices as rows of the table in docs/lattice.md."""
    rows = ["| n | rate | second moment | class | packing radius | kissing | class | covering radius | class |"]
    rows.append("|" + "---|" * 9)
    for n in range(2, 11):
        for rate in (2, 3):
            row = f"| {n} | {rate}"
            for criterion, digits in (("second_moment", 6 if n > 4 else 7), ("packing", 6), ("covering", 4)):
                one = lattice.frozen_scales(n, rate, criterion)
                row += f" | {one.value:.{digits}f}{'' if one.exact or criterion == 'second_moment' else ' or more'}"
                if criterion == "packing":
                    row += f" | {lattice.packing(lattice.make_lattice(n, rate, criterion=criterion).generator)[1]}"
                row += f" | {one.lattice_class}"
            rows.append(row + " |")
    print("\n" + "\n".join(rows) + "\n")
    return rows


def _look_up() -> float:
    """Microseconds of a repeated ``make_lattice``."""
    lattice.make_lattice(10, 3)
    start = time.perf_counter()
    for _ in range(1000):
        lattice.make_lattice(10, 3)
    micros = (time.perf_counter() - start) * 1000.0
    print(f"make_lattice(10, 3) again: {micros:.1f} µs")
    return micros


def _best_3d() -> dict[str, Any]:
    merit = lattice.figures_of_merit(lattice.make_lattice(3, 2).generator)
    assert merit.face_counts is not None
    row = {
        "second_moment": merit.second_moment.value,
        "faces": merit.face_counts[-1],
        "vertices": merit.face_counts[0],
        "kissing": merit.kissing_number,
    }
    print(f"\nbest 3D lattice of rate 2: {row}")
    return row


def _residuals() -> dict[str, Any]:
    """Largest residuals over every class of n to 16 and rates 2, 3, 5, 6, 7, scales at the edge of their range."""
    worst_similarity, worst_rotation, count = 0.0, 0.0, 0
    rng = np.random.default_rng(0)
    for n in range(1, 17):
        for rate in (2, 3, 5, 6, 7):
            for one in lattice.lattice_classes(n, rate, improper=None).classes:
                sizes = one.polynomial.block_sizes
                for edge in (0.0, 1.0):
                    logs = rng.normal(size=len(sizes))
                    logs -= sizes @ logs / sizes.sum()
                    logs *= edge * MAX_LOG_SCALE / max(float(np.abs(logs).max()), 1e-9) if len(sizes) > 1 else 0.0
                    similarity, rotation = lattice.build_lattice(one, logs).residuals()
                    worst_similarity = max(worst_similarity, similarity)
                    worst_rotation = max(worst_rotation, rotation)
                    count += 1
    print(f"{count} constructions: max |QG - GK| / |G| {worst_similarity:.1e}, max |QᵀQ - α²I| {worst_rotation:.1e}")
    return {"constructions": count, "similarity": worst_similarity, "rotation": worst_rotation}


def _whiteness(samples: int) -> dict[str, float]:
    rows = {
        f"{n},{rate}": lattice.whiteness(lattice.make_lattice(n, rate), samples=samples)
        for n in range(2, 11)
        for rate in (2, 3)
    }
    print(f"white-error test of the frozen scales: largest deviation {max(rows.values()):.4f} ({samples} samples)")
    return rows


def _polytopes(count: int) -> dict[str, Any]:
    """Exact fills of random polytopes in 2 to 10 dimensions; m between 1 and 1000."""
    succeeded, slowest, failures = 0, 0.0, []
    start = time.perf_counter()
    for index in range(count):
        kind, region = random_polytope(index)
        points = (1, 64, 100, 257, 1000)[index % 5]
        one = lattice.make_lattice(region.dimensions, 2 + index % 2, criterion="packing")
        begin = time.process_time()
        try:
            frame, k = lattice.fill_exactly(one, region, points, seed=index)
            inside = region.contains(frame.positions(k))
            good = len(k) == points and bool(inside.all()) and len(np.unique(k, axis=0)) == points
        except SpectralError as error:
            good = False
            print(f"  {index} {kind}: {error}")
        slowest = max(slowest, time.process_time() - begin)
        succeeded += good
        if not good:
            failures.append(index)
    wall = time.perf_counter() - start
    print(f"{succeeded} of {count} polytopes ({len(KINDS)} kinds) filled in {wall:.0f} s, slowest {slowest:.1f} s CPU")
    return {"succeeded": succeeded, "count": count, "failures": failures, "slowest_cpu_s": slowest, "wall_s": wall}


def _cube(count: int) -> dict[str, Any]:
    """Time and memory of a fill of the cube in 10 dimensions, best of three after one call that fills the caches."""
    region = lattice.unit_cube(10)
    lattice.progressive_fill(region, 64)
    walls, processor = [], []
    for seed in range(3):
        wall, cpu = time.perf_counter(), time.process_time()
        points = lattice.progressive_fill(region, count, seed=seed)
        walls.append(time.perf_counter() - wall)
        processor.append(time.process_time() - cpu)
        assert len(points) == count
    memory = {}
    for m in (count // 4, count, 4 * count):
        tracemalloc.start()
        lattice.progressive_fill(lattice.unit_cube(6), m)
        memory[str(m)] = tracemalloc.get_traced_memory()[1] / m
        tracemalloc.stop()
    print(f"n = 10, m = {count}: {min(walls):.2f} s wall, {min(processor):.2f} s CPU")
    print("peak bytes per point, n = 6: " + ", ".join(f"m = {m}: {size:.0f}" for m, size in memory.items()))
    return {"points": count, "wall_s": min(walls), "cpu_s": min(processor), "bytes_per_point": memory}


def _prefixes(count: int) -> dict[str, Any]:
    rows = {}
    for seed in range(3):
        points = lattice.progressive_fill(lattice.unit_cube(6), count, seed=seed)
        separations = lattice.prefix_separations(points.points)
        refined = points.refine()
        same = refined.points[:count].tobytes() == points.points.tobytes()
        rows[str(seed)] = {
            "least": float(separations.min()),
            "at": int(separations.argmin()) + 2,
            "refined_same_bits": same,
        }
        print(
            f"n = 6, m = {count}, seed {seed}: least separation of a prefix {separations.min():.4f}; same bits {same}"
        )
    return rows


def _hard_cases() -> dict[str, str]:
    """Each case with its answer or its error, and how long that took."""
    cube, one = lattice.unit_cube, lattice.make_lattice
    far = lattice.box(np.full(6, 1e9), np.full(6, 1e9 + 1.0))
    cases: dict[str, Callable[[], Any]] = {
        "m = 0": lambda: lattice.progressive_fill(cube(6), 0),
        "m = 1": lambda: lattice.progressive_fill(cube(6), 1),
        "m = 2": lambda: lattice.progressive_fill(cube(6), 2),
        "m = 10^15": lambda: lattice.progressive_fill(cube(6), 10**15),
        "1e9 from the origin": lambda: lattice.progressive_fill(far, 1000),
        "1e-200 wide": lambda: lattice.progressive_fill(lattice.box(np.zeros(6), np.full(6, 1e-200)), 1000),
        "zero volume": lambda: lattice.progressive_fill(
            lattice.halfspaces(np.r_[np.eye(6), -np.eye(6)], np.r_[np.ones(6), -np.ones(6)]), 10
        ),
        "unbounded": lambda: lattice.progressive_fill(lattice.halfspaces(np.eye(6), np.ones(6)), 10),
        "scales at the edge": lambda: lattice.progressive_fill(
            cube(4), 100, lattice=one(4, 2, log_scales=[12.0, -12.0])
        ),
        "scales beyond": lambda: one(4, 2, log_scales=[300.0, -300.0]),
        "n = 16": lambda: lattice.progressive_fill(
            lattice.ball(np.zeros(16), 1.0), 256, lattice=one(16, 2, criterion="unit")
        ),
    }
    answers = {}
    for name, case in cases.items():
        begin = time.perf_counter()
        try:
            answer = case()
            text = f"{len(answer)} points, all inside: {bool(answer.region.contains(answer.points).all())}"
        except SpectralError as error:
            text = f"{type(error).__name__}: {error}"
        print(f"{name:22} {time.perf_counter() - begin:6.2f} s  {text}")
        answers[name] = text
    return answers
