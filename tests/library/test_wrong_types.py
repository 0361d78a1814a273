# SPDX-License-Identifier: GPL-3.0-or-later
# mypy: disable-error-code="arg-type,list-item,dict-item,call-arg,operator"
"""Objects of another type than declared, which were kept in silence or ended in an error of Python or NumPy."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from spectral_core import lattice
from spectral_core.errors import InvalidInputError
from spectral_core.explore.analysis.embedding import cluster, spectral_embedding
from spectral_core.explore.analysis.process import GaussianProcess
from spectral_core.explore.analysis.sensitivity import sobol_indices
from spectral_core.explore.features.compare import distances_to
from spectral_core.light_models import BasisModel, NodeModel, RgbModel, principal_components, sharpened_basis
from spectral_core.palette import Cell, presets
from spectral_core.palette.presets import design_grid
from spectral_core.palette.texture.lights import led, led_range
from spectral_core.palette.texture.project import TextureProject, TextureSettings
from spectral_core.palette.texture.reach import reachable_contrast, reachable_scales
from spectral_core.palette.texture.realism import white_differences
from spectral_core.palette.texture.uplift import design_uplift
from spectral_core.render.variant import choose_backend
from spectral_core.scene import (
    AddSurface,
    AreaLight,
    Camera,
    Diffuse,
    Film,
    Glass,
    LightPaths,
    Material,
    Mesh,
    Mist,
    MixSurface,
    Passes,
    PointLight,
    Principled,
    RenderSettings,
    Scene,
    Subsurface,
    Translucent,
    Transparent,
    World,
    gray,
)
from spectral_core.scene.skies.atmosphere import Atmosphere
from spectral_core.spectra import catalogue, observer
from spectral_core.spectra.color import lab_jacobian_from_linear_rgb
from spectral_core.spectra.files import kind_of, read_spectra, write_spectra
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import SpectralGrid
from spectral_core.spectra.start_lights import sine_light
from spectral_core.volume.analysis import (
    SampledFunction,
    composite_bandlimit,
    energy_beyond,
    sample_composition,
    spectrum_energy,
)
from spectral_core.volume.documents.transfer_document import TransferDocument
from spectral_core.volume.files import read_volume
from spectral_core.volume.files.sequence import find_sequence
from spectral_core.volume.presets import preset
from spectral_core.volume.samples import sample_volume
from spectral_core.volume.transfer import TransferFunction

NAN = float("nan")
EYE = np.eye(4)
CAMERA, FILM = Camera(world_from_camera=EYE), Film(4, 4)
GRID = design_grid(50)
D65 = catalogue.illuminant("D65")
DARK_SKIN = catalogue.reflectance("dark skin")
MODEL = NodeModel.natural(8)
POINTS = np.random.default_rng(3).random((24, 2))
POLYNOMIAL = lattice.make_lattice(2).polynomial
PROBLEM = presets.hidden_mark(grid=GRID)

SCENES: list[tuple[Callable[[], object], str]] = [
    (lambda: Diffuse(roughness="rough"), "roughness of Diffuse is 'rough', of type str; expected a number"),
    (lambda: Principled(alpha=None), "alpha of Principled is 'None'"),
    (lambda: Glass(ior="BK7"), "ior of Glass is 'BK7'.*a number, a Spectrum or a Computed"),
    (lambda: Subsurface(radius=0.1), "radius"),
    (lambda: Transparent("red"), "Transparent color is red.*such as Color"),
    (lambda: Translucent(0.5), "Translucent color is the number 0.5"),
    (lambda: World(color=0.5), r"the color of the world is the number 0\.5.*gray\(0\.5\)"),
    (lambda: World(strength="high"), "strength of World is 'high'"),
    (lambda: MixSurface(0.5, "paint", Diffuse()), "first of MixSurface is 'paint'.*such as a Diffuse"),
    (lambda: AddSurface(Diffuse(), 3), "second of AddSurface is '3'"),
    (lambda: Material("fog", medium="thick"), "medium of Material is 'thick'"),
    (lambda: PointLight(name="key", world_from_light=EYE, power_w=None), "power_w of PointLight is 'None'"),
    (lambda: PointLight(name="key", world_from_light=EYE, max_bounces=2.5), "max_bounces.*a whole number"),
    (lambda: AreaLight(name="key", world_from_light=EYE, size=3), "size of AreaLight is '3'.*a tuple"),
    (lambda: Camera(world_from_camera=EYE, shift=()), "camera shift is ().*two numbers"),
    (lambda: Camera(world_from_camera=EYE, shift=0.1), "shift of Camera is '0.1'"),
    (lambda: Film(4, 4, crop=3), "crop of Film is '3'"),
    (lambda: Film(4, 4, transparent="yes"), "transparent of Film is 'yes'.*True or False"),
    (lambda: RenderSettings(target_error="low"), "target_error of RenderSettings is 'low'"),
    (lambda: RenderSettings(overrides="bounces=4"), "overrides of RenderSettings"),
    (lambda: LightPaths(diffuse=2.5), "diffuse of LightPaths is '2.5'.*a whole number"),
    (lambda: Passes(names="Depth"), "names of Passes is 'Depth'.*a tuple"),
    (lambda: Mist(start="near"), "start of Mist is 'near'"),
    (lambda: Atmosphere(altitude="high"), "altitude of Atmosphere is 'high'"),
    (lambda: Scene(camera=CAMERA, film=FILM, lights=Diffuse()), "lights of Scene"),
    (lambda: Scene(camera=CAMERA, film=FILM, meshes=["cube"]), "meshes of the scene hold 'cube'.*a Mesh"),
    (lambda: Scene(camera=CAMERA, film=FILM, instances=("cube",)), "instances of the scene hold 'cube'"),
]
SPECTRA: list[tuple[Callable[[], object], str]] = [
    (lambda: observer.normalized(D65, "cie_1964_10deg"), "the observer is 'cie_1964_10deg'.*by its name"),
    (lambda: observer.xyz_of("D65"), "a light or surface is 'D65'"),
    (lambda: observer.is_seen("D65"), "the light is 'D65'"),
    (lambda: catalogue.color_matching_functions("cie_1931"), "no observer is named 'cie_1931'; did you mean"),
    (lambda: catalogue.blackbody(3000, "fine"), "the grid is 'fine'"),
    (lambda: SpectralGrid.uniform("400", 700), "start_nm is 400, a text"),
    (lambda: D65.scaled("2"), "the factor is 2, a text"),
    (lambda: D65.resampled([400, 700]), r"the grid is '\[400, 700\]'.*SpectralGrid"),
    (lambda: D65.require_grid("D65"), "the other grid is 'D65'"),
    (lambda: sine_light("62", GRID), "period of a sine light is 62, a text"),
    (lambda: FluorescentDye.gaussian("dye", -1, 530), "the excitation of dye 'dye' is -1"),
    (lambda: FluorescentDye.gaussian("dye", 400, 530, widths_nm=20), "widths_nm is 20"),
    (lambda: kind_of("red"), "the spectrum is 'red'"),
    (lambda: read_spectra(None), "the file is 'None', of type NoneType; expected a path"),
    (lambda: write_spectra(3, [D65]), "the file is '3'.*expected a path"),
    (lambda: read_volume(3), "the file is '3'.*expected a path"),
    (lambda: MODEL.linear_rgb_from_coefficients(None), "the light is 'None'"),
    (lambda: RgbModel(GRID, None), "the reference light is 'None'"),
    (lambda: MODEL.reflect(np.ones((1, 8)), np.ones((8, 1))), r"coefficients has shape \(8, 1\)"),
    (lambda: MODEL.reflect(np.full(8, NAN), np.ones(8)), "coefficients holds 8 value"),
    (lambda: NodeModel.natural("8"), "nodes must be numbers|node wavelengths"),
    (lambda: NodeModel.natural(8, viewer="cie_1964_10deg"), "the observer is 'cie_1964_10deg'"),
    (lambda: NodeModel.scene([DARK_SKIN], GRID, size=2.5), "size is 2.5"),
    (lambda: BasisModel(GRID, principal_components(np.eye(9), 2)).reflect([1.0], [1.0, 2.0]), "coefficients has shape"),
    (lambda: sharpened_basis(np.eye(9)[:, :3], "thirds"), "edges must be numbers"),
]
OTHERS: list[tuple[Callable[[], object], str]] = [
    (lambda: lattice.make_lattice(2, middle=0.5), "middle coefficient C is 0.5; expected a whole number"),
    (lambda: lattice.class_of(2, 2, NAN), "middle coefficient C is nan"),
    (lambda: lattice.class_of(2, 2, index=0.5), "class index is 0.5"),
    (lambda: lattice.are_similar(np.eye(2), np.eye(2), tolerance=NAN), "tolerance is nan"),
    (lambda: lattice.shortest_vectors(np.eye(2), tolerance=NAN), "tolerance is nan"),
    (lambda: lattice.optimize_packing(lattice.class_of(2, 2), starts=2.5), "starts is 2.5"),
    (lambda: lattice.optimize_covering(lattice.class_of(2, 2), steps=NAN), "steps is nan"),
    (lambda: lattice.progressive_fill(lattice.unit_cube(2), 4, lattice="Z2"), "the lattice is 'Z2'"),
    (lambda: lattice.unit_cube(2) & "ball", "the other region is 'ball'"),
    (lambda: lattice.unit_cube(2).contains(["a", "b"]), "points must be real numbers"),
    (lambda: Cell("free", box="wide"), "the box of a cell.*'wide'"),
    (lambda: gray("x"), "x"),
    (lambda: Passes(aovs=("a", "b")), "aovs"),
    (lambda: Mesh("m", "abc", [[0, 1, 2]]), "positions"),
    (lambda: find_sequence(3), "of type int; expected a path"),
    (lambda: choose_backend("text"), "text"),  # was llvm_ad_text
    (lambda: PROBLEM.with_cell(0, Cell.free()), "a cell refers to 0"),
    (lambda: PROBLEM.with_cells([Cell.free()]), "the cells to replace"),
    (lambda: reachable_contrast([None, None]), r"lights\[0\] is None"),  # were counted as lights of equal energy
    (lambda: reachable_scales(np.ones((3, 9)), [1.0, 1.0], 0.05), r"colors has shape \(1, 2\)"),
    (lambda: white_differences(["D65"]), r"lights\[0\] is 'D65'"),
    (lambda: design_uplift("D65"), "a light of the lattice is 'D65'"),
    (lambda: led("red", 20), "the peak of an LED is red"),
    (lambda: led_range(step_nm=0), "step_nm is 0"),
    (lambda: TextureSettings(spectra="six"), "spectra of TextureSettings is 'six'"),
    (lambda: TextureProject(("a.png", "b.png"), settings=None), "settings of TextureProject"),
    (lambda: SampledFunction.of("sin", 0, 1, 8), "the function is 'sin'"),
    (lambda: SampledFunction.of(np.sin, 0, NAN, 8), "the end 'high' of the interval is nan"),
    (lambda: SampledFunction.of(np.sin, 0, 1, 8.5), "count is 8.5"),
    (lambda: spectrum_energy(np.ones(8)), "the function is .*SampledFunction"),
    (lambda: energy_beyond(SampledFunction.of(np.sin, 0, 1, 8), NAN), "angular frequency is nan"),  # was 0.0
    (lambda: composite_bandlimit(np.arange(8.0), "wide"), "samples of g must be real numbers"),
    (lambda: sample_composition(np.sin, np.sin, (0, 1), 5.0, margin=-1), "margin is -1"),
    (lambda: TransferFunction("bone"), "materials are 'bone'|materials are bone"),
    (lambda: preset("wide", sample_volume("engine", 8)).scaled("2"), "the factor is 2, a text"),
    (lambda: TransferDocument("bone.toml"), "transfer of TransferDocument is 'bone.toml'"),
    (lambda: distances_to(POINTS, None), "row is None"),  # was a distance to every row at once
    (lambda: distances_to(POINTS, -1), "row is -1"),
    (lambda: spectral_embedding(POINTS, dimensions=2.5), "dimensions is 2.5"),
    (lambda: spectral_embedding(POINTS, "gaussian", width=-1.0), "width is -1"),
    (lambda: cluster(POINTS, 2.5), "number of clusters is 2.5"),
    (lambda: sobol_indices(POINTS, POINTS[:, 0], ["a"]), r"points has shape \(24, 2\)"),  # was the first one alone
    (lambda: GaussianProcess.fit(POINTS, POINTS[:, 0]).predict([[0.5]]), r"points has shape \(1, 1\)"),
]


@pytest.mark.parametrize(("call", "named"), [*SCENES, *SPECTRA, *OTHERS])
def test_another_type_is_named(call: Callable[[], object], named: str) -> None:
    with pytest.raises(InvalidInputError, match=named):
        call()


def test_numbers_of_numpy_and_lists_have_the_declared_types() -> None:
    assert Diffuse(roughness=np.float32(0.5)).roughness == 0.5
    assert Camera(world_from_camera=EYE, shift=[0.1, np.float64(0.2)]).shift == [0.1, 0.2]
    assert PointLight(name="key", world_from_light=EYE, max_bounces=8.0).max_bounces == 8


def test_nan_stays_nan_in_the_slopes_of_cielab() -> None:
    """They were those of black."""
    assert np.isnan(lab_jacobian_from_linear_rgb([NAN, 0.5, 0.5])).any()


def test_plain_imports_stand_at_the_top_of_a_file() -> None:
    """Within a function they say that the module takes long to import, or that files import each other."""
    root = Path(__file__).parents[2]
    light = r" +(?:from|import) (?:dataclasses|json|spectral_core\.checks|spectral_core\.errors)\b"

    found = [
        f"{path.relative_to(root)}: {line.strip()}"
        for folder in ("spectral_core", "blender_addon")
        for path in sorted((root / folder).rglob("*.py"))
        for line in path.read_text("utf-8").splitlines()
        if re.match(light, line)
    ]
    assert found == []
