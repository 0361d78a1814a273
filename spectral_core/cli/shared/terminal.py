# SPDX-License-Identifier: GPL-3.0-or-later
"""Standard output that accepts every character in any encoding of the terminal, and that may be closed."""

from __future__ import annotations

import codecs
import contextlib
import os
import sys

_PLAIN = {
    "Δ": "d",
    "λ": "lambda",
    "µ": "u",
    "×": "x",
    "²": "^2",
    "³": "^3",
    "±": "+-",
    "·": "*",
    "√": "sqrt",
    "∞": "inf",
    "≤": "<=",
    "≥": ">=",
    "→": "->",
    "°": " deg",
    "–": "-",
    "—": "-",
    "−": "-",
    "…": "...",
    "’": "'",
}
_NAME = "spectral_scene_plain"


def _plain(error: UnicodeError) -> tuple[str, int]:
    """Replace characters that an encoding lacks by ASCII."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    return "".join(_PLAIN.get(letter, "?") for letter in lacking), error.end


def make_writable() -> None:
    """Let both standard streams write any text: a character that the terminal's encoding lacks is replaced."""
    codecs.register_error(_NAME, _plain)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a test or an embedding program may have replaced it
            with contextlib.suppress(OSError, ValueError):
                stream.reconfigure(errors=_NAME)


def close_quietly() -> None:
    """Point standard output at nothing, so that the interpreter does not complain about its unwritten buffer."""
    with contextlib.suppress(OSError, ValueError):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())
        os.close(nothing)
