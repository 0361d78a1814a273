# SPDX-License-Identifier: GPL-3.0-or-later
"""Solving the palette of a scene: read the properties, solve, write the properties."""

from spectral_core.errors import SpectralError

from .live import paused
from .palette_problem import palette_problem, store_solution, takes_seconds

_last: dict[int, object] = {}
"""Last solution by scene, where the next live solve starts from. Not saved: a file that is opened starts anew."""


def solve_scene(scene, *, live: bool = False):
    """Solve and store; the solution, or None where the table cannot be solved and ``message`` says why.

    ``live``: start from the last solution, and leave tables that take seconds to the Solve button.
    """
    from spectral_core.palette import solve_palette

    palette = scene.spectral.palette
    if live and (not len(palette.lights) or not len(palette.materials)):
        return None
    with paused():
        if live and takes_seconds(palette):
            palette.message = "This table takes some seconds to solve: press Solve"
            return None
        try:
            problem = palette_problem(palette)
            solution = solve_palette(problem, warm=_last.get(scene.session_uid) if live else None)
        except SpectralError as error:
            palette.message = str(error)
            palette.is_stale = True
            return None
        store_solution(palette, solution)
        palette.message = ""
        palette.is_stale = False
    _last[scene.session_uid] = solution
    return solution


def last_solution(scene):
    """The solution that the stored results came from, None after loading a file."""
    return _last.get(scene.session_uid)


def register() -> None:
    """Nothing to add to Blender."""


def unregister() -> None:
    """Forget the solutions."""
    _last.clear()
