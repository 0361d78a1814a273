# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls of the library as a script makes them: paths as text, and objects in place of others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import ROOT
from spectral_core.errors import InvalidInputError
from spectral_core.palette import solve_palette
from spectral_core.render import RenderProcess, cost_curve, everything_on, plan_effects, plan_from_data, render_scene
from spectral_core.render.mitsuba_export import write_mitsuba
from spectral_core.render.relight.mix import LiveMix, relight
from spectral_core.render.relight.storages import storage_named
from spectral_core.render.relight.transport import record_transport
from spectral_core.scene import Color, Diffuse, Material, PointLight
from spectral_core.spectra.pictures import write_picture
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View
from tests.relight.test_page import transport_of
from tests.render.scenes import lit_plane

PIXELS = np.full((3, 5, 3), 0.5, np.float32)
TRANSPORT = transport_of(np.full((2, 3, 4, 5), 0.25))


def test_a_path_in_place_of_a_scene_is_named(tmp_path: Path) -> None:
    """It ended in "'str' object has no attribute 'moments'"."""
    calls = [render_scene, plan_effects, plan_from_data, everything_on, cost_curve, RenderProcess().render]
    for call in [*calls, lambda scene: record_transport(scene, storage_named("dial"))]:
        with pytest.raises(InvalidInputError, match=r"the scene is 'shot\.blend', of type str; expected a Scene"):
            call("shot.blend")
    with pytest.raises(InvalidInputError, match="the scene is 'None', of type NoneType"):
        write_mitsuba(None, tmp_path / "export")  # type: ignore[arg-type]


def test_a_name_in_place_of_a_storage_says_how_to_get_one() -> None:
    with pytest.raises(InvalidInputError, match=r"of type str; expected a Storage \(.*storage_named\('bands31'\)\)"):
        record_transport(lit_plane(), "bands31")  # type: ignore[arg-type]


def test_a_name_in_place_of_a_light_or_of_a_transport_is_named() -> None:
    key = TRANSPORT.groups[0]
    with pytest.raises(InvalidInputError, match=r"'HP1', of type str; expected a Spectrum \(.*illuminant"):
        relight(TRANSPORT, lights={key: "HP1"})  # type: ignore[dict-item]
    with pytest.raises(InvalidInputError, match="the mix is .* of type list; expected a Mapping"):
        relight(TRANSPORT, mix=[1.0, 2.0])  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match=f"the intensity of '{key}'"):
        relight(TRANSPORT, mix={key: "bright"})  # type: ignore[dict-item]
    with pytest.raises(InvalidInputError, match="expected a Transport .*read_transport"):
        LiveMix("scene.transport.exr")  # type: ignore[arg-type]


def test_numbers_in_place_of_a_color_or_a_surface_say_what_is_expected() -> None:
    """They were kept, and ended in an AttributeError in the render."""
    red = (0.8, 0.2, 0.2)
    for call in (lambda: Diffuse(red), lambda: PointLight(name="key", world_from_light=np.eye(4), color=red)):
        with pytest.raises(InvalidInputError, match=r"color.* is \(0\.8, 0\.2, 0\.2\), of type tuple; .*such as Color"):
            call()
    for surface in (red, Color(red), "plastic"):
        with pytest.raises(InvalidInputError, match=r"the surface of material 'paint' is .*such as Diffuse\(Color"):
            Material("paint", surface)  # type: ignore[arg-type]


def test_a_path_in_place_of_a_palette_or_a_volume_is_named() -> None:
    with pytest.raises(InvalidInputError, match=r"the palette is 'split\.toml', of type str; .*read_palette"):
        solve_palette("split.toml")  # type: ignore[arg-type]
    for call in (View.around, VolumeRenderer):
        with pytest.raises(InvalidInputError, match=r"the volume is 'engine', of type str; .*read_volume"):
            call("engine")  # type: ignore[arg-type]


def test_paths_may_be_text(tmp_path: Path) -> None:
    pytest.importorskip("OpenEXR")
    from spectral_core.explore.features.picture_files import read_linear
    from spectral_core.explore.sweep.document import read_sweep
    from spectral_core.render.relight.page import write_page
    from spectral_core.render.relight.transport_file import is_transport, read_transport, write_transport

    folder = f"{tmp_path}/ordnér 1"
    write_picture(f"{folder}/picture.exr", PIXELS)
    assert np.array_equal(read_linear(f"{folder}/picture.exr"), PIXELS)
    write_transport(f"{folder}/lights.exr", TRANSPORT)
    assert is_transport(f"{folder}/lights.exr")
    assert read_transport(f"{folder}/lights.exr").groups == TRANSPORT.groups
    write_page(f"{folder}/page.html", TRANSPORT)
    assert len(read_sweep(f"{ROOT}/examples/sweeps/corner.toml").space.parameters) == 4


def test_figures_and_pictures_are_found_by_text(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    pytest.importorskip("mitsuba")
    from spectral_core.explore.page.static import draw_matrix
    from spectral_core.lattice.measure.plotting import draw
    from spectral_core.render.images.pictures import read_picture

    drawn = draw_matrix(f"{tmp_path}/matrix.png", {"a": [1.0, 2.0], "b": [2.0, 3.0]}, ["a", "b"])
    assert drawn.is_file()
    assert draw("spiral", f"{tmp_path}/spiral.png").is_file()  # type: ignore[arg-type]
    write_picture(f"{tmp_path}/picture.png", PIXELS)
    assert read_picture(f"{tmp_path}/picture.png").shape == (3, 5, 3)


def test_a_spectral_texture_is_written_by_text(tmp_path: Path) -> None:
    pytest.importorskip("OpenEXR")
    from spectral_core.palette.texture.file import read_texture, write_texture
    from spectral_core.palette.texture.reach import TEXTURE_GRID
    from spectral_core.palette.texture.texture import SpectralTexture
    from spectral_core.spectra.catalogue import illuminant

    count = len(TEXTURE_GRID.wavelengths_nm)
    lights = (illuminant("D65"), illuminant("HP1"))
    made = SpectralTexture(np.full((2, 3, 4), 0.5, np.float16), np.full((2, count), 0.5), lights)
    assert write_texture(f"{tmp_path}/cloth.exr", made) == tmp_path / "cloth.exr"
    assert np.array_equal(read_texture(f"{tmp_path}/cloth.exr").weights, made.weights)


@pytest.mark.parametrize("ending", ["png", "exr", "npy"])
@pytest.mark.parametrize(
    ("given", "named"),
    [
        (np.full((3, 5), 0.5), r"shape \(3, 5\)"),  # was written as an EXR of 3 × 3 pixels
        (np.full((3, 5, 4), 0.5), r"pixels\[::-1, :, :3\]"),  # lost its alpha, or ended in an error of NumPy
        (np.full((3, 5, 3), 128, np.uint8), "type uint8"),  # bytes are no linear light
        (np.full((3, 5, 3), np.nan), "not finite"),
        (np.zeros((0, 5, 3)), r"shape \(0, 5, 3\)"),
        (np.ma.masked_less(np.full((3, 5, 3), 0.5), 1.0), "masked"),
        (np.full((3, 5, 3), 1j), "complex"),
    ],
)
def test_a_picture_of_another_shape_or_type_is_refused(tmp_path: Path, ending: str, given: Any, named: str) -> None:
    with pytest.raises(InvalidInputError, match=named):
        write_picture(tmp_path / f"picture.{ending}", given)
    assert not list(tmp_path.iterdir())
