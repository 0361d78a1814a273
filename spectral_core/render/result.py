# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture in progress, and a rendered one."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import counted
from spectral_core.render.cost.adaptive import Outcome
from spectral_core.render.cost.model import Prediction
from spectral_core.render.plan.effects import EffectPlan
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import Note

Pixels = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Progress:
    """A picture in progress: ``pixels`` (height, width, 4) so far, ``samples`` per pixel of ``total``, seconds.

    ``left_s``: seconds for the rest at the rate of the latest pass, None if unknown. ``memory``: bytes of the process
    that renders, 0 if unknown.
    """

    pixels: Pixels
    samples: int
    total: int
    seconds: float
    left_s: float | None = None
    memory: int = 0

    def within(self, pixels: Pixels, samples: int, total: int, start: float) -> Progress:
        """The progress of a longer render of which this one is a part.

        ``pixels``, ``samples``, ``total``: of the longer render. ``start``: ``time.perf_counter`` when it began.
        """
        seconds = time.perf_counter() - start
        left_s = seconds * max(total / samples - 1.0, 0.0) if samples else None
        return replace(self, pixels=pixels, samples=samples, total=total, seconds=seconds, left_s=left_s)


@dataclass(frozen=True, slots=True, eq=False)
class RenderResult:
    """A rendered picture.

    ``pixels``: (height, width, 4) float32, linear sRGB and coverage, row 0 at the bottom, color premultiplied by
    coverage. ``samples`` per pixel and ``seconds``; ``work``: seconds of processor time over all cores. ``status``:
    "done" or "cancelled" (then the picture holds the samples so far). ``notes``: features that are approximated.
    ``bands``: the requested spectral channels, ``band_pixels``: (height, width, n_bands) radiance per nm without
    exposure. ``group_pixels`` and ``group_band_pixels``: the share of each light group, which add up to the picture.
    ``prediction`` and ``outcome``: predicted and reached error and time, if one was requested. ``denoised``: name of
    the denoiser and its guides; "" without denoising. ``passes``: those that the scene's settings request, (height,
    width, channels) by Cycles' names, row 0 at the bottom; cryptomattes as CryptoObject00, 01, …, light groups as
    Combined_ and their name. ``sample_counts``: (height, width) samples of each pixel, None if all are equal.
    ``noise_pixels``: (height, width, 3) half the difference of two halves of the samples, if an error or a time was
    requested.
    """

    pixels: Pixels
    plan: EffectPlan
    notes: tuple[Note, ...]
    samples: int
    seconds: float
    status: Literal["done", "cancelled"]
    variant: str
    bands: Bands | None = None
    band_pixels: Pixels | None = None
    group_pixels: dict[str, Pixels] = field(default_factory=dict)
    group_band_pixels: dict[str, Pixels] = field(default_factory=dict)
    prediction: Prediction | None = None
    outcome: Outcome | None = None
    denoised: str = ""
    passes: dict[str, Pixels] = field(default_factory=dict)
    sample_counts: Pixels | None = None
    noise_pixels: Pixels | None = None
    work: float = 0.0

    def __repr__(self) -> str:
        height, width = self.pixels.shape[:2]
        samples = counted(self.samples, "sample")
        return f"RenderResult({self.status}, {width}×{height} pixels, {samples} in {self.seconds:.1f} s)"

    @property
    def header(self) -> dict[str, str]:
        """Header of a file with this picture: the plan, samples, time, prediction and outcome."""
        entries = {
            **self.plan.header(),
            "spectral.samples": str(self.samples),
            "spectral.seconds": f"{self.seconds:.3f}",
            "spectral.work": f"{self.work:.3f}",
            "spectral.variant": self.variant,
        }
        if self.denoised:
            entries["spectral.denoised"] = self.denoised
        if self.prediction is not None and self.outcome is not None:
            said, found = self.prediction, self.outcome
            least = "" if found.rare is None else "at least "
            entries["spectral.predicted"] = (
                f"dE2000 {least}{said.delta_e:.3g}; {said.seconds:.3g} s; {counted(said.samples, 'sample', form='.4g')}"
            )
            reached = f"dE2000 {least}{found.delta_e:.3g} +- {found.spread:.2g}"
            entries["spectral.outcome"] = (
                f"{reached}; {found.seconds:.3g} s; {counted(found.samples, 'sample', form='.4g')}"
            )
            if found.rare is not None:
                entries["spectral.rare"] = found.rare.text
        return entries
