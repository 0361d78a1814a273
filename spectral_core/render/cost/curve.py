# SPDX-License-Identifier: GPL-3.0-or-later
"""Work against precision on a scene: a probe's pixels at several settings, and a prediction for the whole picture.

Noise (samples) is separated from bias (fewer bounces, three channels instead of spectra, longer volume steps): noise by
the difference of two halves, bias by renders with and without the effect that use the same random numbers.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from spectral_core.errors import UnknownNameError, counted
from spectral_core.render.cost.asked import is_asked, predicted_error, predicted_time, time_of_picture
from spectral_core.render.cost.errors import bias, relative_errors
from spectral_core.render.cost.fixed import fixed_work, plan_of_render
from spectral_core.render.cost.model import CostModel, Prediction, measured_model
from spectral_core.render.cost.probe import Probe
from spectral_core.render.cost.rare import find_rare_light
from spectral_core.render.cost.work import Spent
from spectral_core.render.job import RenderJob
from spectral_core.render.mitsuba_scene.units import at_origin
from spectral_core.render.plan.decision import EffectPlan
from spectral_core.scene import Scene, require_scene

AXES = ("samples", "bounces", "transport", "volume step")
"""What a measurement varies."""
_BIAS_SAMPLES = 16
"""Samples of each half where a bias is measured; the probe has had as many."""
_TIMED_S = 0.4
"""Processor time of the paths whose time is measured: shorter, other programs would disturb it."""
_DRAWN_COUNTS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096)


@dataclass(frozen=True, slots=True)
class CostPoint:
    """A setting of one ``axis`` of AXES, for the whole picture.

    ``seconds``: render time; ``delta_e``: mean ΔE2000 of noise; ``relative_mse``: of noise; ``bias``: mean ΔE2000 of
    the effects that the setting omits, whatever the samples. ``measured``: traced, not predicted.
    """

    axis: str
    setting: str
    seconds: float
    delta_e: float
    relative_mse: float
    bias: float = 0.0
    measured: bool = True


@dataclass(frozen=True, slots=True)
class CostCurve:
    """Error against time of one scene.

    ``points``: by axis. ``model``: the fitted law of samples. ``samples``: the scene's current number; ``now``: its
    prediction. ``at_error``: prediction of adaptive sampling to ΔE 1. ``probe_pixels`` and ``seconds``: size and time
    of the measurement.
    """

    points: tuple[CostPoint, ...]
    model: CostModel
    now: Prediction
    at_error: Prediction
    probe_pixels: int
    seconds: float
    plan: EffectPlan

    def axis(self, name: str) -> tuple[CostPoint, ...]:
        """Points of an axis, in the order of its settings; none where the scene has nothing to vary there.

        Raises UnknownNameError.
        """
        require_axis(name)
        return tuple(point for point in self.points if point.axis == name)


def require_axis(name: str) -> None:
    """Raise UnknownNameError for an axis that no cost curve has."""
    if name not in AXES:
        raise UnknownNameError.among("axis", name, AXES)


def cost_curve(scene: Scene) -> CostCurve:
    """Measure error against time of ``scene`` on a few thousand of its pixels.

    Raises the same errors as ``render_scene``.
    """
    start = time.perf_counter()
    require_scene(scene)
    scene, _ = at_origin(scene)
    plan = plan_of_render(scene)
    fixed = fixed_work(scene, plan)  # while no other scene is loaded, as in a render: its kernels are then the same
    probe = Probe(RenderJob(scene, plan))
    model = measured_model(probe, least=64, most=256, share=0.02, fixed_s=fixed, asked=0.5, timed_s=_TIMED_S)
    points = list(_noise_points(probe, model))
    points += _bias_points(scene, plan, probe, model)
    settings = scene.settings
    usual = settings.target_error or model.error(scene.film.samples)
    found = find_rare_light(scene, plan, probe, min(1.0, usual))
    spent = Spent(fixed, fixed * model.slowness)
    if is_asked(settings):  # such a render looks for rare light, too
        spent += Spent(found.work, found.work * model.slowness)
    noise = 1.0 if found.rare is None else found.rare.noise_for(1.0)
    return CostCurve(
        tuple(points),
        model,
        _expected(scene, probe, model, spent).with_rare(found.rare),
        predicted_error(probe, model, spent, noise)[0].with_rare(found.rare),
        len(probe.pixels),
        time.perf_counter() - start,
        plan,
    )


def _expected(scene: Scene, probe: Probe, model: CostModel, spent: Spent) -> Prediction:
    """Prediction for the settings of the scene."""
    settings = scene.settings
    if settings.target_error is not None:
        return predicted_error(probe, model, spent, settings.target_error)[0]
    budget = time_of_picture(scene)
    if budget is not None:
        expected = predicted_time(probe, model, spent.wall, budget)[0]
        return replace(expected, seconds=max(settings.time_budget_s or 0.0, expected.seconds))
    return of_moments(model, scene.film.samples, max(1, len(scene.moments)))


def of_moments(model: CostModel, samples: int, moments: int) -> Prediction:
    """Prediction for ``samples`` in all, of equal pictures of the moments of motion blur, whose noise averages out."""
    error = model.error(max(1.0, samples / moments)) / float(np.sqrt(moments))
    return replace(model.for_samples(samples), delta_e=error)


def _noise_points(probe: Probe, model: CostModel) -> list[CostPoint]:
    relative = float(np.mean(relative_errors(*probe.halves(), of_half=True)))
    last = model.counts[-1]
    return [
        CostPoint(
            "samples", str(count), model.seconds(count), model.error(count),
            relative * (model.error(count) / max(model.error(last), 1e-9)) ** 2, measured=count in model.counts,
        )
        for count in _DRAWN_COUNTS
    ]  # fmt: skip


def _bias_points(scene: Scene, plan: EffectPlan, probe: Probe, model: CostModel) -> list[CostPoint]:
    """Other settings against those of the plan, with equal random numbers."""
    points: list[CostPoint] = []
    tried: Probe | None = None
    for axis, setting, other_scene, other_plan in _alternatives(scene, plan):
        del tried  # as many scenes are loaded for each setting: their kernels are then the same
        tried = Probe(RenderJob(other_scene, other_plan), probe.pixels)
        tried.trace_to(_BIAS_SAMPLES)
        found = tried.estimate()
        ratio = tried.seconds_per_path / max(probe.seconds_per_path, 1e-12)
        count = scene.film.samples
        # noise depends on samples as under the plan; the bias stays
        noise = model.error(count) * found.delta_e / max(model.error(_BIAS_SAMPLES), 1e-9)
        points.append(
            CostPoint(
                axis, setting, model.slowness * (model.fixed_s + ratio * model.seconds_per_sample * count), noise,
                found.relative_mse * _BIAS_SAMPLES / count, bias(tried.halves(), probe.halves_after(_BIAS_SAMPLES)),
            )
        )  # fmt: skip
    return points


def _alternatives(scene: Scene, plan: EffectPlan) -> list[tuple[str, str, Scene, EffectPlan]]:
    """Axis, setting, scene and plan of each alternative that is compared with the plan."""
    found = [
        ("bounces", str(count), scene, plan.changed("bounces", str(count)))
        for count in (0, 1, 2, 4, 8, 16)
        if count < plan.bounces
    ]
    found.append(("bounces", str(plan.bounces), scene, plan))
    if plan["transport"].error:
        other = "rgb" if plan.is_spectral else "spectral"
        changed = plan.changed("transport", other)
        found.append(("transport", other, scene, changed.changed("dispersion", "off") if other == "rgb" else changed))
        found.append(("transport", plan["transport"].value, scene, plan))
    for quality in (30.0, 40.0, 60.0):
        if scene.volumes and plan.is_on("volumes"):
            volumes = tuple(replace(volume, quality=quality) for volume in scene.volumes)
            found.append(("volume step", f"{quality:g} dB", replace(scene, volumes=volumes), plan))
    return found


def table(curve: CostCurve) -> str:
    """The curve as text: setting, seconds for the whole picture, error of noise, bias."""
    lines = [f"{'axis':12} {'setting':>10} {'seconds':>9} {'noise ΔE':>9} {'rel. MSE':>9} {'bias ΔE':>8}"]
    for point in curve.points:
        mark = "" if point.measured else "  predicted"
        lines.append(
            f"{point.axis:12} {point.setting:>10} {point.seconds:9.2f} {point.delta_e:9.3f} {point.relative_mse:9.2g} "
            f"{point.bias:8.3f}{mark}"
        )
    now, asked = curve.now, curve.at_error
    least = "at least " if now.rare is not None else ""
    lines.append(
        f"as it is set: {counted(now.samples, 'sample', form='.0f')}, {least}ΔE {now.delta_e:.2g} in "
        f"{now.seconds:.1f} s"
    )
    lines.append(
        f"for ΔE 1: {counted(asked.samples, 'sample', form='.0f')} in the mean, {asked.seconds:.1f} s, adaptive"
    )
    if now.rare is not None:
        lines.append(now.rare.text)
    return "\n".join(lines)
