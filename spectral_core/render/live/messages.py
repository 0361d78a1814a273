# SPDX-License-Identifier: GPL-3.0-or-later
"""What the live render process tells its session."""

from __future__ import annotations

from dataclasses import dataclass

from spectral_core.render.live.area import Place
from spectral_core.scene import Note


@dataclass(frozen=True, slots=True)
class AreaName:
    """A mapped file and the pixels that a picture in it may have."""

    path: str
    pixels: int


@dataclass(frozen=True, slots=True)
class Frame:
    """A picture that lies in the view's area.

    ``generation``: of the request that it answers. ``level``: pixels of the view between two of the picture, 1 for a
    full one. ``samples``: per pixel of a full picture. ``seconds``: since the request was taken up. ``memory``: bytes
    of the process. ``how``: how the scene's last change was made.
    """

    view: str
    generation: int
    place: Place
    level: int
    samples: int
    is_done: bool
    seconds: float
    memory: int
    how: str
    is_spectral: bool
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True)
class Trouble:
    """Why a view cannot be shown: a scene that cannot be rendered, or a renderer that failed."""

    view: str
    generation: int
    message: str
