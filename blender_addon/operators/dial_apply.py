# SPDX-License-Identifier: GPL-3.0-or-later
"""From the dial back to the scene: the mixture applied to the lights themselves, or one light with the mixed
spectrum.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from bpy.props import BoolProperty
from bpy.types import ID, Context, Object, PropertyGroup, Scene, World

from spectral_core.errors import InvalidInputError, counted

from .. import compat
from ..editing.dial import changes, kept_mix, live
from ..editing.dial.differences import world_varies
from ..editing.dial.dimming import (
    apply_weights,
    block_of,
    dark_lamps_lit,
    dark_worlds_lit,
    require_power,
    require_writable,
)
from ..editing.dial.members import forget_deleted
from ..editing.dial.names import name_of, original_of
from ..translate.lighting.lights import emitting_area
from ..translate.spectra.stored import require_editable, store_spectrum, strength_of
from .common import UNDOABLE, reporting, require_kept
from .dial import dial_in

if TYPE_CHECKING:
    from spectral_core.render.relight.mix import LiveMix
    from spectral_core.render.relight.transport import Transport
    from spectral_core.spectra.spectrum import Illuminant, Spectrum

BAKED = "Dial Light"


class SPECTRAL_OT_dial_apply(bpy.types.Operator):
    """Write the mixture to the powers of lamps, worlds and emissive materials: F12 then gives this picture"""

    bl_idname = "spectral.dial_apply"
    bl_label = "Apply to Lights"
    bl_options = UNDOABLE
    restore: BoolProperty(name="Restore", default=False, description="Restore the recorded powers")

    @reporting
    def execute(self, context: Context) -> None:
        require_kept(context.scene, "light dial")
        dial = dial_in(context)
        if not len(dial.bulbs):
            raise InvalidInputError("the dial has no bulbs yet; press Record")
        forget_deleted()
        weights = np.ones(len(dial.bulbs)) if self.restore else live.weights_of(dial)
        if not weights.any():
            self.report({"WARNING"}, "all bulbs are off: the lights are dark now. Ctrl Z, or Restore, brings them back")
        if not self.restore:
            _require_lamps(dial)
        require_writable(dial.bulbs, weights)
        with dark_lamps_lit(dial.bulbs):
            parts = changes.present_parts(context.scene)
            if not self.restore:
                _require_no_lamp_of_world(context.scene, parts.values)
        before = parts.hashes()
        for bulb, weight in zip(dial.bulbs, weights.tolist(), strict=True):
            bulb.is_dark, bulb.lit = weight == 0, weight or bulb.lit
        count = apply_weights(dial.bulbs, [0.0 if bulb.is_dark else bulb.lit for bulb in dial.bulbs])
        if not self.restore:
            _apply_lamps(dial)
        changes.accept(context.scene, before)
        keyed = _animated(dial)
        if keyed:
            self.report({"WARNING"}, f"{keyed} is animated: its keyframes may replace the mixture")
        self.report({"INFO"}, f"{counted(count, 'power or strength', 'powers and strengths')} written")


def _require_lamps(dial: PropertyGroup) -> None:
    """Check, before anything is written, that the lights of a bulb can have its lamp."""
    from ..translate.spectra import catalogue

    for bulb in dial.bulbs:
        if bulb.lamp:
            catalogue.named("illuminant", bulb.lamp)  # raises for an unknown name
        _require_lamp_of_original(bulb, dial)
        for kept in bulb.members:
            if bulb.lamp and kept.slot >= 0:
                raise InvalidInputError(
                    f"{kept.owner.name!r} is an emissive object, which cannot have the lamp {bulb.lamp!r}; "
                    "give it to its Emission node, or empty the bulb's lamp"
                )
            if bulb.lamp and kept.owner is not None:
                require_editable(_carrier(kept))


def _require_lamp_of_original(bulb: PropertyGroup, dial: PropertyGroup) -> None:
    """Check that a bulb that has no light of its own, such as an instance, has the lamp that Apply would give it."""
    original = None if len(bulb.members) else original_of(bulb, dial.bulbs)
    assigned = "" if original is None else original.lamp
    if not len(bulb.members) and bulb.lamp != assigned:
        shown, left = (f"the lamp {lamp!r}" if lamp else "no lamp" for lamp in (bulb.lamp, assigned))
        raise InvalidInputError(
            f"{name_of(bulb)!r} is an instance of a light, or the emission of a view layer's material override, and "
            f"has no spectrum of its own: the dial shows it with {shown}, and after Apply it would have {left}. Give "
            "both bulbs the same lamp, or make it real and record again"
        )


def _require_no_lamp_of_world(scene: Scene, parts: Mapping[str, Any]) -> None:
    """Check that no lamp is chosen for a world of several colors: it would replace its image, pattern or sky.

    ``parts``: those of the scene as it is.
    """
    bulbs = scene.spectral.dial.bulbs
    with_worlds = [(bulb, kept.owner) for bulb in bulbs for kept in bulb.members if isinstance(kept.owner, World)]
    chosen = [(bulb, world) for bulb, world in with_worlds if bulb.lamp]
    if any(bulb.is_dark for bulb, _ in chosen):
        with dark_worlds_lit(bulbs):
            parts = changes.present_parts(scene).values
    if chosen and world_varies(parts):
        bulb, world = chosen[0]
        raise InvalidInputError(
            f"{world.name!r} shines in several colors, such as an image or a sky, which the lamp {bulb.lamp!r} would "
            f"replace; empty the lamp of the bulb {name_of(bulb)!r} before Apply"
        )


def _carrier(kept: PropertyGroup) -> ID:
    """The light or world with the spectrum of a member."""
    return kept.owner if isinstance(kept.owner, World) else kept.owner.data


def _apply_lamps(dial: PropertyGroup) -> None:
    for bulb in dial.bulbs:
        for kept in bulb.members if bulb.lamp else ():
            carrier = _carrier(kept)
            strength = strength_of(carrier)
            carrier.spectral.source = "CATALOGUE"
            carrier.spectral.catalogue_name = bulb.lamp
            carrier.spectral.strength = strength  # a recording is relative to it


def _animated(dial: PropertyGroup) -> str:
    """Name of the first lamp, material or world behind the dial that has keyframes or drivers, "" without one.

    Strengths of nodes are animated by their node tree.
    """
    for bulb in dial.bulbs:
        for kept in bulb.members:
            block = block_of(kept)
            for animated in (block, getattr(block, "node_tree", None) if kept.node else None):
                if block is not None and animated is not None and _moves(animated.animation_data):
                    return block.name
    return ""


def _moves(animation: bpy.types.AnimData | None) -> bool:
    return animation is not None and bool(animation.action or len(animation.drivers) or len(animation.nla_tracks))


class SPECTRAL_OT_dial_bake(bpy.types.Operator):
    """Make one light with the mixed spectrum, and with position and shape of the strongest lamp of the mixture"""

    bl_idname = "spectral.dial_bake"
    bl_label = "Bake One Light"
    bl_options = UNDOABLE
    hide: BoolProperty(
        name="Hide the Mixed Lamps", default=False, description="Hide the lamps of the mixture in renders"
    )

    @reporting
    def execute(self, context: Context) -> None:
        require_kept(context.scene, "objects")
        dial = dial_in(context)
        forget_deleted()
        mixing = kept_mix.live_mix(context.scene)
        weights = live.weights_of(dial)
        luminances = _luminances(mixing)
        shares = weights * np.maximum(luminances, 0.0)
        removing = [name_of(bulb) for bulb, share in zip(dial.bulbs, weights * luminances, strict=True) if share < 0]
        lamps = [_lamps(bulb) for bulb in dial.bulbs]
        strongest = max(range(len(shares)), key=lambda k: (bool(lamps[k]), shares[k]))
        if not lamps[strongest] or not shares[strongest]:
            raise InvalidInputError(
                "no lamp contributes to the mixture, so no lamp can be made of it; turn the dial to one"
            )
        spectrum = _mixed_spectrum(dial, mixing.transport, shares)
        lamp = lamps[strongest][0]
        alike = [kept for kept in lamps[strongest] if kept.owner.data.type == lamp.owner.data.type]
        power = sum(_power(kept) for kept in alike) / _unit_power(lamp.owner)
        power *= _own_luminance(dial.bulbs[strongest], mixing.transport.lights[strongest])
        power = require_power(power * weights[strongest] * shares.sum() / shares[strongest], BAKED)
        made = lamp.owner.copy()
        made.data = made.data.copy()
        made.name = made.data.name = BAKED
        _place_as_shown(context, made, lamp.owner)
        made.lightgroup = ""
        compat.collection_for_new(context, context.scene).objects.link(made)
        made.data.color = (1.0, 1.0, 1.0)
        made.data.energy = power
        store_spectrum(made.data.spectral, spectrum)
        if self.hide:
            for kept in (each for found in lamps for each in found):
                kept.owner.hide_render = True
        if removing:
            self.report({"WARNING"}, f"one lamp cannot remove light, so it is made without {', '.join(removing)}")
        self.report({"INFO"}, f"{made.name}: {made.data.energy:.4g} W")


def _place_as_shown(context: Context, made: Object, lamp: Object) -> None:
    """Place a copy of a lamp where the lamp's first instance is, if only instances show the lamp."""
    graph = context.evaluated_depsgraph_get()
    shown = [
        (each.is_instance, each.matrix_world.copy()) for each in graph.object_instances if each.object.original == lamp
    ]
    if shown and all(is_instance for is_instance, _ in shown):
        made.parent = None
        made.animation_data_clear()
        made.constraints.clear()
        made.matrix_world = shown[0][1]


def _lamps(bulb: PropertyGroup) -> list[PropertyGroup]:
    """The lamps of a bulb, the strongest first."""
    found = [kept for kept in bulb.members if isinstance(kept.owner, bpy.types.Object) and kept.owner.type == "LIGHT"]
    return sorted(found, key=lambda kept: -_power(kept))


def _power(kept: PropertyGroup) -> float:
    """Power of a lamp as recorded (a sun's irradiance), before its nodes."""
    return float(kept.base * strength_of(kept.owner.data) * _unit_power(kept.owner))


def _unit_power(lamp: Object) -> float:
    """Power of a lamp whose setting of the power is 1: it has an exposure, and may be given per area."""
    matrix = np.array(lamp.matrix_world, dtype=np.float64)
    return compat.light_exposure_factor(lamp.data) * emitting_area(lamp.data, matrix)


def _own_luminance(bulb: PropertyGroup, recorded: "Spectrum | None") -> float:
    """Luminance of a bulb's light relative to a white one of the same power: a color has that of its RGB."""
    from spectral_core.spectra.observer import xyz_of
    from spectral_core.spectra.spectrum import Illuminant

    if bulb.lamp or recorded is None:
        return 1.0
    return float(xyz_of(Illuminant(recorded.name, recorded.grid, recorded.values))[1])


def _luminances(mixing: "LiveMix") -> np.ndarray:
    """Mean luminance (n,) of each group in the recorded picture, below 0 for lamps that remove light."""
    count = len(mixing.transport.groups)
    from spectral_core.spectra.color import luminance_from_linear_rgb

    colors = [mixing.picture(row)[..., :3].reshape(-1, 3).mean(axis=0) for row in np.eye(count)]
    return luminance_from_linear_rgb(np.reshape(colors, (count, 3)))


def _mixed_spectrum(dial: PropertyGroup, transport: "Transport", shares: np.ndarray) -> "Illuminant":
    """Sum of the lights' spectra, each with its luminance in the picture."""
    from spectral_core.scene.fluorescent import EXCITED_NM  # dyes need the ultraviolet of lamps
    from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

    from ..translate.spectra import catalogue

    grid = SpectralGrid(EXCITED_NM)
    total = np.zeros(grid.size)
    for bulb, light, share in zip(dial.bulbs, transport.lights, shares, strict=True):
        if share == 0:
            continue
        spectrum = catalogue.named("illuminant", bulb.lamp) if bulb.lamp else light
        if spectrum is None:
            raise InvalidInputError(
                f"the lights of {name_of(bulb)!r} have no common spectrum (or they are emissive objects); give the "
                "bulb a lamp, or record with One per Light"
            )
        total += share * _unit(spectrum).resampled(grid, average=True).values  # a line between two knots counts, too
    return Illuminant("dial mixture", grid, total / total.max(), source="mixed on the light dial")


def _unit(spectrum: "Spectrum") -> "Illuminant":
    from spectral_core.spectra.observer import normalized
    from spectral_core.spectra.spectrum import Illuminant

    return normalized(Illuminant(spectrum.name, spectrum.grid, spectrum.values))


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_OT_dial_apply, SPECTRAL_OT_dial_bake))
