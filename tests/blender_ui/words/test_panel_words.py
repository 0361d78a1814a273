# SPDX-License-Identifier: GPL-3.0-or-later
"""Words of panels: lines that break where a reader expects it, and statements that hold for the present engine."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

bpy = pytest.importorskip("bpy")


class Lines:
    """A layout that keeps the labels that are drawn."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def column(self, **_options: object) -> Lines:
        return self

    def label(self, *, text: str, icon: str, **_options: object) -> None:
        assert icon
        self.lines.append(text)


def test_a_number_stays_on_the_line_of_its_unit() -> None:
    from blender_addon.panels.parts import wrapped

    text = "It misses its color by ΔE 30.3, and takes up to 633 MB, 12 % of the time, at 550 nm, with 9 lights."
    for width in range(180, 400, 7):
        layout = Lines()
        wrapped(layout, SimpleNamespace(preferences=None, region=SimpleNamespace(width=width)), text)
        for line in layout.lines:
            assert not line.endswith(("ΔE", "633", "12", "550")), width
        assert " ".join(layout.lines).replace("\u00a0", " ") == text


def test_labels_of_panels_keep_the_unit_of_a_setting(registered) -> None:
    """The names of these settings end with a unit; wavelengths were called "Wavelengths", "To", "In" and "Out"."""
    import blender_addon

    units = {
        (prop.identifier, found.group())
        for group in bpy.types.PropertyGroup.__subclasses__() if group.__name__.startswith("Spectral")
        for prop in group.bl_rna.properties if (found := re.search(r"\((nm|K|dB)\)", prop.name))
    }  # fmt: skip
    assert {("grid_start", "(nm)"), ("excitation_nm", "(nm)"), ("cct", "(K)")} <= units
    labels = [
        (str(node.args[1].value), text.value.value)
        for file in (Path(blender_addon.__file__).parent / "panels").rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(node, ast.Call) and len(node.args) > 1 and isinstance(node.args[1], ast.Constant)
        for text in node.keywords if text.arg == "text" and isinstance(text.value, ast.Constant)
    ]  # fmt: skip
    assert len(labels) > 20
    assert not [(label, unit) for setting, unit in units for named, label in labels
                if named == setting and unit not in label]  # fmt: skip


def test_a_solution_that_no_view_can_show_names_the_render_engine(registered) -> None:
    from blender_addon.editing.palette.picture import RELIT
    from blender_addon.panels.palette import picture_words

    told = "Rendered anew: the Light Dial has no recording"
    words = picture_words(SimpleNamespace(engine="SPECTRAL"), SimpleNamespace(picture=told))
    assert words == f"Rendered views show it. {told}."  # an artist in Solid mode sees no change
    assert "render engine Spectral" in picture_words(
        SimpleNamespace(engine="BLENDER_EEVEE"), SimpleNamespace(picture=told)
    )
    assert picture_words(SimpleNamespace(engine="BLENDER_EEVEE"), SimpleNamespace(picture=RELIT)).endswith(f"{RELIT}.")


def test_the_dial_shows_the_progress_of_a_recording_in_place_of_the_button(blender) -> None:
    from blender_addon.operators.dial_record import recording_progress
    from blender_addon.panels.dial import _draw_recording

    scene = bpy.context.scene

    def drawn() -> tuple[list[str], list[str]]:
        layout = MagicMock()
        row = layout.box.return_value.row.return_value
        _draw_recording(layout, bpy.context, scene.spectral.dial)
        return [each.args[0] for each in row.operator.mock_calls if each.args], [
            each.kwargs["text"] for each in row.progress.mock_calls
        ]

    assert "spectral.dial_record" in drawn()[0]
    recording_progress[scene.session_uid] = 0.34
    try:
        assert drawn() == ([], ["Recording 34 %; Esc stops it"])
    finally:
        recording_progress.clear()


def test_a_curve_over_imported_data_has_the_values_of_its_ends() -> None:
    from blender_addon.panels.volume import _draw_ends
    from blender_addon.properties.volume import RANGE_KEY

    def drawn(data: dict[str, list[float]], which: str) -> list[str]:
        box = MagicMock()
        _draw_ends(box, data, which)
        return [call.kwargs["text"] for call in box.mock_calls if call[0].endswith("label")]

    assert drawn({RANGE_KEY: [-100.0, 3926.0]}, "density") == ["Data from -100", "to 3926"]
    assert drawn({RANGE_KEY: [-100.0, 3926.0]}, "gradient") == []
    assert drawn({}, "density") == []


class Properties:
    """A layout that keeps the names of the properties that are drawn."""

    def __init__(self, names: list[str]) -> None:
        self.names = names

    def prop(self, _owner: object, name: str, **_options: object) -> None:
        self.names.append(name)

    def __getattr__(self, name: str) -> object:
        if name.startswith("operator"):
            return lambda *_arguments, **_options: SimpleNamespace()
        return (lambda **_options: self) if name in ("row", "column", "box", "grid_flow") else lambda *_, **__: None


@pytest.mark.parametrize("is_limited", [False, True])
def test_the_weight_of_a_range_of_colors_is_shown_where_it_counts(blender, is_limited: bool) -> None:
    from blender_addon.panels.palette.details import draw_cell

    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    palette = blender.context.scene.spectral.palette
    cell = palette.materials[palette.active_row].cells[palette.active_column]
    cell.mode, cell.use_box = "FREE", is_limited
    names: list[str] = []
    draw_cell(Properties(names), SimpleNamespace(scene=blender.context.scene, preferences=None, region=None), palette)
    assert ("weight" in names, "exact" in names) == (is_limited, is_limited)


def test_a_binding_whose_light_was_deleted_says_so(blender) -> None:
    from blender_addon.panels.board import _draw_bindings

    settings = bpy.context.scene.spectral.board
    lamp = bpy.data.lights.new("Sconce", "POINT")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Sconce", lamp))
    settings.bindings.add().name = 'bpy.data.lights["Sconce"].energy'

    def drawn() -> list[str]:
        layout = MagicMock()
        _draw_bindings(layout, SimpleNamespace(preferences=None, region=None), settings)
        return [call.kwargs["text"] for call in layout.mock_calls if call[0].endswith("label")]

    assert drawn() == ["Sconce: energy"]
    bpy.data.lights.remove(lamp)
    assert "no lights named 'Sconce'" in " ".join(drawn())


def test_a_palette_is_no_second_source_beside_a_name_or_a_file(registered) -> None:
    from blender_addon.panels.parts import takes_from_palette

    def offered(source: str, rows: int) -> bool:
        scene = SimpleNamespace(spectral=SimpleNamespace(palette=SimpleNamespace(materials=range(rows))))
        return takes_from_palette(SimpleNamespace(scene=scene), SimpleNamespace(source=source))

    assert [offered(source, 2) for source in ("NONE", "CATALOGUE", "FILE", "DESIGNED")] == [True, False, False, True]
    assert not offered("NONE", 0)
