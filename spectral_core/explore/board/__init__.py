# SPDX-License-Identifier: GPL-3.0-or-later
"""A mixing board: faders, by MIDI or OSC, change numbers of a scene (thesis section 6.3.2)."""

from spectral_core.explore.board.binding import Binding, Control
from spectral_core.explore.board.board import Board, Change
from spectral_core.explore.board.recording import Recording, simultaneity

__all__ = ["Binding", "Board", "Change", "Control", "Recording", "simultaneity"]
