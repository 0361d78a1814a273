# SPDX-License-Identifier: GPL-3.0-or-later
"""View transforms, the page's data and the dial against formulas written here."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render.relight import page as page_module
from spectral_core.render.relight.dial import bulbs_on_polygon, dial_weights
from spectral_core.render.relight.mix import LiveMix, amounts_of, relight
from spectral_core.render.relight.page import write_page
from spectral_core.render.relight.view_transform import ViewTransform, nodes, positions
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from tests.relight.comparison import between_corners
from tests.relight.test_page import transport_of


def test_the_axes_of_a_table_are_logarithmic_from_black_to_64() -> None:
    light = np.array([0.0, 1 / 1024, 0.18, 1.0, 16.0, 64.0])
    np.testing.assert_allclose(positions(light), 32 * np.log1p(1024 * light) / np.log(65537), rtol=1e-14)
    np.testing.assert_array_equal(positions([-1.0, 64.0, 1e9]), [0.0, 32.0, 32.0])
    assert len(nodes()) == 33
    np.testing.assert_allclose(nodes(5), np.expm1(np.arange(5) / 4 * np.log(65537)) / 1024, rtol=1e-12)
    assert nodes(5)[0] == 0.0 and nodes(5)[-1] == pytest.approx(64.0)


def test_light_below_0_has_nodes_a_stop_apart(rng: np.random.Generator) -> None:
    """Colors outside of sRGB, as those of lasers, are below 0 in a channel; the page showed them as 0."""
    light = nodes(5, 3)
    np.testing.assert_allclose(light[:4], [-7 / 1024, -3 / 1024, -1 / 1024, 0.0], atol=1e-12)
    np.testing.assert_allclose(positions([*light, -1.0], 5, 3), [*range(8), 0], atol=1e-12)
    view = ViewTransform("below", rng.uniform(0, 1, (8, 8, 8, 3)), 3)
    np.testing.assert_allclose(view.shown([light[1], light[3], light[6]]), view.table[1, 3, 6], atol=1e-9)
    back = ViewTransform.of_document(view.document())
    assert back.below == 3
    old = {name: value for name, value in view.document().items() if name != "below"}
    assert ViewTransform.of_document(old).below == 0
    with pytest.raises(InvalidInputError, match="has 1 node per axis from 0 on"):
        ViewTransform("few", np.zeros((4, 4, 4, 3)), 3)


@pytest.mark.parametrize("size", [2, 3, 7])
def test_a_table_is_tetrahedral_between_its_nodes(size: int, rng: np.random.Generator) -> None:
    """At the nodes and between them, and beyond both ends; gray does not depend on nodes that are not gray."""
    view = ViewTransform("random", rng.uniform(0, 1, (size, size, size, 3)))
    places = np.concatenate([rng.uniform(0, 1, (200, 3)), rng.choice(np.linspace(0, 1, size), (50, 3))])
    light = np.expm1(places * np.log(65537)) / 1024
    np.testing.assert_allclose(view.shown(light), between_corners(view.table, (size - 1) * places), atol=1e-9)
    np.testing.assert_allclose(view.shown([[-1.0, 0.0, 200.0]]), [view.table[0, 0, -1]], atol=1e-12)
    colored = np.array(view.table)
    colored[np.ptp(np.indices((size, size, size)), axis=0) > 0] = 0.5
    gray = np.repeat(rng.uniform(0, 64, (20, 1)), 3, axis=1)
    np.testing.assert_allclose(ViewTransform("gray", colored).shown(gray), view.shown(gray), atol=1e-9)


def test_exposure_moves_light_along_the_axes(rng: np.random.Generator) -> None:
    """The brightest light that a view tells apart is at a node at any exposure."""
    table = rng.uniform(0, 1, (5, 5, 5, 3))
    light = rng.uniform(0, 9, (40, 3))
    brighter = ViewTransform("brighter", table, 1, 1.5)
    np.testing.assert_allclose(brighter.shown(light), ViewTransform("plain", table, 1).shown(light * 2**1.5))
    assert ViewTransform.of_document(brighter.document()).exposure == 1.5
    assert "exposure" not in ViewTransform("plain", table).document()
    with pytest.raises(InvalidInputError, match="the exposure of a view"):
        ViewTransform("endless", table, 1, float("inf"))


def test_tables_are_clipped_and_written_in_16_bits(rng: np.random.Generator) -> None:
    table = rng.uniform(-0.5, 1.5, (3, 3, 3, 3))
    view = ViewTransform("v", table)
    np.testing.assert_array_equal(view.table, np.clip(table, 0, 1))
    document = view.document()
    assert document["size"] == 3 and document["name"] == "v"
    levels = np.frombuffer(base64.b64decode(document["table"]), "<u2")
    np.testing.assert_array_equal(levels, np.round(65535 * view.table).astype(int).ravel())
    back = ViewTransform.of_document(document)
    np.testing.assert_allclose(back.table, view.table, atol=0.5 / 65535 + 1e-12)
    assert back.table.max() <= 1.0
    for size in (2, 128):
        whole = {"name": "v", "size": size, "table": base64.b64encode(b"\0" * (6 * size**3)).decode()}
        assert ViewTransform.of_document(whole).table.shape == (size, size, size, 3)
    for size in (1, 129):
        wrong = {"name": "v", "size": size, "table": base64.b64encode(b"\0" * (6 * size**3)).decode()}
        with pytest.raises(InvalidInputError, match=f"a view transform of {size} nodes"):
            ViewTransform.of_document(wrong)
    with pytest.raises(InvalidInputError, match="expected 0×0×0×3"):
        ViewTransform("none", np.zeros(()))


def page_data(path: Path) -> dict:
    found = re.search(r'(\{"width".*?"half": "[^"]*"\})', path.read_text("utf-8"), re.DOTALL)
    assert found
    return json.loads(found[1])


def test_a_page_holds_layers_bulbs_and_the_colors_of_its_lamps(tmp_path: Path, rng: np.random.Generator) -> None:
    transport = transport_of(rng.uniform(0, 2, (3, 3, 4, 6)))
    red = Illuminant("red", SpectralGrid([620.0, 630.0, 640.0]), [0.0, 1.0, 0.0])
    dark = Illuminant("dark", SpectralGrid([400.0, 500.0]), [0.0, 0.0])
    transport = replace(transport, lights=(red, None, dark), groups=("a", "", "c"))
    write_page(tmp_path / "p.html", transport, mix={"a": 0.5}, bulbs=[[0, 1], [1, 0], [0.5, -0.5]])
    data = page_data(tmp_path / "p.html")
    assert (data["width"], data["height"]) == (6, 4)
    assert data["groups"] == ["a", "ungrouped", "c"]
    assert data["bulbs"] == [[0, 1], [1, 0], [0.5, -0.5]] and data["selector"] == [0.0, 0.0]
    # a deep red keeps its hue at the largest brightness; unknown and dark lamps are white
    assert data["colors"][0][0] == 1.0 and max(data["colors"][0][1:]) < 0.2
    assert data["colors"][1] == data["colors"][2] == [1.0, 1.0, 1.0]
    layers = np.frombuffer(base64.b64decode(data["half"]), np.float16).reshape(3, 4, 6, 3).astype(float)
    expected = transport.channels.transpose(0, 2, 3, 1) * np.array([0.5, 1.0, 1.0])[:, None, None, None]
    np.testing.assert_allclose(layers, expected, rtol=1e-3)
    write_page(tmp_path / "q.html", transport)
    np.testing.assert_allclose(page_data(tmp_path / "q.html")["bulbs"], bulbs_on_polygon(3), atol=1e-15)


def test_a_page_is_refused_by_its_size_in_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two bytes for each number, a third more in base 64."""
    assert page_module.MOST_BYTES == 200e6
    transport = transport_of(np.ones((2, 3, 4, 6)))
    size = 2 * 4 * 6 * 3 * 2 * 4 / 3
    monkeypatch.setattr(page_module, "MOST_BYTES", size)
    write_page(tmp_path / "p.html", transport)
    monkeypatch.setattr(page_module, "MOST_BYTES", size - 1)
    with pytest.raises(InvalidInputError, match="the page would take 0 MB"):
        write_page(tmp_path / "p.html", transport)
    monkeypatch.undo()
    write_page(tmp_path / "p.html", transport_of(np.full((2, 3, 1, 1), 65504.0)))
    with pytest.raises(InvalidInputError, match="1 value is over 65504"):
        write_page(tmp_path / "p.html", transport_of(np.array([65504.0, 65536.0, 1, 1, 1, 1]).reshape(2, 3, 1, 1)))


def test_a_mix_is_the_weighted_sum_of_its_groups(rng: np.random.Generator) -> None:
    layers = rng.uniform(0, 2, (3, 3, 4, 6)).astype(np.float32)
    coverage = rng.uniform(0, 1, (4, 6)).astype(np.float32)
    transport = replace(transport_of(layers), exposure=2.5, coverage=coverage)
    np.testing.assert_array_equal(amounts_of(transport, None), [1.0, 1.0, 1.0])
    np.testing.assert_array_equal(amounts_of(transport, {"light 1": 0.25}), [1.0, 0.25, 1.0])
    for mix in ({}, {"light 0": 0.0}, {"light 1": 3.0, "light 2": 0.5}):
        weights = np.array([mix.get(f"light {k}", 1.0) for k in range(3)])
        picture = relight(transport, mix=mix)
        expected = 2.5 * np.einsum("g,gchw->hwc", weights, layers.astype(float))
        np.testing.assert_allclose(picture[..., :3], expected, rtol=1e-5)
        np.testing.assert_array_equal(picture[..., 3], coverage)
    live = LiveMix(transport)
    first = live.picture([0.0, 0.0, 1.0]).copy()
    np.testing.assert_allclose(live.picture([0.0, 0.0, 2.0])[..., :3], 2 * first[..., :3], rtol=1e-6)
    np.testing.assert_array_equal(live.picture([0.0, 0.0, 0.0])[..., :3], 0.0)
    with pytest.raises(InvalidInputError, match="a light cannot absorb light"):
        live.picture([1.0, -1e-9, 1.0])
    assert transport.size == (6, 4)
    with pytest.raises(InvalidInputError, match=r"channels are float64 \(3, 3, 4, 6\); expected float32"):
        replace(transport, channels=layers.astype(np.float64))
    with pytest.raises(InvalidInputError, match=r"expected float32 \(3, 3, 3, 6\)"):
        replace(transport, coverage=coverage[:3])


def test_coincident_bulbs_are_those_nearer_than_a_billionth_of_the_extent() -> None:
    """The extent is that of the bulbs that are on."""
    far = [[0.0, 0.0], [1000.0, 0.0]]
    two = dial_weights([500.0, 300.0], far)
    one_spot = dial_weights([500.0, 300.0], [*far, [0.9e-6, 0.0]])
    np.testing.assert_allclose(one_spot, [two[0] / 2, two[1], two[0] / 2], rtol=1e-6)
    separate = dial_weights([500.0, 300.0], [*far, [1.1e-6, 0.0]])
    np.testing.assert_allclose(separate, [0.5, 0.0, 0.5], atol=1e-3)
    switched = dial_weights([0.5, 0.3], [*far, [1.0, 0.0], [1.0, 0.9e-6]], [True, False, True, True])
    apart = dial_weights([0.5, 0.3], [[0.0, 0.0], [1.0, 0.0], [1.0, 0.9e-6]])
    np.testing.assert_allclose(switched[[0, 2, 3]], apart, rtol=1e-9)


def test_dials_of_one_bulb_and_of_64_bulbs() -> None:
    np.testing.assert_array_equal(dial_weights([3.0, 1.0], [[0.0, 0.0]]), [1.0])
    assert bulbs_on_polygon(64).shape == (64, 2) and bulbs_on_polygon(2).shape == (2, 2)
    assert dial_weights([0.1, 0.2], bulbs_on_polygon(64)).sum() == pytest.approx(1.0)
    for count in (1, 65):
        with pytest.raises(InvalidInputError, match=f"got {count}"):
            bulbs_on_polygon(count)
    with pytest.raises(InvalidInputError, match="1 to 64 bulbs; got 0"):
        dial_weights([0.0, 0.0], np.zeros((0, 2)))
    np.testing.assert_array_equal(dial_weights([0.0, 0.0], np.zeros((2, 2))), [0.5, 0.5])


def test_dials_broadcast_over_leading_axes(rng: np.random.Generator) -> None:
    bulbs, selectors = rng.normal(size=(3, 2)), rng.normal(size=(5, 1, 2))
    on = np.array([[True, True, True], [True, False, True]])
    weights = dial_weights(selectors, bulbs, on)
    assert weights.shape == (5, 2, 3)
    for k in range(5):
        for switch in range(2):
            alone = dial_weights(selectors[k, 0], bulbs, on[switch])
            np.testing.assert_allclose(weights[k, switch], alone, rtol=1e-12)


@pytest.mark.parametrize("value", [-70000.0, np.nan, np.inf, -np.inf])
def test_a_page_refuses_numbers_that_it_cannot_hold(tmp_path, value: float) -> None:
    """Only values above its largest number were found: others were infinite or no numbers in the page."""
    with pytest.raises(InvalidInputError, match="below -65504 or no numbers"):
        write_page(tmp_path / "p.html", transport_of(np.array([value, 1, 1, 1, 1, 1]).reshape(2, 3, 1, 1)))
    write_page(tmp_path / "p.html", transport_of(np.full((2, 3, 1, 1), -65504.0)))
