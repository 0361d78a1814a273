# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawings over an editor are painted once; whatever they show, a change of it paints them again."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.drawing import dial, dial_labels, kept, overlay
from blender_addon.drawing.kept import MOST, Box, Kept
from blender_addon.translate.spectra.stored import store_spectrum
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid

BOX = Box(10, 20, 100, 50)


@pytest.fixture
def shown(monkeypatch: Any) -> list[Any]:
    """Drawings that were put on screen, without a graphics card."""
    found: list[Any] = []

    def painted(box: Box, paint: Any) -> tuple[Any, Any]:
        paint()
        return object(), box

    monkeypatch.setattr(kept, "_painted", painted)
    monkeypatch.setattr(kept, "_show", lambda picture, box: found.append((picture, box)))
    return found


def test_a_drawing_is_painted_once_for_each_content_and_box(shown: list[Any]) -> None:
    drawings, paints = Kept(), []
    for content, box in (("a", BOX), ("a", BOX), ("b", BOX), ("a", BOX), ("a", Box(0, 0, 100, 50))):
        drawings.draw(content, box, lambda: paints.append(1))
    assert len(paints) == 3
    assert len(shown) == 5
    assert shown[0] == shown[1] == shown[3] != shown[2]


def test_old_drawings_are_dropped(shown: list[Any]) -> None:
    drawings, paints = Kept(), []
    for number in (*range(MOST + 1), 1, 0):
        drawings.draw(number, BOX, lambda number=number: paints.append(number))
    assert paints == [*range(MOST + 1), 0]
    assert len(shown) == MOST + 3


def test_without_room_on_the_graphics_card_it_is_painted_each_time(shown: list[Any], monkeypatch: Any) -> None:
    monkeypatch.setattr(kept, "_painted", lambda box, paint: None)
    drawings, paints = Kept(), []
    for _ in range(2):
        drawings.draw("a", BOX, lambda: paints.append(1))
    assert (len(paints), shown) == (2, [])


def test_boxes_stay_in_the_region() -> None:
    assert Box.around([(5.2, 7.9), (30.1, 9.0)], 2.0, (100, 100)) == Box(3, 5, 30, 6)
    assert Box.around([(-50.0, 90.0), (500.0, 300.0)], 2.0, (100, 95)) == Box(0, 88, 100, 7)
    assert Box.around([(-50.0, -50.0), (-40.0, -40.0)], 2.0, (100, 95)).width == 0


def contents(drawing: Any, monkeypatch: Any, scene: Any) -> Any:
    """A function that draws and gives the content of the drawing."""
    region = SimpleNamespace(type="WINDOW", x=0, y=0, width=800, height=600, as_pointer=lambda: 5)
    area = SimpleNamespace(type="VIEW_3D", regions=[region])
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    context = SimpleNamespace(scene=scene, area=area, region=region, preferences=preferences)
    monkeypatch.setattr(drawing, "bpy", SimpleNamespace(context=context))
    found: list[Any] = []
    monkeypatch.setattr(drawing.KEPT, "draw", lambda content, box, paint: found.append((content, box)))

    def draw() -> Any:
        drawing.draw()
        return found[-1]

    return draw


def test_each_number_of_the_dial_paints_it_again(blender: Any, monkeypatch: Any) -> None:
    scene = blender.context.scene
    for name, place in (("Key", (0.0, 1.0)), ("Fill", (1.0, -0.5))):
        bulb = scene.spectral.dial.bulbs.add()
        bulb.name, bulb.place = name, place
    scene.spectral.dial.show = True
    draw = contents(dial, monkeypatch, scene)
    monkeypatch.setitem(dial.hovered, "region", 5)
    bulbs, before = scene.spectral.dial.bulbs, draw()
    assert draw() == before
    changes = [
        lambda: setattr(scene.spectral.dial, "selector", (0.3, 0.2)),
        lambda: setattr(scene.spectral.dial, "intensity", 3.0),
        lambda: setattr(bulbs[0], "name", "Sun"),
        lambda: setattr(bulbs[0], "place", (0.2, 1.0)),
        lambda: setattr(bulbs[1], "color", (1.0, 0.5, 0.2)),
        lambda: setattr(bulbs[1], "is_on", False),
        lambda: setattr(bulbs[0], "is_on", False),
        lambda: monkeypatch.setitem(dial.hovered, "region", 0),
    ]
    for number, change in enumerate(changes[:-1]):
        change()
        assert draw() != before, number
        before = draw()
    bulbs[0].is_on = True
    before = draw()
    changes[-1]()
    assert draw() != before


def test_each_curve_paints_the_plots_again(blender: Any, monkeypatch: Any) -> None:
    scene = blender.context.scene
    palette = scene.spectral.palette
    for side in ("LIGHT", "MATERIAL", "MATERIAL"):
        blender.ops.spectral.palette_add(side=side)
    palette.show_curves = True
    row = palette.materials[0]

    def reflect(value: float, end: float = 700.0) -> None:
        store_spectrum(row.result, Reflectance("paper", SpectralGrid(np.linspace(400, end, 31)), np.full(31, value)))

    reflect(0.5)
    draw = contents(overlay, monkeypatch, scene)
    before = draw()
    assert draw() == before
    for change in (
        lambda: reflect(0.6),
        lambda: reflect(0.6, 690.0),
        lambda: setattr(row, "name", "Linen"),
        lambda: setattr(palette, "active_row", 0 if palette.active_row else 1),
    ):
        change()
        assert draw() != before
        before = draw()


def test_names_beside_the_dial_stay_in_the_editor(blender: Any) -> None:
    bulbs = blender.context.scene.spectral.dial.bulbs
    for number in range(8):
        bulb = bulbs.add()
        bulb.name, bulb.place = f"A long name of a lamp by the window {number}", (-1.0, 0.1 * number)
    shape = dial.DialShape.in_region(800, 600, left=50.0)
    assert shape.left == pytest.approx(50.0)
    labels = dial_labels.labels_of(shape, blender.context.scene.spectral.dial, np.full(8, 1 / 8))
    assert min(x for _, x, _ in labels) >= 50.0


@pytest.mark.parametrize("count", [4, 9])
@pytest.mark.parametrize("sidebar", [0, 60])
def test_names_beside_the_dial_end_before_the_sidebar(
    blender: Any, monkeypatch: Any, count: int, sidebar: int
) -> None:  # fmt: skip
    """In a narrow editor the names at the right were cut off at its end, or lay below the sidebar."""
    region = SimpleNamespace(width=300, height=500, x=0, y=0, type="WINDOW", alignment="NONE")
    bar = SimpleNamespace(width=sidebar, height=500, x=300 - sidebar, y=0, type="UI", alignment="RIGHT")
    area = SimpleNamespace(regions=[region, bar])
    monkeypatch.setattr("blf.dimensions", lambda _, text: (7.0 * len(text), 11.0))
    dial_ = blender.context.scene.spectral.dial
    dial_.bulbs.clear()
    for number, angle in enumerate(np.linspace(-1.3, 1.3, count)):
        bulb = dial_.bulbs.add()
        bulb.name, bulb.place = f"Softbox number {number}", (np.cos(angle), np.sin(angle))
    labels = dial_labels.labels_of(dial_labels.dial_beside(area, region, 1.0), dial_, np.full(count, 1 / count))
    shown = [(text, x) for text, x, _ in labels if text]
    assert len(shown) >= 2
    assert max(x + 7.0 * len(text) for text, x in shown) <= 300 - sidebar
    assert min(x for _, x in shown) >= 0


def test_plates_of_few_long_names_lie_beside_each_other(blender: Any, monkeypatch: Any) -> None:
    """The plate of one name lay over the letters of the next; turning the dial moves no text."""
    monkeypatch.setattr("blf.dimensions", lambda _, text: (7.0 * len(text), 11.0))
    dial_ = blender.context.scene.spectral.dial
    dial_.bulbs.clear()
    names = ("Fill", "Key", "Lamp", "Rim light behind the sofa", "Softbox by the window")
    for name, angle in zip(names, np.pi / 2 - 2 * np.pi * np.arange(5) / 5, strict=True):
        bulb = dial_.bulbs.add()
        bulb.name, bulb.place = name, (np.cos(angle), np.sin(angle))
    shape = dial.DialShape.in_region(1200, 900, left=60.0)
    starts = []
    for shares in ([0.2] * 5, [0.02, 0.04, 0.08, 0.82, 0.04]):
        labels = dial_labels.labels_of(shape, dial_, np.array(shares))
        assert all(text for text, _, _ in labels)
        starts.append([x for _, x, _ in labels])
        plates = [(x - 4, y - 4, x + 7 * len(text) + 4, y + 15) for text, x, y in labels]
        for one, other in combinations(plates, 2):
            assert one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]
    assert np.abs(np.subtract(*starts)).max() <= 7.0 * 2  # a text ends at its bulb, or begins there


@pytest.mark.parametrize("count", [3, 8])
def test_the_plots_begin_beyond_the_names_at_the_right_of_the_dial(
    blender: Any, monkeypatch: Any, count: int
) -> None:  # fmt: skip
    """They began at the end of the dial, and the names at the right lay over them."""
    region = SimpleNamespace(width=1200, height=700, x=0, y=0, type="WINDOW", alignment="NONE")
    area = SimpleNamespace(regions=[region])
    monkeypatch.setattr("blf.dimensions", lambda _, text: (7.0 * len(text), 11.0))
    dial_ = blender.context.scene.spectral.dial
    dial_.bulbs.clear()
    for number in range(count):
        bulb = dial_.bulbs.add()
        bulb.name, bulb.place = f"A lamp by the window {number}", (1.0, 0.9 - 0.6 * number / count)
    shape = dial_labels.dial_beside(area, region, 1.0)
    labels = dial_labels.labels_of(shape, dial_, dial_labels.shares_of(dial_))
    drawn = max(x + 7.0 * len(text) for text, x, _ in labels if text)
    assert drawn > shape.right
    assert dial_labels.right_end(area, region, dial_, 1.0) >= drawn
