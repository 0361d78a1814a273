# SPDX-License-Identifier: GPL-3.0-or-later
"""Function for the kill benchmark: it records its starts and ends, and takes some time."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np


def work(a: float, b: float, log: str, pause: float) -> dict[str, object]:
    """A small picture and two numbers; one line in the log at the start, one at the end."""
    name = f"{a!r} {b!r}\n"
    with Path(log).open("a") as file:
        file.write("start " + name)
    time.sleep(pause)
    ramp = np.linspace(0, 1, 32)
    image = np.stack(np.broadcast_arrays(a * ramp[:, None], b * ramp[None], np.float64(0.3)), axis=2)
    with Path(log).open("a") as file:
        file.write("end " + name)
    return {"sum": a + b, "product": a * b, "image": image}
