# SPDX-License-Identifier: GPL-3.0-or-later
"""Outcomes of a render process: errors that it reports, and work that nobody wants any more."""

from __future__ import annotations

from collections.abc import Callable

from spectral_core import errors
from spectral_core.errors import RenderCancelled, RenderError
from spectral_core.render.plan.effects import EffectPlan
from spectral_core.render.result import Progress, RenderResult
from spectral_core.render.variant import choose_backend
from spectral_core.scene import Scene


def require_wanted(should_stop: Callable[[], bool] | None) -> None:
    """Raise RenderCancelled if the work is to stop."""
    if should_stop is not None and should_stop():
        raise RenderCancelled("stopped; nothing has changed")


def cancelled(scene: Scene, plan: EffectPlan, latest: Progress) -> RenderResult:
    """The last progress of a render when its process was ended."""
    variant = choose_backend("spectral" if plan.is_spectral else "rgb", scene.settings.variant).variant
    return RenderResult(latest.pixels, plan, scene.notes, latest.samples, latest.seconds, "cancelled", variant)


def as_error(name: str, text: str) -> errors.SpectralError:
    """The error of this project with that name."""
    kind = getattr(errors, name, RenderError)
    return kind(text)
