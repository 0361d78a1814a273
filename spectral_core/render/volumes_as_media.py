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
from spectral_core.render.mitsuba_scene.paint import white_light
from spectral_core.render.plan.decision import EffectPlan
from spectral_core.render.plan.inventory import take_inventory
from spectral_core.render.plan.simulated import simulated_scene
from spectral_core.render.volumes import require_lighting
from spectral_core.scene import Instance, Material, MediumGrid, Note, ScatteringMedium, Scene, VolumeObject, gray
from spectral_core.scene.fluorescent import EXCITED_NM
from spectral_core.scene.geometry import BORDER_MARGIN, index_box, unit_box
from spectral_core.spectra.observer import STANDARD, observer
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum
from spectral_core.volume.mitsuba_integrator.illumination import display_matrix
from spectral_core.volume.transfer import Material as VolumeMaterial

Array = NDArray[Any]

AS_MEDIA = (
    "sampled volumes among other media are rendered as media: their transfer functions are applied at samples of a "
    "grid, they shadow and light what is around them, and materials that reflect light scatter it evenly, without "
    "shading by the gradient"
)
TOO_THIN = 1e-3
"""Bound of the ΔE2000 of media that are left out, so that volumes keep their shading."""
THIN = "media too thin to matter (ΔE {:.1g} at most) are left out, so that sampled volumes keep their shading"
FINER, MOST_SAMPLES = (3, 2), 1 << 22
"""Samples of the grid along a voxel, the first number of which there are no more than so many; else one. An odd number
has samples at the voxels' centers, where the field has its peaks and kinks.
"""


def with_volumes(scene: Scene, plan: EffectPlan) -> tuple[Scene, EffectPlan, tuple[Note, ...]]:
    """The scene that a plan simulates, with its volumes as media if it has others; the plan, and a note on that."""
    simulated = simulated_scene(scene, plan)
    if not (simulated.volumes and plan.is_on("media") and take_inventory(simulated).media):
        return simulated, plan, ()
    lost = plan["media"].error
    if lost is not None and lost < TOO_THIN:
        plan = plan.changed("media", "off")
        return simulated_scene(scene, plan), plan, (Note("Volumes", THIN.format(lost)),)
    spectral = plan.is_spectral
    bright = [volume for volume in simulated.volumes if _is_clipped(volume, spectral=spectral)]
    clipped = [
        Note(volume.name, "reflects a color outside 0 to 1; among media it scatters at the limit") for volume in bright
    ]
    return volumes_as_media(simulated, spectral=spectral), plan, (Note("Volumes", AS_MEDIA), *clipped)


def _is_clipped(volume: VolumeObject, *, spectral: bool) -> bool:
    """True if a lit material has a color that no medium scatters."""
    lit = np.array([_reflects(material, volume) for material in volume.transfer.materials])
    colors = (volume.transfer.colors if _keeps_spectra(volume, spectral) else display_matrix(volume.transfer))[lit]
    return bool(np.any((colors < -1e-6) | (colors > 1 + 1e-6)))


def _reflects(material: VolumeMaterial, volume: VolumeObject) -> bool:
    return material.lit and require_lighting(volume) != "even"


def _keeps_spectra(volume: VolumeObject, spectral: bool) -> bool:
    return spectral and volume.transfer.wavelengths_nm is not None


def volumes_as_media(scene: Scene, *, spectral: bool = False) -> Scene:
    """The scene with its sampled volumes as objects whose media vary; their emission is in the first light group.

    ``spectral``: for spectral transport, in which materials keep their spectra.
    """
    group = next(iter(light_groups(scene)), "")
    made = [
        _object(volume, f"{volume.name} (volume {number})", group, spectral=spectral)
        for number, volume in enumerate(scene.volumes, 1)
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


def _object(volume: VolumeObject, name: str, group: str, *, spectral: bool) -> tuple[Material, Instance] | None:
    """Material and instance of a volume; None for one that shows nothing."""
    keeps = _keeps_spectra(volume, spectral)
    values, world_from_index = _finer(volume, max(3, len(volume.transfer.materials)) if keeps else 3)
    scattering, absorption, emission = _coefficients(volume, values, world_from_index, spectral=keeps)
    density, strength = float(max(scattering.max(), absorption.max())), float(emission.max())
    if density == 0 and strength == 0:
        return None
    scattered, absorbed, emitted = (
        np.minimum(part / (largest or 1.0), 1.0).astype(np.float32)
        for part, largest in ((scattering, density), (absorption, density), (emission, strength))
    )
    grid = MediumGrid(world_from_index, scattered, absorbed, emitted, _spectra(volume) if keeps else None)
    medium = ScatteringMedium(density, gray(1.0), emission_color=gray(1.0), emission_strength=strength, grid=grid)
    place = volume.world_from_index @ index_box(volume.data.shape, BORDER_MARGIN)
    instance = Instance(
        name, unit_box().name, place, (name,), group, shown_as=volume.name, hidden_from=volume.hidden_from
    )
    return Material(name, None, medium), instance


def _finer(volume: VolumeObject, entries: int) -> tuple[Array, Array]:
    """Values on the finer grid, linear between voxels, and its matrix; ``entries``: of a coefficient per sample."""
    data = np.asarray(volume.data, dtype=np.float32)
    times = next((times for times in FINER if data.size * times**3 * entries <= 3 * MOST_SAMPLES), 1)
    matrix = volume.world_from_index.copy()
    if times == 1:
        return data, matrix
    from scipy.ndimage import zoom

    data = zoom(data, times, order=1, mode="nearest", grid_mode=True)
    finer = np.eye(4)
    finer[:3, :3] /= times
    finer[:3, 3] = 0.5 / times - 0.5
    return data, matrix @ finer


def _coefficients(
    volume: VolumeObject, values: Array, world_from_index: Array, *, spectral: bool
) -> tuple[Array, Array, Array]:
    """Scattering, absorption and emission per unit of length, as linear RGB (nx, ny, nz, 3) or for the ``_spectra`` of
    each material (nx, ny, nz, K).
    """
    transfer = volume.transfer
    slopes = _slopes(values, world_from_index) if transfer.uses_gradient else None
    extinction, source = transfer.curves(values, slopes)
    reflects = np.array([_reflects(material, volume) for material in transfer.materials])
    shines = np.where(reflects, source - extinction, source)
    if spectral:
        return extinction * reflects, extinction, shines
    colors = np.maximum(display_matrix(transfer), 0.0)
    scattering = (extinction * reflects) @ np.minimum(colors, 1.0)
    return scattering, np.maximum(extinction.sum(axis=-1)[..., None] - scattering, 0.0), shines @ colors


def _spectra(volume: VolumeObject) -> tuple[tuple[Spectrum, ...], tuple[Spectrum, ...], tuple[Spectrum, ...]]:
    """Spectra of the scattering, the absorption and the emission of each material, of the emission relative to D65."""
    transfer, nm = volume.transfer, EXCITED_NM
    colors = np.array([np.interp(nm, transfer.wavelengths_nm, each, left=0.0, right=0.0) for each in transfer.colors])
    white = white_light().at(nm) * observer(STANDARD).cmfs[1].sum()
    scattered = np.array([_reflects(material, volume) for material in transfer.materials])[:, None] * colors.clip(0, 1)
    lit = np.array([material.lit for material in transfer.materials])[:, None]
    own = np.divide(colors, np.where(lit, 1.0, white), out=np.zeros_like(colors), where=lit | (white > 0))

    def of(values: Array) -> tuple[Spectrum, ...]:
        return tuple(Spectrum(name, SpectralGrid(nm), row) for name, row in zip(transfer.names, values, strict=True))

    return of(scattered), of(1.0 - scattered), of(np.maximum(own, 0.0))


def _slopes(values: Array, world_from_index: Array) -> Array:
    """Magnitude of the gradient per unit of length of the world."""
    parts = [np.gradient(values, axis=k) if values.shape[k] > 1 else np.zeros_like(values) for k in range(3)]
    across = np.stack(parts, axis=-1) @ np.linalg.inv(world_from_index[:3, :3])
    return np.asarray(np.linalg.norm(across, axis=-1))
