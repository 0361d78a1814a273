# SPDX-License-Identifier: GPL-3.0-or-later
"""Standard output that accepts every character in any encoding of the terminal, and that may be closed."""

from __future__ import annotations

import codecs
import contextlib
import os
import select
import sys
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import TextIO
from weakref import WeakSet

CLOSED_PIPE = 141
"""Exit status when the reader of the output closes the pipe, as shells report SIGPIPE."""
STOPPED = 130
"""Exit status after Ctrl-C, as shells report SIGINT."""

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
_refused: WeakSet[TextIO] = WeakSet()
"""Streams that have refused a text."""


def one_line(text: str) -> str:
    """The text with its control characters as escapes: names of files may contain line ends and a terminal's orders."""
    return "".join(
        letter.encode("unicode_escape").decode() if unicodedata.category(letter) in ("Cc", "Zl", "Zp") else letter
        for letter in text
    )


def _plain(error: UnicodeError) -> tuple[str, int]:
    """Replace characters that an encoding lacks by ASCII."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    return "".join(_PLAIN.get(letter, "?") for letter in lacking), error.end


def make_writable() -> None:
    """Let both standard streams write any text: a character that the terminal's encoding lacks is replaced.

    A stream that was closed before the program began (``>&-``, a service) writes to nothing.
    """
    codecs.register_error(_NAME, _plain)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115 - until the program ends
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a test or an embedding program may have replaced it
            with contextlib.suppress(OSError, ValueError):
                stream.reconfigure(errors=_NAME)
    _refused.clear()  # of an earlier program in this process
    if "write" not in getattr(sys.stdout, "__dict__", {"write"}):
        _remember_refusals(sys.stdout)


def _remember_refusals(stream: TextIO) -> None:
    """Let a stream remember that it refused a text: it drops a long one, and then has nothing left to refuse."""
    write = stream.write

    def remembering(text: str) -> int:
        try:
            return write(text)
        except OSError:
            _refused.add(stream)
            raise

    stream.write = remembering  # type: ignore[method-assign]


def takes_output() -> bool:
    """False if standard output refuses what is printed, as on a full disk. Call it after an error of unknown origin."""
    try:
        sys.stdout.flush()
    except OSError:
        return False
    return sys.stdout not in _refused


def close_quietly() -> None:
    """Point standard output at nothing, so that the interpreter does not complain about its unwritten buffer."""
    with contextlib.suppress(OSError, ValueError):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())
        os.close(nothing)


def completed(program: Callable[[], int | None], name: str = "") -> int:
    """Run a program and return its exit status, ``CLOSED_PIPE`` if the reader of its output closes the pipe.

    ``program | head -1`` then ends without a message. Ctrl-C gives one line and ``STOPPED``, and so does an output on a
    full disk, with 1; that line begins with ``name``. Every entry point of this project runs its main function here.
    """
    make_writable()
    try:
        try:
            status = program() or 0
        finally:  # also after `--help`: here, where a full disk or a closed pipe can be distinguished from a fault
            sys.stdout.flush()
    except BrokenPipeError:
        if not _is_closed():
            raise  # the pipe of a child process
        close_quietly()
        return CLOSED_PIPE
    except KeyboardInterrupt:  # also while modules are imported, before a program can tell its name
        print("stopped", file=sys.stderr)
        return STOPPED
    except OSError as error:
        if error.filename is not None or takes_output():
            raise
        close_quietly()
        print(f"{name}: " * bool(name) + f"the output cannot be written: {error.strerror}", file=sys.stderr)
        return 1
    return status


def _is_closed() -> bool:
    """True if standard output is a pipe without a reader."""
    if not hasattr(select, "poll"):
        return True  # Windows: no other pipe of this project raises BrokenPipeError there
    try:
        poll = select.poll()
        poll.register(sys.stdout.fileno(), 0)
        return bool(poll.poll(0))
    except (OSError, ValueError):
        return False  # a test or an embedding program has replaced it
