# SPDX-License-Identifier: GPL-3.0-or-later
# mypy: disable-error-code="arg-type"
"""Arrays and other objects in place of a choice, a part or numbers: the error of this project, at construction."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable
from dataclasses import is_dataclass, replace
from typing import Any

import numpy as np
import pytest

import spectral_core
from spectral_core.checks import _choices
from spectral_core.errors import InvalidInputError
from spectral_core.explore.board.binding import Control
from spectral_core.explore.board.recording import Recording
from spectral_core.explore.sweep.designs import Design
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.lattice.classes import LatticeClass
from spectral_core.palette import presets
from spectral_core.palette.problem import PaletteLight, PaletteProblem
from spectral_core.palette.recipe.material import Colorants
from spectral_core.palette.texture.texture import Picture, SpectralTexture
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.transport import Transport
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import Fluorescent, ImageTexture, Mesh, RenderSettings, SpectralImage, VolumeObject
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.files.columns import ReadOptions
from spectral_core.spectra.files.spdx import SpdxDocument
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import SpectralGrid
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.presets import preset
from spectral_core.volume.samples import sample_volume

GRID, D65 = presets.design_grid(50), illuminant("D65")
SEVERAL = np.zeros(3)
RAGGED = [[1], [1, 2]]
PIXELS = np.zeros((1, 31, 2, 2), np.float32)

CHOICES: dict[type, Callable[[Any], object]] = {
    BandStorage: BandStorage,
    Colorants: lambda given: Colorants(given, ("a",), GRID, np.full((1, GRID.size), 0.5)),
    Control: Control,
    Design: Design,
    Parameter: lambda given: Parameter("a", scale=given),
    PaletteProblem: lambda given: replace(presets.metamer_pair(), match=given),
    PaletteLight: lambda given: PaletteLight(D65, free=given, luminance=1.0),
    ReadOptions: ReadOptions,
    RenderSettings: RenderSettings,
    SpdxDocument: lambda given: SpdxDocument(D65, given),
    SpectralGrid: lambda given: SpectralGrid([400.0, 500.0], given),
    Stepping: Stepping,
}
"""Construction of a class with an array in place of a choice; NumPy compared it with each choice by its elements."""


@pytest.mark.parametrize("kind", CHOICES, ids=lambda kind: kind.__name__)
def test_an_array_is_no_choice(kind: type) -> None:
    with pytest.raises(InvalidInputError):
        CHOICES[kind](SEVERAL)


def test_every_class_with_choices_checks_them() -> None:
    unchecked = []
    for module in pkgutil.walk_packages(spectral_core.__path__, "spectral_core."):
        if ".mitsuba" in module.name or module.name.endswith(("__main__", ".volume_frames")):
            continue
        for kind in vars(importlib.import_module(module.name)).values():
            if not (isinstance(kind, type) and is_dataclass(kind) and kind.__module__ == module.name):
                continue
            checks = [vars(each)["__post_init__"] for each in kind.__mro__ if "__post_init__" in vars(each)]
            source = "".join(map(inspect.getsource, checks))
            if checks and kind not in CHOICES and "require_choices" not in source and "require_declared" not in source:
                unchecked += [f"{kind.__qualname__}.{name}" for name in _choices(kind)]
    assert unchecked == [], "call require_choices or require_declared"


def transport(**given: Any) -> Transport:
    known = {"storage": BandStorage(31), "groups": ("",), "channels": PIXELS, "coverage": PIXELS[0, 0]}
    return Transport(**(known | given), lights=(None,), exposure=1.0, scene_hash="", samples=1, seed=0)


@pytest.mark.parametrize(
    "call",
    [
        lambda: Space(None),
        lambda: Space("abc"),
        lambda: Space(["size"]),
        lambda: Control("cc", "1", "7"),
        lambda: Control("cc", 2.5, "7"),  # was written as cc:2.5:7, which no reader takes
        lambda: Recording(None, [0.0], [[0.0]]),
        lambda: LatticeClass("A2"),
        lambda: ExactStorage(None),
        lambda: transport(storage=None),
        lambda: transport(groups=None),
        lambda: transport(channels=PIXELS.tolist()),
        lambda: transport(coverage=None),
        lambda: Bands(None, np.zeros((1, 471))),
        lambda: Fluorescent(dyes=("D65",), amounts=(1.0,)),
        lambda: Fluorescent(dyes=(FluorescentDye.gaussian("red", 500.0, 600.0),), amounts=("1",)),
        lambda: SpdxDocument(D65, "flux", header=None),
        lambda: Mesh("a", np.zeros((3, 3)), RAGGED),
        lambda: ImageTexture("a", RAGGED),
        lambda: Picture("a", RAGGED),
        lambda: SpectralTexture("text", np.ones((1, 471)), (D65,)),
        lambda: SpectralImage("a", {"K": 1}, np.ones((1, GRID.size)), GRID),
        lambda: VolumeObject("a", RAGGED, np.eye(4), None),
        lambda: ScalarVolume("a", RAGGED),
    ],
)
def test_parts_and_numbers_of_another_type(call: Callable[[], object]) -> None:
    with pytest.raises(InvalidInputError):
        call()


def test_objects_of_a_scene_take_lists() -> None:
    transfer = preset("wide", sample_volume("engine", 4))
    volume = VolumeObject("a", np.arange(8.0).reshape(2, 2, 2).tolist(), np.eye(4), transfer)
    assert isinstance(volume.data, np.ndarray), "the renderer asks for the size of the data"
    assert Space([Parameter("a")]).parameters == (Parameter("a"),)
