# SPDX-License-Identifier: GPL-3.0-or-later
"""From the state of a solve to a ``PaletteSolution``: colors, errors, status."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.criteria import REFERENCE_STEP_NM, second_differences
from spectral_core.palette.assemble.requests import Requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.cell_errors import CellErrors, cell_errors
from spectral_core.palette.inaccurate import (
    excluded_pair,
    extreme_number,
    held_materials,
    is_proven,
    luminance_outside,
    missed_as_measured,
    only_black,
    unlit,
    white_remedy,
)
from spectral_core.palette.problem import CellIndex, PaletteProblem
from spectral_core.palette.qp.answer import Check, checked
from spectral_core.palette.qp.block import DIM
from spectral_core.palette.solution import (
    NOT_FOUND,
    REMEDIES,
    ROUGH,
    UNRELIABLE,
    VISIBLE_DELTA_E,
    PaletteSolution,
    PaletteStatus,
)
from spectral_core.spectra.color import XYZ_FROM_RGB
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum

if TYPE_CHECKING:
    from spectral_core.palette.design.rounds import SolveTrace

Array = NDArray[np.float64]

EXACT_LIMIT = 1e-6
"""Linear RGB by which an exact cell may be off."""
END_NM = 1e-3
"""Distance past the end of a primary at which a mixture no longer contains it."""
WHITE_LIMIT = 1e-6
"""Distance, relative to the white, within which primaries count as reaching it."""


def reported(builder: Assembler, state: PaletteState, trace: SolveTrace) -> PaletteSolution:
    """The solution of a ``state``."""
    problem, requests = builder.problem, builder.requests
    actual = state.colors()
    errors = state_errors(problem, requests, state)
    wanted, error = errors.target_linear_rgb, errors.delta_e_2000
    bounds = bound_violation(problem, state)
    whites = unreachable_whites(problem, state)
    status = _status(builder, state, trace, bounds, errors)
    if whites:
        status = PaletteStatus.EXACT_CONFLICT
    status, remedy = (status, white_remedy(problem, whites)) if whites else _named_cause(builder, state, status, trace)
    dark = _dark_notes(builder, state) if status is PaletteStatus.INVISIBLE else [] if whites else unlit(problem, state)
    return PaletteSolution(
        problem=problem,
        illuminants=tuple(_light(problem, state, j) for j in range(len(problem.lights))),
        reflectances=tuple(designed_reflectance(problem, state, i) for i in range(len(problem.reflectances))),
        target_linear_rgb=wanted,
        actual_linear_rgb=actual,
        delta_e_2000=error,
        residuals=criterion_residuals(builder, state, wanted, actual)
        | ({"worst_pair_delta_e_2000": errors.worst_pair_delta_e_2000} if requests.groups else {})
        | _worst_case_left(trace),
        kkt_residual=trace.joint.kkt,
        bound_violation=bounds,
        status=status,
        remedy=remedy,
        rounds=trace.rounds,
        engines=tuple(name for name, _ in trace.engines.most_common()),
        notes=(*trace.notes, *dark),
        light_scale=state.light_scale,
        timings=dict(trace.timings),
        amounts=tuple(state.amounts(j) for j in range(len(problem.lights))),
        state=replace(state, record=dict(trace.sides)),
    )


def _named_cause(
    builder: Assembler, state: PaletteState, status: PaletteStatus, trace: SolveTrace
) -> tuple[PaletteStatus, str]:
    """The status and the remedy of a palette that was not solved, with the cells or lights that are the cause."""
    problem, excluded = builder.problem, ""
    if status is PaletteStatus.EXACT_CONFLICT and (outside := luminance_outside(problem, state)):
        return status, outside
    if status in (PaletteStatus.INACCURATE, PaletteStatus.EXACT_CONFLICT):
        excluded = excluded_pair(problem, state)
    if excluded:
        return PaletteStatus.EXACT_CONFLICT, f"{excluded} The closest compromise is shown."
    if status is PaletteStatus.EXACT_CONFLICT and not missed_as_measured(problem, state.colors(), EXACT_LIMIT):
        worst = exact_error(builder.requests, state.colors())[0]
        black = only_black(problem, trace.sides.get("reflectances"), worst)
        if black or len(trace.sides) > 1:
            return status, black or NOT_FOUND
        # Beside extreme colors, exact cells that hold seem to miss by rounding.
        if extreme_number(problem, state) and not is_proven(problem, trace.sides.values()):
            status = PaletteStatus.INACCURATE
    if status is PaletteStatus.IMPROVING and not _is_exact_optimum(trace):
        return status, ROUGH
    extreme = ""
    if status in (PaletteStatus.INACCURATE, PaletteStatus.IMPROVING):
        extreme = extreme_number(problem, state)
    return status, f"{UNRELIABLE} {extreme}" if extreme else REMEDIES[status]


def _worst_case_left(trace: SolveTrace) -> dict[str, float]:
    return {} if trace.worst_case_left is None else {"worst_case_left": trace.worst_case_left}


def state_errors(problem: PaletteProblem, requests: Requests, state: PaletteState) -> CellErrors:
    """Errors of all cells at a state, over all observers and variants."""
    return cell_errors(problem, requests, [state.colors(condition) for condition in requests.conditions])


def unreachable_whites(problem: PaletteProblem, state: PaletteState) -> list[int]:
    """Designed lights whose white no amounts of their primaries can reach."""
    from scipy.optimize import nnls

    found = []
    for j, light in enumerate(problem.lights):
        if light.white_xyz is None or problem.light_bounds[0] < 0:
            continue
        own = state.given.primary_colors[j]
        xyz = XYZ_FROM_RGB @ (state.kernel.bare[0] if own is None else own.T)
        size = np.maximum(np.abs(xyz).max(axis=0), 1e-300)
        _, miss = nnls(xyz / size, light.white_xyz / light.white_xyz.max())
        if miss > WHITE_LIMIT:
            found.append(j)
    return found


def without_white(solution: PaletteSolution) -> set[int]:
    """Lights whose white is impossible: it excludes their cells, and the release of no other cell helps."""
    return set() if solution.state is None else set(unreachable_whites(solution.problem, solution.state))


def invisible_lights(builder: Assembler, state: PaletteState) -> list[int]:
    """Lights with requested colors other than black in their column that show no color on this grid."""
    sensed = np.abs(state.light_matrices()[0]).max(axis=(1, 2))
    asked = {t.cell[1] for t in builder.requests.targets if np.any(t.color)}
    return [j for j in sorted(asked) if sensed[j] < 1e-12]


def black_materials(builder: Assembler, state: PaletteState) -> list[int]:
    """Materials with requested colors other than black under a designed light, which only a light without limit would
    show: exact black cells leave them no reflectance but rounding errors, whose colors no solver can improve.
    """
    sensed = np.abs(state.reflectance_matrices[0]).sum(axis=2).max(axis=1)
    asked = {t.cell[0] for t in builder.requests.targets if np.any(t.color) and state.lights[t.cell[1]] is not None}
    is_unlimited = not np.isfinite(builder.problem.light_bounds[1])
    return [i for i in sorted(asked) if is_unlimited and sensed[i] < DIM]


def _dark_notes(builder: Assembler, state: PaletteState) -> list[str]:
    problem, lights, materials = builder.problem, invisible_lights(builder, state), black_materials(builder, state)
    notes = [f"light {problem.lights[j].name!r} gives no color" for j in lights]
    return notes + [f"material {problem.reflectances[i].name!r} is black under every light" for i in materials]


def bound_violation(problem: PaletteProblem, state: PaletteState) -> float:
    """Largest distance of any designed value outside its bounds."""
    found: list[tuple[Array, Array | float, Array | float]] = []
    found += [(values, *problem.reflectance_bounds) for values in state.reflectances if values is not None]
    for j, light in enumerate(state.lights):
        if light is not None:
            found.append((light, *state.light_limits(j, problem.light_bounds)))
    return max((float(np.maximum(least - values, values - most).max()) for values, least, most in found), default=0.0)


def exact_error(requests: Requests, actual: Array) -> tuple[float, list[CellIndex]]:
    """Largest distance of an exact cell from its target, in linear RGB, and the cells that miss theirs."""
    worst, missed = 0.0, []
    for target in requests.targets:
        if target.exact:
            error = float(np.abs(actual[target.cell] - target.color).max())
            worst = max(worst, error)
            if error > EXACT_LIMIT:
                missed.append(target.cell)
    for group in requests.groups:
        held = [cell for cell, exact in zip(group.members, group.exact, strict=True) if exact]
        for cell in held:
            inside = np.clip(actual[held[0]], group.box[0], group.box[1])
            error = max(float(np.abs(actual[cell] - inside).max()), group.gap / 2)  # of its own box, or another's
            worst = max(worst, error)
            if error > EXACT_LIMIT:
                missed.append(cell)
    return worst, missed


def _status(
    builder: Assembler, state: PaletteState, trace: SolveTrace, bounds: float, errors: CellErrors
) -> PaletteStatus:
    answers = trace.answers.values()
    worst, missed = exact_error(builder.requests, state.colors())
    dark = invisible_lights(builder, state)
    if missed and all(column in dark for _, column in missed):
        return PaletteStatus.INVISIBLE  # no other cell conflicts with them, so no other cell can be released
    # Where exact rows hold all the same, weights in their place were needed for the accuracy alone.
    has_weights = any(answer.infeasible for answer in answers)
    is_held = worst <= Check.EQUALITY_LIMIT
    is_held = is_held and all(light.white_xyz is None and light.luminance is None for light in builder.problem.lights)
    if worst > EXACT_LIMIT or (has_weights and not is_held):
        return PaletteStatus.EXACT_CONFLICT
    if not trace.joint.passed or bounds > Check.BOUND_LIMIT:
        return PaletteStatus.INACCURATE
    faint = black_materials(builder, state)
    if faint and not dark and not set(faint) & held_materials(builder.problem):
        return PaletteStatus.INACCURATE  # no exact cell makes them black: a light is too bright for its targets
    if dark or faint:
        return PaletteStatus.INVISIBLE
    if not trace.optimal or not _is_exact_optimum(trace):
        return PaletteStatus.IMPROVING
    return PaletteStatus.COMPROMISE if errors.largest > VISIBLE_DELTA_E else PaletteStatus.SOLVED


def _is_exact_optimum(trace: SolveTrace) -> bool:
    """True if the answers found with weights in place of exact rows are optimal with these rows, too.

    Beside the weights, rounding can hide the smoothness, so that the spectra are rougher than they must be.
    """
    stated = [(assembled.quadratic, answer) for assembled, answer in trace.sides.values() if answer.infeasible]
    points = [problem.joined(answer.colors, answer.values) for problem, answer in stated]
    checks = [checked(problem, x, answer.forces) for (problem, answer), x in zip(stated, points, strict=True)]
    return all(check.passed for check in checks)


def criterion_residuals(builder: Assembler, state: PaletteState, wanted: Array, actual: Array) -> dict[str, float]:
    """Root mean square residual of each criterion, unweighted."""
    operator = second_differences(builder.problem.grid, builder.problem.smoothness_operator)
    lights = zip(state.lights, builder.problem.lights, strict=True)
    shapes = [values for values in state.reflectances if values is not None]
    shapes += [REFERENCE_STEP_NM * values for values, light in lights if values is not None and not light.primaries]
    known = np.isfinite(wanted)
    result = {
        "color": float(np.sqrt(np.mean((wanted - actual)[known] ** 2))) if known.any() else 0.0,
        "smoothness": float(np.sqrt(np.mean([np.sum((operator @ each) ** 2) for each in shapes]))) if shapes else 0.0,
    }
    subspace = builder.subspace_errors(state)
    if subspace is not None:
        result["subspace"] = float(np.sqrt(np.mean(subspace**2)))
    robust = builder.robust_errors(state)
    if robust is not None:
        result["robust"] = float(np.sqrt(np.mean(robust**2)))
    return result


def _light(problem: PaletteProblem, state: PaletteState, j: int) -> Spectrum:
    light, values = problem.lights[j], state.lights[j]
    if values is None:
        return light.spectrum if state.light_scale == 1.0 else light.spectrum.scaled(state.light_scale)
    grid, amounts = problem.grid, state.amounts(j)
    if amounts is not None:
        grid = knots_of_primaries(problem, j)
        values = np.stack([each.at(grid.wavelengths_nm) for each in light.primaries], axis=1) @ amounts
    kind = Illuminant if values.min() >= 0 else Spectrum
    return kind(light.name, grid, values, source="designed")


def knots_of_primaries(problem: PaletteProblem, j: int) -> SpectralGrid:
    """Grid on which any mixture of a light's primaries is exact; the palette's own grid if that is sampled.

    It has the knots of all of them, and a knot just past the end of one that does not end at zero.
    """
    if problem.grid.interpolation == "sampled":
        return problem.grid
    primaries = problem.lights[j].primaries
    knots = [each.grid.wavelengths_nm for each in primaries]
    low, high = min(each[0] for each in knots), max(each[-1] for each in knots)
    ends = [each[end] + sign * END_NM for each, of in zip(knots, primaries, strict=True)
            for end, sign in ((0, -1), (-1, 1)) if of.values[end] > 0]  # fmt: skip
    return SpectralGrid(np.unique(np.concatenate([*knots, [end for end in ends if low < end < high]])))


def designed_reflectance(problem: PaletteProblem, state: PaletteState, i: int) -> Spectrum:
    """The spectrum of a row: measured, or as a state has it."""
    item, values = problem.reflectances[i], state.reflectances[i]
    if item.spectrum is not None:
        return item.spectrum
    assert values is not None
    passive = values.min() >= -Reflectance.TOLERANCE and values.max() <= 1 + Reflectance.TOLERANCE
    return (Reflectance if passive else Spectrum)(item.name, problem.grid, values, source="designed")
