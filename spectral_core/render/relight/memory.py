# SPDX-License-Identifier: GPL-3.0-or-later
"""Peak memory of a recording, available memory, and an error before a recording that cannot fit."""

from __future__ import annotations

import os
from pathlib import Path

from spectral_core.errors import InvalidInputError, counted
from spectral_core.render.relight.storage import Storage
from spectral_core.render.relight.storages import STORAGES

RENDERER_BYTES = 500e6
"""Bytes of Mitsuba, its compiler and a scene of ordinary size, in a separate process, beside the session's
libraries.
"""
COPIES = 4.0
"""Peak over stored bytes, in both processes together: sums in the renderer, the same as arrays, in the message, and in
the transport. Measured by ``python -m benchmarks relight-memory``.
"""
PIXEL_BYTES = 56.0
"""Random state and the picture itself, per pixel and group."""


def peak_bytes(storage: Storage, width: int, height: int, groups: int) -> float:
    """Largest memory of a recording, renderer and session together."""
    pixels = PIXEL_BYTES * width * height * groups
    return RENDERER_BYTES + COPIES * storage.bytes_needed(width, height, groups) + pixels


def stated_peak(storage: Storage, width: int, height: int, groups: int) -> str:
    """One line to show before recording: stored bytes, error, and peak memory."""
    peak = peak_bytes(storage, width, height, groups) / 1e6
    return f"{storage.describe(width, height, groups)}. Recording takes up to {peak:,.0f} MB"


def available_bytes() -> float | None:
    """Memory that is available now without swapping, within this container's limit; None if the system does not report
    it.
    """
    found = [amount for amount in (_of_machine(), _of_container()) if amount is not None]
    return min(found, default=None)


def require_memory(storage: Storage, size: tuple[int, int], groups: int) -> None:
    """Raise InvalidInputError with a recording that fits if this one would take more memory than is available."""
    free, needed = available_bytes(), peak_bytes(storage, *size, groups)
    if free is None or needed <= free:
        return
    fitting = [each for each in STORAGES.values() if peak_bytes(each, *size, groups) <= free]
    share = max(0.0, (free - RENDERER_BYTES) / (needed - RENDERER_BYTES)) ** 0.5
    smaller = f"a picture of {int(size[0] * share)}×{int(size[1] * share)}" if share > 0.02 else "more memory"
    others = [
        f"{each.kind} of {counted(each.channel_count, 'channel')}" for each in fitting if each.kind != storage.kind
    ]
    raise InvalidInputError(
        f"recording {storage.kind} at {size[0]}×{size[1]} for {counted(groups, 'light group')} takes up to "
        f"{needed / 1e9:.1f} GB; {free / 1e9:.1f} GB are free. What fits: {', '.join([*others, smaller])}"
    )


def _of_machine() -> float | None:
    try:
        for line in Path("/proc/meminfo").read_text("ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    except (OSError, ValueError):
        pass  # not Linux: the installed memory is the bound, if the system reports it
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return None


def _of_container() -> float | None:
    """Memory within a container's limit (cgroup 2), file caches counted as free."""
    folder = Path("/sys/fs/cgroup")
    try:
        limit = float((folder / "memory.max").read_text("ascii"))
        used = float((folder / "memory.current").read_text("ascii"))
        rows = (folder / "memory.stat").read_text("ascii").splitlines()
        cached = sum(float(row.split()[1]) for row in rows if row.split()[0] in ("inactive_file", "active_file"))
    except (OSError, ValueError):
        return None  # there is no limit, or its value is "max"
    return max(0.0, limit - used + cached)
