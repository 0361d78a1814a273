# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes that a view layer requests: rendered ones, and notes on the others."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Mist, Note, Passes, Scene
from spectral_core.scene.passes import CRYPTOMATTES, GROUP_PREFIX

from .. import compat
from .context import overridden
from .lighting.outputs import outputs_of_world
from .shading.attributes import root_of

OF_LAYER = {
    "use_pass_z": "Depth", "use_pass_mist": "Mist", "use_pass_position": "Position", "use_pass_normal": "Normal",
    "use_pass_uv": "UV", "use_pass_object_index": "Object Index", "use_pass_material_index": "Material Index",
    "use_pass_diffuse_direct": "Diffuse Direct", "use_pass_diffuse_indirect": "Diffuse Indirect",
    "use_pass_diffuse_color": "Diffuse Color", "use_pass_glossy_direct": "Glossy Direct",
    "use_pass_glossy_indirect": "Glossy Indirect", "use_pass_glossy_color": "Glossy Color",
    "use_pass_transmission_direct": "Transmission Direct", "use_pass_transmission_indirect": "Transmission Indirect",
    "use_pass_transmission_color": "Transmission Color", "use_pass_emit": "Emission",
    "use_pass_environment": "Environment", "use_pass_cryptomatte_object": "CryptoObject",
    "use_pass_cryptomatte_material": "CryptoMaterial", "use_pass_cryptomatte_asset": "CryptoAsset",
}  # fmt: skip
"""Check box of a view layer to its pass."""
OF_CYCLES = {
    "denoising_store_passes": ("Denoising Normal", "Denoising Albedo", "Denoising Depth"),
    "pass_debug_sample_count": ("Debug Sample Count",),
    "use_pass_volume_direct": ("Volume Direct",),
    "use_pass_volume_indirect": ("Volume Indirect",),
}
"""The same for Cycles' own check boxes, which files use with any engine."""
NOT_RENDERED = {
    "use_pass_volume_scatter": "Volume Scatter", "use_pass_volume_transmit": "Volume Transmit",
    "use_pass_volume_majorant": "Volume Majorant", "pass_render_time": "Render Time",
}  # fmt: skip
"""Cycles' check boxes without a pass here."""
OF_OTHERS = {"use_pass_combined", "use_pass_cryptomatte_accurate", "use_pass_grease_pencil"}
"""Check boxes without a separate pass: the picture, an option of another pass, and one that Blender itself draws."""
LETTERS = {
    "Depth": "Z", "Mist": "Z", "Position": "XYZ", "Normal": "XYZ", "UV": "UVA", "Object Index": "X",
    "Material Index": "X", "Denoising Normal": "XYZ", "Denoising Depth": "Z", "Debug Sample Count": "X",
    "Noisy Image": "RGBA",
}  # fmt: skip
"""Channels of a pass in a file; RGB by default."""
OLDER_NAMES = {
    "Diffuse Direct": "DiffDir", "Diffuse Indirect": "DiffInd", "Diffuse Color": "DiffCol",
    "Glossy Direct": "GlossDir", "Glossy Indirect": "GlossInd", "Glossy Color": "GlossCol",
    "Transmission Direct": "TransDir", "Transmission Indirect": "TransInd", "Transmission Color": "TransCol",
    "Volume Direct": "VolumeDir", "Volume Indirect": "VolumeInd", "Emission": "Emit", "Environment": "Env",
    "Object Index": "IndexOB", "Material Index": "IndexMA",
}  # fmt: skip
"""Blender 4's name of a pass."""

MIST_WITHOUT_WORLD = Mist(0.0, 100.0, "LINEAR")
"""That of Cycles in a scene without a world."""


@dataclass(frozen=True)
class Slot:
    """A pass in Blender: its name, the letters of its channels, and their type."""

    name: str
    letters: str
    kind: str


def passes_of(scene: Any, layer: Any) -> Passes | None:
    """The passes that a view layer requests beside the picture; None for none."""
    taken, names, groups = _requested(scene, layer)
    names, groups = [name for name in names if name not in taken], [name for name in groups if name not in taken]
    if not names and not taken and not groups:
        return None
    world = scene.world  # as in Cycles, that of the scene, also where the layer has another one
    mist = MIST_WITHOUT_WORLD if world is None else _mist(world.mist_settings)
    levels = min(max(int(layer.pass_cryptomatte_depth), 2), 16)
    lit = tuple(name.removeprefix(GROUP_PREFIX) for name in groups)
    return Passes(tuple(names), tuple(taken.items()), lit, mist, float(layer.pass_alpha_threshold), levels)


def rendered_passes(depsgraph: Any, scene: Scene) -> Passes | None:
    """``passes_of`` a depsgraph, with what its world gives to AOVs, seen by the camera of the translated ``scene``."""
    wanted = passes_of(depsgraph.scene_eval, depsgraph.view_layer_eval)
    if wanted is None or not wanted.aovs:
        return wanted
    return replace(wanted, of_world=outputs_of_world(depsgraph, scene))


def read_by_passes(depsgraph: Any) -> frozenset[str]:
    """Inputs from the mesh that passes of the depsgraph's view layer show, beside those that materials read."""
    return frozenset({"uv"}) if depsgraph.view_layer_eval.use_pass_uv else frozenset()


def _requested(scene: Any, layer: Any) -> tuple[dict[str, str], list[str], list[str]]:
    """Type of each AOV by its name, other passes, and passes of light groups.

    Blender checks the name of an AOV against other passes when it is typed, not against those of later switches and
    groups. Of two passes of one name the AOV is in the file, as with Cycles.
    """
    cycles = getattr(layer, "cycles", None)
    names = [name for tick, name in OF_LAYER.items() if getattr(layer, tick, False)]
    names += [name for tick, more in OF_CYCLES.items() if getattr(cycles, tick, False) for name in more]
    if scene.spectral.render.denoise:
        names.append("Noisy Image")
    groups = [GROUP_PREFIX + group.name for group in layer.lightgroups]
    return {aov.name: aov.type for aov in layer.aovs if aov.is_valid}, names, groups


def _mist(settings: Any) -> Mist:
    return Mist(float(settings.start), float(settings.depth), settings.falloff)


def slots_of(wanted: Passes) -> list[Slot]:
    """The requested passes in the form in which Blender allocates them, without the picture itself."""
    slots = []
    for name in wanted.names:
        layers = (wanted.levels + 1) // 2 if name in CRYPTOMATTES else 0
        if layers:
            slots += [Slot(f"{name}{k:02d}", "rgba", "COLOR") for k in range(layers)]
            continue
        letters = LETTERS.get(name, "RGB")
        kind = "VALUE" if len(letters) == 1 else "COLOR" if letters.startswith("RGB") else "VECTOR"
        shown = OLDER_NAMES.get(name, name) if bpy.app.version < (5, 0, 0) else name
        slots.append(Slot(shown, letters, kind))
    slots += [Slot(name, *(("X", "VALUE") if kind == "VALUE" else ("RGBA", "COLOR"))) for name, kind in wanted.aovs]
    slots += [Slot(GROUP_PREFIX + name, "RGB", "COLOR") for name in wanted.light_groups]
    return slots


def pass_notes(layer: Any) -> tuple[Note, ...]:
    """Notes that name every enabled pass that is not rendered, and those in whose place an AOV is."""
    subject, cycles = f"view layer {layer.name}", getattr(layer, "cycles", None)
    taken, names, groups = _requested(layer.id_data, layer)
    notes = [
        Note(subject, f"the pass {name!r} holds the AOV of this name, and no other; rename the AOV")
        for name in (*names, *groups)
        if name in taken
    ]
    asked = [
        prop.name
        for prop in layer.bl_rna.properties
        if prop.identifier.startswith("use_pass_")
        and prop.identifier not in OF_OTHERS
        and prop.identifier not in OF_LAYER
        and getattr(layer, prop.identifier)
    ]
    asked += [name for tick, name in NOT_RENDERED.items() if getattr(cycles, tick, False)]
    if asked:
        notes.append(Note(subject, f"{', '.join(asked)}: not rendered; the file does not hold it"))
    return tuple(notes)


def fill_passes(places: Any, passes: dict[str, NDArray[np.float32]], view: str, working_from_rgb: Any) -> None:
    """Copy passes (height, width, channels) to Blender's buffers.

    ``working_from_rgb``: (3, 3) to the scene's color space, None if that is linear sRGB.
    """
    older = {new: old for new, old in OLDER_NAMES.items() if bpy.app.version < (5, 0, 0)}
    for name, picture in passes.items():
        place = places.find_by_name(older.get(name, name), view)
        if place is None:
            continue
        shown = np.array(picture, dtype=np.float32)
        is_data = name in LETTERS and not LETTERS[name].startswith("RGB")
        if working_from_rgb is not None and shown.shape[2] >= 3 and not is_data and not name.startswith(CRYPTOMATTES):
            shown[..., :3] = shown[..., :3] @ working_from_rgb.T.astype(np.float32)
        place.rect.foreach_set(shown.ravel())


def cryptomatte_header(scene: Scene, depsgraph: Any) -> dict[str, str]:
    """Header of a file with the cryptomattes of a scene that was translated from a depsgraph."""
    from spectral_core.render.passes.cryptomatte import header

    wanted = scene.settings.passes
    if wanted is None or not wanted.cryptomattes:
        return {}
    beside = _names_beside(depsgraph)
    names = {
        "CryptoObject": [item.shown_as or item.name for item in scene.instances],
        "CryptoMaterial": [item.shown_as or item.name for item in scene.materials],
        "CryptoAsset": [item.asset or item.shown_as or item.name for item in scene.instances],
    }
    entries: dict[str, str] = {}
    for kind in wanted.cryptomattes:
        entries |= header(depsgraph.view_layer_eval.name, kind, names[kind] + beside[kind])
    return entries


def _names_beside(depsgraph: Any) -> dict[str, list[str]]:
    """Names by cryptomatte that no surface of the picture has, and that Cycles lists too: of lamps, of the world, and
    of materials that the view layer's override replaces.
    """
    lamps = [each for each in depsgraph.ids if isinstance(each, bpy.types.Object) and each.type == "LIGHT"]
    lamps = [each for each in lamps if not each.hide_render]
    shaded = [
        each for each in depsgraph.ids if isinstance(each, bpy.types.Light) and compat.node_tree(each) is not None
    ]
    materials = [each for each in depsgraph.ids if isinstance(each, bpy.types.Material)]
    world = overridden(depsgraph, "world_override") or depsgraph.scene_eval.world
    return {
        "CryptoObject": [lamp.name for lamp in lamps],
        "CryptoMaterial": [each.name for each in (*materials, *shaded)],
        "CryptoAsset": [*(root_of(lamp).name for lamp in lamps), *([] if world is None else [world.name])],
    }
