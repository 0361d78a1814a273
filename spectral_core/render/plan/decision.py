# SPDX-License-Identifier: GPL-3.0-or-later
"""A plan as data: decisions, each with its reason, the error of omitting the effect and its share of the time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from spectral_core.errors import UnknownNameError
from spectral_core.scene import Note

How = Literal["exact", "bounded", "measured", "not known"]
"""Origin of an error: no change at all; a bound from the scene's data; a pilot; unknown."""
LEFT_OUT = ("off", "none")
MOST_BOUNCES, USUAL_BOUNCES = 1024, 64
"""Largest number of bounces; and that of a pilot, and of a plan for scenes without a limit whose loss is not known."""
MOST_ERROR = 100.0
"""Largest ΔE2000 that a bound states."""
LATER_BOUNCES = 3.0
"""Factor for light that is reflected more than twice: each further surface adds at most the same error again."""
VISIBLE_SHARE = 0.01
"""Part of the light whose loss is noted."""
CLAMPED = (
    "clamping removes about {:.0f} % of the light, as it does in Cycles; set Clamp Direct and Indirect to 0 to keep it"
)


@dataclass(frozen=True, slots=True)
class Decision:
    """One effect. ``value``: what is simulated (``"spectral"``, ``"off"``, ``"6"``).

    ``reason``: why, in terms of the scene. ``cost_if_left_out``: the visible error without the effect, "" for none.
    ``choices``: values of an override, () for a whole number from 0. ``source``: "scene" or "artist". ``error``: ΔE2000
    of omitting the effect completely, None if unknown; ``how``: the origin of that error. ``accepted``: largest ΔE2000
    of the decision itself; None if an artist's choice was not measured. ``time_share``: share of the effect in the time
    of a render with all effects.
    """

    name: str
    value: str
    reason: str
    cost_if_left_out: str = ""
    choices: tuple[str, ...] = ()
    overridable: bool = True
    source: str = "scene"
    error: float | None = 0.0
    how: How = "exact"
    accepted: float | None = 0.0
    time_share: float = 0.0

    @property
    def is_on(self) -> bool:
        """True if the effect is simulated, in any amount."""
        return self.value not in LEFT_OUT


INDIRECT = (
    "bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "reflective_caustics", "refractive_caustics"
)  # fmt: skip
"""Effects whose light is all part of the light after a first bounce."""


def error_together(errors: Mapping[str, float], indirect: float | None) -> float:
    """ΔE2000 of several omissions; ``indirect``: of all light after a first bounce, which is lost only once.

    None for ``indirect`` if it is not known.
    """
    after_bounces = sum(error for name, error in errors.items() if name in INDIRECT)
    others = sum(error for name, error in errors.items() if name not in INDIRECT)
    return others + (after_bounces if indirect is None else min(after_bounces, indirect))


@dataclass(frozen=True, slots=True)
class EffectPlan:
    """All decisions, in the order of display. ``pilot_paths``: light paths traced to decide, 0 without a pilot.

    ``seconds``: time to make the plan. ``indirect_error``: ΔE2000 of omitting all light after a first bounce, None if
    it is not known. ``clamped_share``: part of the light that the clamp of the scene's light paths removes, None if it
    is not known.
    """

    decisions: tuple[Decision, ...]
    tolerance_delta_e: float
    pilot_paths: int = 0
    seconds: float = field(default=0.0, compare=False)
    indirect_error: float | None = None
    clamped_share: float | None = None

    def __getitem__(self, name: str) -> Decision:
        """Decision by name; raises UnknownNameError."""
        for decision in self.decisions:
            if decision.name == name:
                return decision
        raise UnknownNameError.among("effect", name, [decision.name for decision in self.decisions])

    @property
    def is_spectral(self) -> bool:
        """True if wavelengths are traced instead of red, green and blue."""
        return self["transport"].value == "spectral"

    @property
    def bounces(self) -> int:
        """Bounces after the first surface that the camera sees."""
        return int(self["bounces"].value)

    @property
    def accepted(self) -> float:
        """Largest ΔE2000 of all decisions together, as far as it is known."""
        return error_together({each.name: each.accepted or 0.0 for each in self.decisions}, self.indirect_error)

    @property
    def notes(self) -> tuple[Note, ...]:
        """What the scene's limits on light paths remove, if it is visible."""
        share = self.clamped_share or 0.0
        return () if share < VISIBLE_SHARE else (Note("Light Paths", CLAMPED.format(100 * share)),)

    def is_on(self, name: str) -> bool:
        """True if an effect is simulated, in any amount."""
        return self[name].is_on

    def changed(self, name: str, value: str) -> EffectPlan:
        """The plan with another value of one effect. Raises UnknownNameError, also for a value that it cannot take."""
        choices = self[name].choices
        if choices and value not in choices:
            raise UnknownNameError.among(f"value of effect {name!r}", str(value), choices)
        other = replace(self[name], value=value)
        return replace(self, decisions=tuple(other if each.name == name else each for each in self.decisions))

    def as_rows(self) -> list[dict[str, str | bool | float | None]]:
        """The plan as plain data, for reports."""
        return [
            {
                "effect": decision.name,
                "value": decision.value,
                "reason": decision.reason,
                "cost_if_left_out": decision.cost_if_left_out,
                "error_if_left_out": decision.error,
                "error_is": decision.how,
                "error_accepted": decision.accepted,
                "time_share": decision.time_share,
                "decided_by": decision.source,
                "overridable": decision.overridable,
            }
            for decision in self.decisions
        ]

    def header(self) -> dict[str, str]:
        """Header of a picture's file on the plan: each decision, and the artist's overrides."""
        entries = {"spectral.plan.tolerance": f"{self.tolerance_delta_e:g}"}
        for decision in self.decisions:
            forced = " (forced)" if decision.source == "artist" else ""
            known = decision.error is not None and decision.error != float("inf")
            error = f"; left out dE2000 {decision.error:.3g} {decision.how}" if known else ""
            entries[f"spectral.plan.{decision.name}"] = f"{decision.value}{forced}{error}"
        return entries


def fullest(plans: Sequence[EffectPlan]) -> EffectPlan:
    """One plan for several states of a scene: as much of each effect as any of ``plans`` simulates."""
    decisions = []
    for each in zip(*(plan.decisions for plan in plans), strict=True):
        most = max(each, key=_amount)
        accepted = [other.accepted for other in each if other.value == most.value and other.accepted is not None]
        decisions.append(replace(most, accepted=max(accepted, default=None)))
    indirect, clamped = ([getattr(plan, name) for plan in plans] for name in ("indirect_error", "clamped_share"))
    return replace(
        plans[0],
        decisions=tuple(decisions),
        pilot_paths=sum(plan.pilot_paths for plan in plans),
        seconds=sum(plan.seconds for plan in plans),
        indirect_error=None if None in indirect else max(indirect),
        clamped_share=max((share for share in clamped if share is not None), default=None),
    )


def _amount(decision: Decision) -> tuple[int, int]:
    number = int(decision.value) if decision.value.isdecimal() else 0
    return int(decision.is_on and decision.value != "rgb"), number


def table(plan: EffectPlan) -> str:
    """The plan as text: effect, value, error of omitting it, origin of the error, share of the time, reason."""
    lines = [f"{'effect':22} {'value':10} {'ΔE without':>10} {'origin':9} {'time':>5}  reason"]
    for each in plan.decisions:
        error = "?" if each.error is None else ">99" if each.error > 99 else f"{each.error:.2g}"
        mark = "*" if each.source == "artist" else ""
        lines.append(
            f"{each.name:22} {each.value + mark:10} {error:>10} {each.how:9} {each.time_share:5.0%}  {each.reason}"
        )
    return "\n".join(lines)
