# SPDX-License-Identifier: GPL-3.0-or-later
"""Participating media, homogeneous or on grids, and sampled volumes as grids."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.files.whole import write_bytes
from spectral_core.render.mitsuba_export import paints
from spectral_core.render.mitsuba_export import xml_elements as xml
from spectral_core.render.mitsuba_export.draft import Draft
from spectral_core.scene import Color, MediumGrid, Paint, ScatteringMedium, VolumeObject
from spectral_core.scene.geometry import index_box
from spectral_core.spectra.spectrum import Spectrum
from spectral_core.volume.transfer import interpolate

Array = NDArray[np.float64]


def medium(draft: Draft, item: ScatteringMedium, subject: str, identifier: str) -> xml.Element | None:
    """A medium; None if it neither absorbs nor scatters."""
    known = {"density", "color", "extinction", "anisotropy", "emission_color", "lobes", "grid"}
    draft.leftover(subject, item, known)
    if item.grid is not None:
        return _varying(draft, item, item.grid, subject, identifier)
    extinction = Color(np.ones(3)) if item.extinction is None else _constant(draft, item.extinction, subject)
    largest = float(np.max(extinction.values if isinstance(extinction, Spectrum) else extinction.linear_rgb))
    if item.density * largest <= 0:
        return None
    share = (
        Spectrum(extinction.name, extinction.grid, extinction.values / largest)
        if isinstance(extinction, Spectrum)
        else Color(np.maximum(extinction.linear_rgb, 0.0) / largest)
    )
    draft.has_clear_surfaces = True
    return xml.plugin(
        "medium", "homogeneous", xml.number("scale", item.density * largest),
        paints.reflectance(draft, "sigma_t", share, subject),
        paints.reflectance(draft, "albedo", _constant(draft, item.color, subject), subject),
        _phase(draft, item, subject), identifier=identifier,
    )  # fmt: skip


def _varying(
    draft: Draft, item: ScatteringMedium, grid: MediumGrid, subject: str, identifier: str
) -> xml.Element | None:
    """A medium that varies: Mitsuba's grid of one extinction for all colors, and a grid of albedos."""
    ones = Color(np.ones(3))
    color, extinction = (_constant_rgb(draft, paint, subject) for paint in (item.color, item.extinction or ones))
    color = np.clip(color, 0.0, 1.0)
    scattering = _coefficient(grid, grid.scattering, item.density * extinction * color, item.density)
    absorption = _coefficient(grid, grid.absorption, item.density * extinction * (1.0 - color), item.density)
    total = scattering + absorption
    sigma = total.max(axis=3)
    largest = float(sigma.max())
    if largest <= 0:
        return None
    if np.any(total.min(axis=3) < 0.99 * sigma - 1e-6 * largest):
        draft.note(subject, "absorbs some colors more than others where it varies; Mitsuba's grids have one extinction")
    box = grid.world_from_index @ index_box(grid.shape)
    albedo = scattering / np.maximum(sigma, 1e-30)[..., None]
    draft.has_clear_surfaces = True
    return xml.plugin(
        "medium", "heterogeneous", xml.number("scale", largest),
        _grid(draft, subject, "sigma_t", sigma[..., None] / largest, box),
        _grid(draft, subject, "albedo", albedo, box), _phase(draft, item, subject), identifier=identifier,
    )  # fmt: skip


def _coefficient(grid: MediumGrid, values: NDArray[np.float32] | None, constant: Array, scale: float) -> Array:
    """A coefficient as linear RGB (nx, ny, nz, 3) per unit of length."""
    if values is None:
        return np.broadcast_to(constant, (*grid.shape, 3))
    if values.ndim == 4:
        return np.asarray(scale * values, dtype=np.float64)
    return np.asarray(values[..., None] * constant, dtype=np.float64)


def _constant_rgb(draft: Draft, color: Paint, subject: str) -> Array:
    found = _constant(draft, color, subject)
    if isinstance(found, Spectrum):
        from spectral_core.render.mitsuba_scene.paint import daylight_rgb

        return np.maximum(daylight_rgb(found), 0.0)
    return np.maximum(found.linear_rgb, 0.0)


def _constant(draft: Draft, color: Paint, subject: str) -> Color | Spectrum:
    if isinstance(color, (Color, Spectrum)):
        return color
    draft.note(subject, "has a volume whose color varies; it is written gray")
    return Color(np.full(3, 0.5))


def _phase(draft: Draft, item: ScatteringMedium, subject: str) -> xml.Element:
    lobes = item.lobes or ((1.0, item.anisotropy, 0.0),)
    if any(alpha > 0 for _, _, alpha in lobes):
        draft.note(
            subject, "Draine's phase function has no counterpart in Mitsuba; that of Henyey and Greenstein is written"
        )
    total, made = 0.0, None
    for weight, g, _ in lobes:
        if weight <= 0:
            continue
        lobe = xml.plugin("phase", "hg", xml.number("g", float(np.clip(g, -0.99, 0.99))))
        total += weight
        parts = () if made is None else (xml.number("weight", weight / total), made, lobe)
        made = xml.plugin("phase", "blendphase", *parts) if parts else lobe
    return xml.plugin("phase", "isotropic") if made is None else made


def volume(draft: Draft, item: VolumeObject) -> xml.Element:
    """A sampled volume as a grid medium in its box, with the transfer function applied at the voxels."""
    draft.leftover(item.name, item, {"name", "data", "world_from_index", "transfer", "rule", "quality"})
    extinction, albedo = _classified(draft, item)
    largest = float(extinction.max())
    box = item.world_from_index @ index_box(item.data.shape)
    grids = [
        _grid(draft, item.name, name, values, box)
        for name, values in (("sigma_t", extinction[..., None] / max(largest, 1e-30)), ("albedo", albedo))
    ]
    interior = xml.plugin("medium", "heterogeneous", xml.number("scale", largest), *grids, name="interior")
    half = np.diag([0.5, 0.5, 0.5, 1.0])
    half[:3, 3] = 0.5  # Mitsuba's cube is [-1, 1]³
    draft.has_clear_surfaces = True
    return xml.plugin("shape", "cube", xml.transform("to_world", box @ half), xml.plugin("bsdf", "null"), interior)


def _classified(draft: Draft, item: VolumeObject) -> tuple[Array, Array]:
    """Extinction (nx, ny, nz) and albedo (nx, ny, nz, 3) at the voxels."""
    transfer = item.transfer
    data = np.asarray(item.data, dtype=np.float64)
    total, colored = np.zeros(data.shape), np.zeros((*data.shape, 3))
    draft.note(item.name, "the transfer function is applied at the voxels and interpolated; ours is applied in between")
    if transfer.has_emission or any(not material.lit for material in transfer.materials):
        draft.note(item.name, "light that the volume itself emits has no counterpart in Mitsuba and is left out")
    if transfer.uses_gradient:
        draft.note(item.name, "the dependence of its transfer function on the gradient is left out")
    for material in transfer.materials:
        extinction = interpolate(data, material.values, material.extinction)
        total += extinction
        if material.lit:
            color = _rgb(transfer, material)
            colored += extinction[..., None] * np.clip(color, 0.0, 1.0)
    return total, colored / np.maximum(total, 1e-30)[..., None]


def _rgb(transfer: Any, material: Any) -> Array:
    from spectral_core.render.mitsuba_scene.paint import daylight_rgb
    from spectral_core.spectra.spectrum import SpectralGrid

    if transfer.wavelengths_nm is None:
        return np.asarray(material.color)
    sampled = Spectrum(material.name, SpectralGrid(transfer.wavelengths_nm), material.color)
    return daylight_rgb(sampled)


def _grid(draft: Draft, name: str, use: str, values: Array, box: Array) -> xml.Element:
    path = draft.file("volumes", f"{name}_{use}", ".vol", lambda path: write_grid(path, values))
    children = (xml.string("filename", path), xml.transform("to_world", box), xml.boolean("raw", values.shape[3] == 1))
    return xml.plugin("volume", "gridvolume", *children, name=use)


def write_grid(path: Path, values: Array) -> None:
    """Write numbers (nx, ny, nz, channels) in Mitsuba's format for grids, version 3."""
    nx, ny, nz, channels = values.shape
    header = b"VOL\x03" + struct.pack("<5i6f", 1, nx, ny, nz, channels, 0, 0, 0, 1, 1, 1)
    write_bytes(path, header + np.ascontiguousarray(values.transpose(2, 1, 0, 3), dtype="<f4").tobytes())
