# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampled volumes as media that vary, for scenes with other media: paths scatter in all of them.

The transfer function is applied at the samples of a grid that is finer than the voxels where memory allows, and the
coefficients are interpolated. Without other media, ``render.volumes`` applies it in between.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.light_groups import light_groups
from spectral_core.render.plan.decision import EffectPlan
from spectral_core.render.plan.inventory import take_inventory
from spectral_core.render.plan.simulated import simulated_scene
from spectral_core.render.volumes import require_lighting
from spectral_core.scene import Instance, Material, MediumGrid, Note, ScatteringMedium, Scene, VolumeObject, gray
from spectral_core.scene.geometry import BORDER_MARGIN, index_box, unit_box
from spectral_core.volume.mitsuba_integrator.illumination import display_matrix

Array = NDArray[Any]

AS_MEDIA = (
    "sampled volumes among other media are rendered as media: their transfer functions are applied at samples of a "
    "grid, and materials that reflect light scatter it evenly, without shading by the gradient"
)
TOO_THIN = 1e-3
"""Bound of the ΔE2000 of media that are left out, so that volumes keep their shading."""
THIN = "media too thin to matter (ΔE {:.1g} at most) are left out, so that sampled volumes keep their shading"
FINER, MOST_SAMPLES = 2, 1 << 22
"""Samples of the grid along a voxel, and the number of samples above which there is one."""


def with_volumes(scene: Scene, plan: EffectPlan) -> tuple[Scene, EffectPlan, tuple[Note, ...]]:
    """The scene that a plan simulates, with its volumes as media if it has others; the plan, and a note on that."""
    simulated = simulated_scene(scene, plan)
    if not (simulated.volumes and plan.is_on("media") and take_inventory(simulated).media):
        return simulated, plan, ()
    lost = plan["media"].error
    if lost is not None and lost < TOO_THIN:
        plan = plan.changed("media", "off")
        return simulated_scene(scene, plan), plan, (Note("Volumes", THIN.format(lost)),)
    bright = [volume for volume in simulated.volumes if _is_clipped(volume)]
    clipped = [
        Note(volume.name, "reflects a color outside 0 to 1; among media it scatters at the limit") for volume in bright
    ]
    return volumes_as_media(simulated), plan, (Note("Volumes", AS_MEDIA), *clipped)


def _is_clipped(volume: VolumeObject) -> bool:
    """True if a lit material has a color that no medium scatters."""
    lit = np.array([material.lit for material in volume.transfer.materials]) & (require_lighting(volume) != "even")
    colors = display_matrix(volume.transfer)[lit]
    return bool(np.any((colors < -1e-6) | (colors > 1 + 1e-6)))


def volumes_as_media(scene: Scene) -> Scene:
    """The scene with its sampled volumes as objects whose media vary; their emission is in the first light group."""
    group = next(iter(light_groups(scene)), "")
    made = [
        _object(volume, f"{volume.name} (volume {number})", group) for number, volume in enumerate(scene.volumes, 1)
    ]
    items = [item for item in made if item is not None]
    box = unit_box()
    return replace(
        scene,
        volumes=(),
        meshes=scene.meshes if any(mesh.name == box.name for mesh in scene.meshes) else (*scene.meshes, box),
        materials=(*scene.materials, *(material for material, _ in items)),
        instances=(*scene.instances, *(instance for _, instance in items)),
    )


def _object(volume: VolumeObject, name: str, group: str) -> tuple[Material, Instance] | None:
    """Material and instance of a volume; None for one that shows nothing."""
    values, world_from_index = _finer(volume)
    scattering, absorption, emission = _coefficients(volume, values, world_from_index)
    density, strength = float(max(scattering.max(), absorption.max())), float(emission.max())
    if density == 0 and strength == 0:
        return None
    parts = scattering / (density or 1.0), absorption / (density or 1.0), emission / (strength or 1.0)
    grid = MediumGrid(world_from_index, *(np.minimum(part, 1.0).astype(np.float32) for part in parts))
    medium = ScatteringMedium(density, gray(1.0), emission_color=gray(1.0), emission_strength=strength, grid=grid)
    place = volume.world_from_index @ index_box(volume.data.shape, BORDER_MARGIN)
    instance = Instance(
        name, unit_box().name, place, (name,), group, shown_as=volume.name, hidden_from=volume.hidden_from
    )
    return Material(name, None, medium), instance


def _finer(volume: VolumeObject) -> tuple[Array, Array]:
    """Values on the finer grid, linear between voxels, and its matrix."""
    data = np.asarray(volume.data, dtype=np.float32)
    times = FINER if data.size * FINER**3 <= MOST_SAMPLES else 1
    matrix = volume.world_from_index.copy()
    if times == 1:
        return data, matrix
    from scipy.ndimage import zoom

    data = zoom(data, times, order=1, mode="nearest", grid_mode=True)
    finer = np.eye(4)
    finer[:3, :3] /= times
    finer[:3, 3] = 0.5 / times - 0.5
    return data, matrix @ finer


def _coefficients(volume: VolumeObject, values: Array, world_from_index: Array) -> tuple[Array, Array, Array]:
    """Scattering, absorption and emission as linear RGB (nx, ny, nz, 3) per unit of length."""
    transfer, lit_by_scene = volume.transfer, require_lighting(volume) != "even"
    slopes = _slopes(values, world_from_index) if transfer.uses_gradient else None
    extinction, source = transfer.curves(values, slopes)
    colors = np.maximum(display_matrix(transfer), 0.0)
    reflects = np.array([material.lit and lit_by_scene for material in transfer.materials])
    scattering = (extinction * reflects) @ np.minimum(colors, 1.0)
    shines = np.where(reflects, source - extinction, source)
    return scattering, np.maximum(extinction.sum(axis=-1)[..., None] - scattering, 0.0), shines @ colors


def _slopes(values: Array, world_from_index: Array) -> Array:
    """Magnitude of the gradient per unit of length of the world."""
    parts = [np.gradient(values, axis=k) if values.shape[k] > 1 else np.zeros_like(values) for k in range(3)]
    across = np.stack(parts, axis=-1) @ np.linalg.inv(world_from_index[:3, :3])
    return np.asarray(np.linalg.norm(across, axis=-1))
