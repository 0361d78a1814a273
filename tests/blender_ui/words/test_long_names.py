# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of lights and materials: told apart where there is little room, one for each, and followed when they change."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.drawing.text import text_width, told_apart  # noqa: E402
from blender_addon.panels.parts import column_room, names_in  # noqa: E402

WALLS = [f"Wall paint of the left corridor {number}" for number in range(1, 41)]


class Texts:
    """A layout that keeps the texts that are drawn."""

    def __init__(self) -> None:
        self.found: list[str] = []
        self.translated: set[str] = set()

    def _text(self, *_arguments: Any, text: str = "", translate: bool = True, **_options: Any) -> Any:
        self.found.append(text)
        if translate:
            self.translated.add(text)
        return SimpleNamespace()

    label = operator = prop = _text

    def __getattr__(self, _name: str) -> Any:
        return lambda *_arguments, **_options: self


@pytest.fixture
def large(blender):
    """A table of 12 lights and 40 materials in a sidebar of common width."""
    palette = bpy.context.scene.spectral.palette
    palette.live = False
    for number in range(12):
        bpy.ops.spectral.palette_add(side="LIGHT", name=f"Ceiling lamp {number}")
    for name in WALLS:
        bpy.ops.spectral.palette_add(side="MATERIAL", name=name)
    region = SimpleNamespace(width=292, type="UI")
    return palette, SimpleNamespace(scene=bpy.context.scene, region=region, preferences=None)


def test_names_are_shortened_by_their_width_and_stay_apart():
    def wide(text: str) -> float:
        return sum({"W": 11.0, "…": 9.0, "l": 2.0, "i": 2.0}.get(letter, 6.0) for letter in text)

    short = told_apart(WALLS, 36.0, wide)
    assert len(set(short)) == 40
    assert max(map(wide, short)) <= 36.0
    assert short[0] == "Wall…1"
    assert told_apart(["WWWW", "W"], 36.0, wide)[1] == "W"
    assert told_apart(["Mill", "Hill"], 20.0, wide) == ["Mill", "Hill"]  # four narrow letters fit
    assert told_apart(["Anything"], 1.0, wide) == ["…"]


def test_a_number_at_the_end_of_a_name_is_not_cut_in_two():
    halls = [f"Painted wall, hall {number}" for number in range(100, 105)]
    assert told_apart(halls, 60.0, lambda text: 6.0 * len(text))[:2] == ["Painte…100", "Painte…101"]


def test_names_that_differ_in_their_middle_stay_apart():
    """Three columns read "S…)" beside a fourth lamp with another name, and two read "Stre…0 W)"."""

    def wide(text: str) -> float:
        return 6.0 * len(text)

    lamps = [f"Street lamp at the corner (HPS {power} W)" for power in (10, 40, 70)]
    assert told_apart([*lamps, "Lamp with another name"], 36.0, wide) == ["…10 W)", "…40 W)", "…70 W)", "La…ame"]
    kinds = [f"Street lamp at the corner ({kind} 70 W)" for kind in ("HPS", "LED")]
    assert told_apart(kinds, 48.0, wide) == ["Str…HPS…", "Str…LED…"]
    assert told_apart(["Wall 10, left side", "Wall 10, right side"], 54.0, wide) == ["Wal…left…", "Wa…right…"]
    assert told_apart(["The same long name"] * 2, 36.0, wide) == ["Th…ame"] * 2


@pytest.mark.parametrize(
    ("kind", "width", "columns", "button"),
    [("UI", 291, 3, 72.0), ("UI", 291, 4, 51.5), ("UI", 291, 5, 39.0), ("WINDOW", 247, 4, 45.5)],
)
def test_names_have_the_room_of_the_table_that_blender_draws(kind, width, columns, button):
    """``button``: pixels in a window of Blender 4.3 whose interface has 25 pixels for 24. Blender cut off
    the end of "Very…rechts", which was made for a table without gaps in a panel without tabs.
    """
    scale = 25 / 24
    context: Any = SimpleNamespace(
        region=SimpleNamespace(width=width, type=kind),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=scale)),
    )
    assert button / scale - 10.0 < column_room(context, columns) < button / scale - 5.0


def test_the_names_of_a_large_table_end_differently(large):
    from blender_addon.panels.palette.table import draw_table

    palette, context = large
    layout = Texts()
    draw_table(layout, context, palette)
    shown = [text for text in layout.found if text.startswith(("Wal", "Wa", "W", "…"))]
    assert len(set(shown)) == 40
    assert max(text_width(text, context) for text in shown) < 292 / 5 - 16


def test_references_are_named_in_full(large):
    from blender_addon.operators.palette.table import SPECTRAL_OT_palette_refer
    from blender_addon.panels.palette.details import draw_cell

    palette, context = large
    palette.active_row, palette.active_column = 3, 5
    palette.materials[3].cells[5].mode = "SAME"
    layout = Texts()
    draw_cell(layout, context, palette)
    together = " ".join(layout.found)
    assert f"{WALLS[3]} under Ceiling lamp 5" in together
    assert f"Same as: {WALLS[0]} under Ceiling lamp 5" in together
    assert [text for text in layout.found if text.endswith("…40")]
    tooltip = SPECTRAL_OT_palette_refer.description(context, SimpleNamespace(row=7, column=2))
    assert tooltip.startswith(f"{WALLS[7]} under Ceiling lamp 2: ")


def test_an_alternative_says_how_many_materials_it_does_not_show(large):
    import json

    from blender_addon.panels.palette.more import draw_alternatives

    palette, context = large
    answer = palette.alternatives.add()
    answer.asked = ":" + ",".join(str(entry.uid) for entry in (*palette.lights, *palette.materials))
    answer.colors = json.dumps([[(0.5, 0.5, 0.5)]] * 40)
    layout = Texts()
    draw_alternatives(layout, context)
    assert layout.found[-1] == "and 28 more"
    assert len({text for text in layout.found if text.startswith("Wall p")}) > 40  # the locks, and the rows


def test_buttons_of_looks_are_told_apart(large):
    from blender_addon.panels.viewport import draw_look

    palette, context = large
    for number, light in enumerate(palette.lights):
        light.name = f"A lamp at the ceiling of the left corridor {number}"
    layout = Texts()
    context.view_layer = bpy.context.view_layer
    draw_look(layout, context, bpy.context.scene.spectral.viewport.look, "look")
    shown = [text for text in layout.found if text.startswith("A lamp")]
    assert shown == names_in(palette.lights.keys(), (292 - 56) / 2 - 16, context)
    assert len({text.rpartition("…")[2] for text in shown}) == 12


def test_a_light_and_a_material_have_names_of_their_own(blender):
    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = bpy.context.scene.spectral.palette
    first, second = palette.lights
    second.name = first.name
    assert palette.lights.keys() == ["Sodium", "Sodium 2"]
    palette.materials[1].name = "Paint 1"
    assert palette.materials.keys() == ["Paint 1", "Paint 1 2"]
    palette.materials[1].name = "Sodium"  # a light may have this name
    assert palette.materials.keys() == ["Paint 1", "Sodium"]


def test_a_look_follows_the_name_of_its_light(blender, tmp_path):
    from blender_addon.translate.viewport.look import look_of

    scene = bpy.context.scene
    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    bpy.ops.spectral.look_split()
    palette, settings = scene.spectral.palette, scene.spectral.viewport
    palette.lights[0].name = 'Lamp "of" the street'
    palette.lights[1].name = "Sun"
    assert (settings.look.column, settings.other.column) == ('Lamp "of" the street', "Sun")
    assert look_of(settings.look, scene).spectrum is not None
    palette.lights[0].name = "Sun"  # taken: the right side stays on its own light
    assert (settings.look.column, settings.other.column) == ("Sun 2", "Sun")
    palette.lights[0].known_as = ""  # as a file of an earlier version has it
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "looks.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "looks.blend"))
    scene = bpy.context.scene
    scene.spectral.palette.lights[0].name = "Street"
    assert scene.spectral.viewport.look.column == "Street"


def test_names_around_a_crowded_dial_do_not_overlap():
    """13 bulbs as after a recording: texts of 120 pixels and a height of 11 stay apart, which centered ones do not."""
    from itertools import combinations

    import numpy as np

    from blender_addon.drawing.dial_shape import LABEL_ROOM, DialShape
    from spectral_core.render.relight.dial import bulbs_on_polygon

    shape = DialShape.in_region(1000, 900, left=60)
    assert shape.unit == 110
    places = shape.pixels(np.array(bulbs_on_polygon(13)))
    width, height = 120.0, 11.0
    rows = [y + (1 if y >= shape.y - 1e-6 else -1) * LABEL_ROOM for y in places[:, 1]]

    def overlaps(starts: list[float]) -> int:
        boxes = list(zip(starts, rows, strict=True))
        return sum(abs(a[0] - b[0]) < width and abs(a[1] - b[1]) < height for a, b in combinations(boxes, 2))

    assert overlaps([shape.label_start(x, width) for x in places[:, 0]]) == 0
    assert overlaps([x - width / 2 for x in places[:, 0]]) > 0


@pytest.mark.parametrize(
    ("room", "icon", "shown"),
    [
        (120.0, "LOCKED", ("ΔE <0.01", "LOCKED")),
        (80.0, "LOCKED", ("<0.01", "LOCKED")),
        (80.0, "NONE", ("ΔE <0.01", "NONE")),
        (54.0, "LOCKED", ("<0.01", "NONE")),  # three lights in the sidebar: the number was "<0…"
        (54.0, "NONE", ("<0.01", "NONE")),
    ],
)
def test_the_number_of_a_cell_is_not_cut_off(monkeypatch, room, icon, shown):
    from blender_addon.panels.palette import table

    monkeypatch.setattr(table, "text_width", lambda text, _context: 7.0 * len(text))
    assert table.fitting("ΔE <0.01", icon, None, room) == shown


def test_names_that_blender_has_words_for_are_not_translated(blender):
    """In a German Blender a material that is named Color was shown as Farbe, beside Color in the material's field."""
    from blender_addon.panels.board import _draw_bindings
    from blender_addon.panels.dial import SPECTRAL_UL_dial_bulbs, _draw_dial
    from blender_addon.panels.palette.details import draw_cell
    from blender_addon.panels.palette.more import draw_alternatives
    from blender_addon.panels.palette.table import draw_table
    from blender_addon.panels.viewport import draw_look

    scene, layout = bpy.context.scene, Texts()
    palette, dial, board = scene.spectral.palette, scene.spectral.dial, scene.spectral.board
    palette.live = False
    for side, names in (("LIGHT", ("Sun", "Point")), ("MATERIAL", ("Color", "Glass"))):
        for name in names:
            bpy.ops.spectral.palette_add(side=side, name=name)
    palette.active_row = palette.active_column = 1
    palette.materials[1].cells[1].mode = "SAME"
    window = SimpleNamespace(as_pointer=lambda: 0)
    context = SimpleNamespace(
        scene=scene, region=SimpleNamespace(width=292, type="UI"), preferences=None, window=window,
        view_layer=bpy.context.view_layer, space_data=SimpleNamespace(type="IMAGE_EDITOR"),
    )  # fmt: skip
    draw_table(layout, context, palette)
    draw_cell(layout, context, palette)
    draw_alternatives(layout, context)
    draw_look(layout, context, scene.spectral.viewport.look, "look")
    for name in ("Area", "Spot"):
        dial.bulbs.add().name = name
    _draw_dial(layout, context, dial)
    rows = SimpleNamespace(shares=(0.5, 0.5))
    SPECTRAL_UL_dial_bulbs.draw_item(rows, context, layout, dial, dial.bulbs[1], 0, dial, "active", 1)
    board.bindings.add().name = 'bpy.data.lights["Sun"]'
    _draw_bindings(layout, context, board)
    shown = {"Sun", "Point", "Color", "Glass", "Area", "Spot"}
    assert shown <= set(layout.found)
    assert not shown & layout.translated


def test_faders_of_the_inputs_of_one_node_are_told_apart(blender):
    """The panel cut the middle out of their data paths, where they differ, and the second number out of an order."""
    from blender_addon import compat
    from blender_addon.panels.board import _draw_bindings

    paint = bpy.data.materials.new("Paint")
    node = next(each for each in compat.use_nodes(paint).nodes if each.type == "BSDF_PRINCIPLED")
    board, layout = bpy.context.scene.spectral.board, Texts()
    paths = [
        f'bpy.data.materials["Paint"].node_tree.nodes["{node.name}"].inputs[{number}].default_value'
        for number, socket in enumerate(node.inputs) if socket.name in ("Metallic", "Roughness")
    ]  # fmt: skip
    for path in (*paths, 'bpy.data.worlds["Gone"].node_tree.nodes["A"].inputs[1].default_value'):
        board.bindings.add().name = path
    order = board.orders.add()
    order.lower, order.upper = paths
    context = SimpleNamespace(region=SimpleNamespace(width=292, type="UI"), preferences=None)
    _draw_bindings(layout, context, board)
    together = " ".join(layout.found)
    for text in ("Metallic", "Roughness"):
        assert f"Paint: {node.name}, {text}" in together
    assert f"Metallic ≤ Paint: {node.name}, Roughness" in together
    assert "Gone: node_tree" in together.replace("  ", " ")
