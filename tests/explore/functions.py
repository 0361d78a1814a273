# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions that the tests sweep, also in worker processes."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np

from spectral_core.errors import MissingDependencyError


def plane(a: float, b: float) -> dict[str, float]:
    """A sum and a product."""
    return {"sum": a + b, "product": a * b}


def picture(a: float, b: float, seed: int = 0) -> dict[str, object]:
    """A small picture that depends on both, and its mean."""
    ramp = np.linspace(0, 1, 12)
    image = np.stack(np.broadcast_arrays(a * ramp[:, None], b * ramp[None], np.float64(0.2)), axis=2)
    return {"mean": float(image.mean()), "image": image}


def counted(a: float, b: float, log: str, pause: float = 0.0) -> dict[str, float]:
    """Write the start and the end of each call into a file, one line each, and wait between them."""
    line = f"{a!r} {b!r}\n"
    with Path(log).open("a") as file:
        file.write("start " + line)
    time.sleep(pause)
    with Path(log).open("a") as file:
        file.write("end " + line)
    return {"sum": a + b}


def sometimes(a: float, b: float, log: str) -> dict[str, float]:
    """Raise an error for large a, crash the process for large b, count the calls."""
    with Path(log).open("a") as file:
        file.write(f"{a!r} {b!r}\n")
    if a > 0.8:
        raise ValueError("a is too large")
    if b > 0.9:
        os.kill(os.getpid(), signal.SIGSEGV)
    return {"sum": a + b}


def needs_package(a: float, b: float, installed: str) -> dict[str, float]:
    """Lack a package until a file is there."""
    if not Path(installed).exists():
        raise MissingDependencyError.package("mitsuba", "rendering", "render")
    return {"sum": a + b}


def needs_package_later(a: float, b: float, log: str) -> dict[str, float]:
    """Lack a package for all points but the first."""
    if Path(log).exists():
        raise MissingDependencyError.package("mitsuba", "rendering", "render")
    Path(log).touch()
    return {"sum": a + b}


def named_like_columns(a: float, b: float) -> dict[str, object]:
    """Values with the names of columns that analyses add, and a picture."""
    values = {"rmse": 7.0, "embed_1": 5.0, "cluster": 3.0, "distance": 2.0}
    return {**{name: value + a for name, value in values.items()}, "image": np.full((4, 4, 3), a)}


def ratio(a: float, b: float) -> dict[str, float]:
    """A ratio that is infinite for b below 0.5."""
    return {"sum": a + b, "ratio": a / b if b > 0.5 else float("inf")}
