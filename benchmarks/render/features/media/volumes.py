# SPDX-License-Identifier: GPL-3.0-or-later
"""Media inside the ball: scatter, absorption, Principled Volume, phase functions, emission, textures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

TINT = (0.3, 0.6, 0.9, 1)


def _filled(
    kind: str, *, surface: str | None = None, texture: str | None = None, **inputs: Any
) -> Callable[[Stage], None]:
    """The ball filled with a medium, without a surface or with one; ``texture``: an input driven by noise."""

    def build(stage: Stage) -> None:
        tree = stage.tree()
        if surface is None:
            tree.nodes.remove(tree.nodes["shader"])
        else:
            stage.shader(surface)
        node = stage.node(kind, **inputs)
        stage.link(node.outputs[0], tree.nodes["output"].inputs["Volume"])
        if texture is not None:
            noise = stage.node("ShaderNodeTexNoise", Scale=2.0)
            stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
            stage.link(noise.outputs[0], node.inputs[texture])
        stage.scene.cycles.volume_biased = False

    return build


for _density in (0.3, 1.0, 5.0):
    feature(
        f"volumes/scatter {_density:g}", _filled("ShaderNodeVolumeScatter", Color=(1, 1, 1, 1), Density=_density), 2
    )
feature("volumes/scatter colored", _filled("ShaderNodeVolumeScatter", Color=TINT, Density=1.0), 2)
for _g in (-0.7, 0.7):
    feature(f"volumes/scatter anisotropy {_g:g}", _filled("ShaderNodeVolumeScatter", Color=TINT, Anisotropy=_g), 2)
for _phase in ("FOURNIER_FORAND", "DRAINE", "RAYLEIGH", "MIE"):
    feature(f"volumes/phase {_phase.lower()}", _filled("ShaderNodeVolumeScatter", phase=_phase, Density=1.0), 2)
feature("volumes/absorption gray", _filled("ShaderNodeVolumeAbsorption", Color=(0.5, 0.5, 0.5, 1), Density=1.0))
feature("volumes/absorption colored", _filled("ShaderNodeVolumeAbsorption", Color=TINT, Density=1.0))
feature("volumes/principled", _filled("ShaderNodeVolumePrincipled", Color=(0.5, 0.5, 0.5, 1), Density=1.0), 2)
feature("volumes/principled colored", _filled("ShaderNodeVolumePrincipled", Color=TINT, Density=1.0), 2)
feature("volumes/principled absorption color", _filled(
    "ShaderNodeVolumePrincipled", Absorption_Color=TINT, Density=1.0), 2)  # fmt: skip
feature("volumes/principled emission", _filled(
    "ShaderNodeVolumePrincipled", Density=0.5, Emission_Strength=0.5, Emission_Color=TINT), 2)  # fmt: skip
feature("volumes/principled blackbody", _filled(
    "ShaderNodeVolumePrincipled", Density=0.5, Blackbody_Intensity=0.02, Temperature=3000.0), 2)  # fmt: skip
feature("volumes/emission", _filled("ShaderNodeEmission", Color=TINT, Strength=0.4), 2)
feature("volumes/coefficients", _filled("ShaderNodeVolumeCoefficients"), 2)
feature("volumes/noise as density", _filled("ShaderNodeVolumeScatter", texture="Density"), 2)
feature("volumes/noise as color", _filled("ShaderNodeVolumeScatter", texture="Color"), 2)
feature(
    "volumes/absorption in glass", _filled("ShaderNodeVolumeAbsorption", surface="ShaderNodeBsdfGlass", Color=TINT), 2
)
feature("volumes/scatter in glass", _filled("ShaderNodeVolumeScatter", surface="ShaderNodeBsdfGlass", Color=TINT), 4)
feature("volumes/behind a diffuse surface", _filled("ShaderNodeVolumeScatter", surface="ShaderNodeBsdfDiffuse"))


def _bounces(count: int) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        _filled("ShaderNodeVolumeScatter", Color=(1, 1, 1, 1), Density=3.0)(stage)
        stage.scene.cycles.volume_bounces = count

    return build


for _count in (0, 2):
    feature(f"volumes/volume bounces {_count}", _bounces(_count), 2)
feature(
    "volumes/scaled",
    lambda s: (_filled("ShaderNodeVolumeScatter", Density=1.0)(s), setattr(s.ball, "scale", (2, 1, 1))),
    2,
)
