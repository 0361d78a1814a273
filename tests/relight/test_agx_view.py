# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of Blender's view AgX: its axes, the tetrahedra between its nodes, its file, and the page that shows it."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render.relight.agx_view import (
    E_GAMUT_FROM_RGB,
    LOWEST_STOP,
    NODES,
    STEP,
    AgxView,
    node_light,
    view_of_document,
)
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.page import write_page
from spectral_core.render.relight.view_transform import ViewTransform
from tests.relight.comparison import between_corners
from tests.relight.test_page import DRIVE, browse, transport_of


def light_at(places: np.ndarray, view: AgxView) -> np.ndarray:
    """Linear sRGB at positions (..., 3) on the axes of a table, in nodes."""
    return np.exp2(view.lowest + STEP * places) @ np.linalg.inv(E_GAMUT_FROM_RGB).T


def test_light_in_e_gamut_is_that_of_colour_science() -> None:
    colour = pytest.importorskip("colour")
    expected = colour.matrix_RGB_to_RGB("sRGB", "FilmLight E-Gamut", chromatic_adaptation_transform=None)
    np.testing.assert_allclose(E_GAMUT_FROM_RGB, expected, atol=2e-4)
    np.testing.assert_allclose(E_GAMUT_FROM_RGB.sum(axis=1), 1.0, atol=1e-14)  # white stays white


def test_a_color_lies_between_the_corners_of_its_tetrahedron(rng: np.random.Generator) -> None:
    view = AgxView("random", rng.uniform(0, 1, (5, 5, 5, 3)))
    places = rng.uniform(0, 4, (300, 3))
    light = between_corners(view.table, places) ** 2.4
    display = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(view.shown(light_at(places, view)), display, atol=1e-9)


def test_light_beyond_the_axes_is_shown_as_at_their_ends(rng: np.random.Generator) -> None:
    view = AgxView("random", rng.uniform(0, 1, (4, 4, 4, 3)), -3.0)
    beyond = light_at(np.array([[-9.0, 1.0, 19.0], [3.0, 3.0, 3.0]]), view)
    np.testing.assert_allclose(view.shown(beyond), view.shown(light_at(np.array([[0, 1, 3], [3, 3, 3]]), view)))
    assert np.isfinite(view.shown([[0.0, 0.0, 0.0], [-1.0, -2.0, 0.5]])).all()


def test_the_nodes_are_where_blender_has_them() -> None:
    light = node_light() @ E_GAMUT_FROM_RGB.T
    assert light.shape == (NODES, NODES, NODES, 3)
    stops = np.log2(light[[0, 7, -1], 0, 0, 0])
    np.testing.assert_allclose(stops, LOWEST_STOP + np.array([0, 7, NODES - 1]) * 25 / 56, atol=1e-9)


def test_a_view_is_read_as_it_was_written(rng: np.random.Generator) -> None:
    view = AgxView("AgX", rng.uniform(-0.2, 1.2, (3, 3, 3, 3)), -13.25)
    back = view_of_document(json.loads(json.dumps(view.document())))
    assert isinstance(back, AgxView) and (back.name, back.lowest) == ("AgX", -13.25)
    np.testing.assert_allclose(back.table, np.clip(view.table, 0, 1), atol=0.5 / 65535 + 1e-12)
    plain = ViewTransform("plain", view.table)
    assert isinstance(view_of_document(plain.document()), ViewTransform)
    with pytest.raises(InvalidInputError, match="of 4 nodes has 81 values; expected 192"):
        AgxView.of_document({**view.document(), "nodes": 4})
    with pytest.raises(InvalidInputError, match="has 1 nodes per axis"):
        AgxView("one", np.zeros((1, 1, 1, 3)))
    with pytest.raises(InvalidInputError, match="the lowest stop"):
        AgxView("nowhere", view.table, float("nan"))


def test_the_page_shows_light_through_agx_as_the_library_does(tmp_path: Path, rng: np.random.Generator) -> None:
    view = AgxView("random", rng.uniform(0, 1, (6, 6, 6, 3)), -3.0)
    transport = replace(transport_of(np.exp2(rng.uniform(-5, 2, (2, 3, 6, 8))) - 0.05), view=view)
    page = tmp_path / "dial.html"
    write_page(page, transport)
    page.write_text(page.read_text("utf-8").replace("</html>", DRIVE + "</html>"), "utf-8")
    found = re.search(r'<pre id="result">(.*?)</pre>', browse(page), re.DOTALL)
    assert found, "the page's script did not run to its end"
    shown = np.array(json.loads(html.unescape(found[1]))[0]["pixels"]).reshape(6, 8, 3)
    linear = relight(transport)[::-1, :, :3].astype(float)
    assert np.abs(shown - 255 * view.shown(linear)).max() <= 1.5
