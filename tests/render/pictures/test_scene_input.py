# SPDX-License-Identifier: GPL-3.0-or-later
"""Input of scenes: names and numbers that a type does not have are errors; values outside a range are named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.render import Bands, render_scene
from spectral_core.scene import (
    AreaLight,
    Camera,
    Diffuse,
    Emission,
    Film,
    Glass,
    Glossy,
    ImageTexture,
    Mesh,
    Mist,
    Principled,
    Rays,
    RenderSettings,
    SpectralImage,
    SpotLight,
    Subsurface,
    Surface,
    World,
    gray,
    nominal_ior,
)
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum
from tests.render.scenes import lit_plane, matrix

PIXELS = np.ones((2, 2, 3), np.float32)
CORNERS = np.eye(3)
FACE = [[0, 1, 2]]
GRID = SpectralGrid.uniform(400, 700, 50)
WEIGHTS, TWO_NM = np.ones((1, 2, 2)), SpectralGrid(np.array([400.0, 700]))

NAMES: list[tuple[str, Callable[[], Any]]] = [
    ("shape of AreaLight", lambda: AreaLight(name="a", world_from_light=np.eye(4), shape="disk")),  # type: ignore[arg-type]
    ("kind of Camera", lambda: Camera(world_from_camera=np.eye(4), kind="fisheye")),  # type: ignore[arg-type]
    ("sensor fit of Camera", lambda: Camera(world_from_camera=np.eye(4), sensor_fit="w")),  # type: ignore[arg-type]
    ("filter kind of Film", lambda: Film(4, 4, filter_kind="triangle")),  # type: ignore[arg-type]
    ("distribution of Glossy", lambda: Glossy(distribution="phong")),  # type: ignore[arg-type]
    ("model of Subsurface", lambda: Subsurface(model="dipole")),  # type: ignore[arg-type]
    ("subsurface model of Principled", lambda: Principled(subsurface_model="x")),  # type: ignore[arg-type]
    ("color space of ImageTexture", lambda: ImageTexture("i", PIXELS, "aces")),  # type: ignore[arg-type]
    ("extension of ImageTexture", lambda: ImageTexture("i", PIXELS, extension="wrap")),  # type: ignore[arg-type]
    ("interpolation of SpectralImage",
     lambda: SpectralImage("i", WEIGHTS, np.ones((1, 2)), TWO_NM, interpolation="cubic")),  # type: ignore[arg-type]
    ("falloff of Mist", lambda: Mist(falloff="CUBIC")),  # type: ignore[arg-type]
]  # fmt: skip


@pytest.mark.parametrize(("what", "made"), NAMES, ids=[name for name, _ in NAMES])
def test_an_unknown_name_is_an_error_that_lists_the_known_ones(what: str, made: Callable[[], Any]) -> None:
    with pytest.raises(UnknownNameError, match=f"no {what} is named .*; (known: |did you mean)"):
        made()


NUMBERS: list[tuple[str, Callable[[], Any]]] = [
    ("width of Film is '1.5', of type float; expected a whole number", lambda: Film(1.5, 4)),  # type: ignore[arg-type]
    ("samples of Film is '2.5', of type float", lambda: Film(4, 4, samples=2.5)),  # type: ignore[arg-type]
    ("seed of Film is '0.5', of type float", lambda: Film(4, 4, seed=0.5)),  # type: ignore[arg-type]
    ("a number of the crop is 0.5", lambda: Film(4, 4, crop=(0.5, 0, 2, 2))),  # type: ignore[arg-type]
    ("crop .* has 3 numbers", lambda: Film(4, 4, crop=(0, 0, 2))),  # type: ignore[arg-type]
    ("has triangles of type float64; expected whole numbers", lambda: Mesh("m", CORNERS, np.array([[0, 1.5, 2]]))),
    ("has -1 among its triangles", lambda: Mesh("m", CORNERS, np.array([[0, -1, 2]]))),
    ("has 65536 among its material_indices",
     lambda: Mesh("m", CORNERS, np.array(FACE), material_indices=np.array([65536]))),
    ("has -1 among its material_indices", lambda: Mesh("m", CORNERS, np.array(FACE), material_indices=np.array([-1]))),
    ("Subsurface radius holds 1 value", lambda: Subsurface(radius=(1.0, np.nan, 1.0))),
    ("Principled subsurface radius has shape", lambda: Principled(subsurface_radius=(1.0, 1.0))),  # type: ignore[arg-type]
    ("Glass ior is 0.0", lambda: Glass(ior=Spectrum("n", GRID, np.zeros(7)))),
    ("tolerance_delta_e is nan", lambda: RenderSettings(tolerance_delta_e=float("nan"))),
]  # fmt: skip


@pytest.mark.parametrize(("message", "made"), NUMBERS, ids=[message for message, _ in NUMBERS])
def test_a_number_that_a_type_does_not_have_is_an_error(message: str, made: Callable[[], Any]) -> None:
    with pytest.raises(InvalidInputError, match=message):
        made()


def test_whole_numbers_of_any_type_are_kept() -> None:
    film = Film(np.int64(4), 4.0, samples=np.uint8(3), crop=(0, 0, np.int32(2), 2))  # type: ignore[arg-type]
    assert (film.width, film.height, film.samples, film.crop) == (4, 4, 3, (0, 0, 2, 2))
    assert all(type(value) is int for value in (film.width, film.height, film.samples, *film.crop))
    mesh = Mesh("m", CORNERS, np.array(FACE, np.int64), material_indices=np.array([65535]))
    assert mesh.triangles.dtype == np.uint32 and mesh.material_indices is not None
    assert Mesh("none", np.zeros((0, 3)), np.zeros((0, 3))).triangles.shape == (0, 3)


def _shown(surface: Surface, transport: str) -> Any:
    scene = lit_plane(surface=surface, film=Film(4, 4, samples=64), world=World(gray(1.0)), transport=transport)
    return render_scene(scene)


def test_a_reflectance_below_0_is_rendered_black_with_a_note() -> None:
    pytest.importorskip("mitsuba")
    made = _shown(Diffuse(Spectrum("anti", GRID, np.full(7, -0.5))), "spectral")
    assert made.pixels[..., :3].max() == 0 == made.pixels[..., :3].min()
    assert "outside 0 to 1 at some wavelengths" in made.notes[0].message


def test_a_bright_reflectance_is_equal_in_rgb_and_in_spectral_transport() -> None:
    """As in Cycles, Diffuse returns more than it receives if its color says so."""
    pytest.importorskip("mitsuba")
    surface = Diffuse(Spectrum("bright", SpectralGrid.uniform(360, 830, 47), np.full(11, 1.5)))
    rgb, spectral = (_shown(surface, transport).pixels[..., :3].mean() for transport in ("rgb", "spectral"))
    assert rgb == pytest.approx(1.5, rel=0.01) == spectral


def test_an_index_holds_beyond_its_wavelengths() -> None:
    """Glass whose index was measured from 500 to 600 nm is not green."""
    pytest.importorskip("mitsuba")
    narrow = Spectrum("n", SpectralGrid.uniform(500, 580, 10), np.full(9, 1.5))
    assert nominal_ior(narrow) == 1.5
    settings = RenderSettings(transport="spectral", overrides=(("dispersion", "on"),))
    pictures = []
    for index in (narrow, Spectrum("n", SpectralGrid.uniform(300, 900, 50), np.full(13, 1.5))):
        world = World(gray(1.0), hidden_from=Rays.GLOSSY)
        scene = lit_plane(surface=Glass(ior=index), world=world, film=Film(4, 4, samples=64), settings=settings)
        pictures.append(render_scene(scene).pixels)
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-3)


def test_cubic_interpolation_of_an_image_is_no_nearest_pixel() -> None:
    pytest.importorskip("mitsuba")
    pixels = np.zeros((4, 4, 3), np.float32)
    pixels[::2] = 1
    camera = Camera(world_from_camera=matrix((0, 0, 10)), kind="orthographic", orthographic_scale=100.0)
    made = {}
    for name in ("linear", "cubic"):
        surface = Emission(ImageTexture("rows", pixels, "linear", interpolation=name))  # type: ignore[arg-type]
        made[name] = render_scene(lit_plane(surface=surface, camera=camera, film=Film(8, 8, samples=16)))
    np.testing.assert_allclose(made["cubic"].pixels, made["linear"].pixels, atol=1e-5)
    assert any("cubic interpolation, which is rendered as linear" in note.message for note in made["cubic"].notes)


@pytest.mark.parametrize(
    ("make", "values", "text"),
    [
        (SpotLight, {"cone_angle_rad": 3.2}, "cone_angle_rad is 3.2"),
        (SpotLight, {"cone_scale": (1.0, 1.0)}, "expected 3 numbers"),
        (AreaLight, {"size": (1.0,)}, "expected 2 numbers"),
        (AreaLight, {"spread_rad": 4.0}, "spread_rad is 4.0"),
    ],
)
def test_numbers_of_lamps_that_no_lamp_has_are_refused(make, values, text) -> None:
    with pytest.raises(InvalidInputError, match=text):
        make(name="a", world_from_light=np.eye(4), **values)
    make(
        name="a",
        world_from_light=np.eye(4),
        **({"cone_angle_rad": float(np.float32(np.pi))} if make is SpotLight else {}),
    )


def test_a_count_of_bands_is_whole() -> None:
    with pytest.raises(InvalidInputError, match="whole number"):
        Bands.uniform(count=4.5)  # type: ignore[arg-type]
