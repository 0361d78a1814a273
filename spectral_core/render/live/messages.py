# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages from the live render process to its session, and the picture that a session makes of one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.live.area import Place
from spectral_core.scene import Note

LOADED = "loaded"
"""How a change was made if the whole scene was loaded anew."""


@dataclass(frozen=True, slots=True)
class AreaName:
    """A mapped file and the largest number of pixels of its pictures."""

    path: str
    pixels: int


@dataclass(frozen=True, slots=True)
class Frame:
    """A picture in the view's area.

    ``generation``: number of the request. ``level``: distance of two rendered pixels in the view, 1 for a full picture.
    ``corner``: its lower left pixel in the view, (0, 0) without a border.
    ``samples``: per pixel of a full picture. ``seconds``: since the request was received. ``memory``: bytes of the
    process. ``how``: how the last change of the scene was made, ``LOADED`` or the edited parts. ``recordings``: of
    launches since the scene was loaded. ``is_denoised``: True if the pixels are denoised; ``denoiser_memory``: bytes of
    ``memory`` that the filter takes. ``left_s``: expected time until it is complete, 0 if unknown.
    """

    view: str
    generation: int
    place: Place
    level: int
    corner: tuple[int, int]
    samples: int
    is_done: bool
    seconds: float
    memory: int
    how: str
    is_spectral: bool
    recordings: int
    notes: tuple[Note, ...] = ()
    is_denoised: bool = False
    denoiser_memory: int = 0
    left_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Trouble:
    """The reason why a view cannot be shown: an invalid scene or an error of the renderer."""

    view: str
    generation: int
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A view's latest picture: ``pixels`` (height, width, 4) linear sRGB and coverage, row 0 at the bottom.

    ``first``: time (``time.monotonic``) at which the first picture of its request arrived.
    """

    pixels: NDArray[np.float32]
    frame: Frame
    first: float = 0.0
