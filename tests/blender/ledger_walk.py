# SPDX-License-Identifier: GPL-3.0-or-later
"""List every setting of this Blender that the ledger lacks. Also runs as a script inside a real Blender."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

TYPES = (
    "Object", "PointLight", "SpotLight", "SunLight", "AreaLight", "World", "Camera", "CameraDOFSettings",
    "CameraStereoData", "CameraBackgroundImage", "ViewLayer", "LayerCollection", "Collection", "Scene",
    "RenderSettings", "Material", "MaterialSlot", "ParticleSettings", "Mesh", "Curve", "SurfaceCurve", "TextCurve",
    "MetaBall", "Image", "ImageUser", "Volume", "VolumeDisplay", "VolumeRender", "TexMapping", "ColorMapping",
    "ColorRamp", "ColorRampElement", "CurveMapping", "CurveMapPoint", "ColorManagedInputColorspaceSettings",
    "ColorManagedViewSettings", "ColorManagedDisplaySettings", "ImageFormatSettings", "Stereo3dFormat",
    "SceneRenderView", "UnitSettings", "AOV", "CollectionLightLinking", "ObjectLightLinking",
)  # fmt: skip
OURS = ("spectral", "cycles", "cycles_curves", "cycles_visibility")
"""Properties that add-ons add to Blender's types; other tests check those of this extension."""
ABSTRACT = ("ShaderNode", "ShaderNodeTree", "ShaderNodeCustomGroup")


def missing_of(kind: str, names: list[str]) -> list[str]:
    """Settings of a type that the ledger lacks."""
    from blender_addon.translate.ledger import entries

    entry = entries().get(kind)
    return [name for name in names if entry is None or not entry.accounts_for(name)]


def settings_of(kind: Any, base: Any) -> list[str]:
    """Names of a type's writable properties, without those that every data-block or node has."""
    common = {each.identifier for each in base.bl_rna.properties}
    return [p.identifier for p in kind.bl_rna.properties if p.identifier not in common and not p.is_readonly]


def missing_of_types() -> dict[str, list[str]]:
    """Missing settings by type: Blender's types, and Cycles' settings if Cycles is installed."""
    import bpy

    found = {}
    for name in TYPES:
        names = settings_of(getattr(bpy.types, name), bpy.types.ID)
        found[name] = missing_of(name, [each for each in names if each not in OURS])
    try:
        from cycles import properties
    except ImportError:
        return {name: names for name, names in found.items() if names}
    for name in dir(properties):
        kind = getattr(properties, name)
        if name.startswith("Cycles") and hasattr(kind, "bl_rna"):
            found[name] = missing_of(name, settings_of(kind, bpy.types.ID))
    return {name: names for name, names in found.items() if names}


def missing_of_nodes() -> dict[str, list[str]]:
    """Missing settings and inputs by type of shader node."""
    import bpy

    tree, found = bpy.data.node_groups.new("every node", "ShaderNodeTree"), {}
    for name in dir(bpy.types):
        if not name.startswith("ShaderNode") or name in ABSTRACT:
            continue
        node = tree.nodes.new(name)
        names = settings_of(type(node), bpy.types.ShaderNode)
        names += [f"input:{socket.identifier}" for socket in node.inputs]
        if left := missing_of(name, names):
            found[name] = left
    return found


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    print("MISSING", json.dumps(missing_of_types() | missing_of_nodes()))
