# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors about a ledger that was deleted or emptied, while its folder has the outcomes of finished points."""

from __future__ import annotations

from pathlib import Path

from spectral_core.errors import FileFormatError


def require_ledger(path: Path) -> None:
    """Raise FileFormatError if the ledger of a sweep is missing or empty: a new one would start the sweep anew."""
    if not path.is_file() or not path.stat().st_size:
        raise _without_points(path, "is empty" if path.exists() else "is missing")


def require_points(path: Path, has_points: bool) -> None:
    """Raise FileFormatError if a ledger has no points, although its folder has pictures or a table."""
    folder = path.parent
    if not has_points and ((folder / "data.csv").exists() or any((folder / "image").glob("*"))):
        raise _without_points(path, "has no points, although the folder has outcomes of finished ones")


def _without_points(path: Path, what: str) -> FileFormatError:
    return FileFormatError(
        f"{path} {what}; it holds every point of the sweep. Restore it from a backup with the files of its name, or "
        "run the sweep into another folder, which computes all points anew"
    )
