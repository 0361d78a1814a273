# SPDX-License-Identifier: GPL-3.0-or-later
"""Durations in status lines: how long a picture has taken, and how long the rest takes."""

from __future__ import annotations


def clock(seconds: float, digits: int = 1) -> str:
    """A duration in s as text, such as ``12.3 s``, ``32:42 min`` or ``1:05:09 h``.

    ``digits``: decimals of durations below a minute; longer ones are rounded to whole seconds.
    """
    short = f"{seconds:.{digits}f}"
    if float(short) < 60:
        return f"{short} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02} h" if hours else f"{minutes}:{rest:02} min"
