# SPDX-License-Identifier: GPL-3.0-or-later
"""Wrapped text fills the width of a panel, and no line is wider."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")
import blf  # noqa: E402

TEXT = (
    "“Mark” under “Sodium” misses its color by ΔE 26.8, and no single cell is to blame: choose another color or light."
)


@pytest.mark.parametrize("room", [130.0, 171.0, 260.0, 900.0])
def test_lines_are_as_wide_as_the_panel_and_no_wider(room: float) -> None:
    from blender_addon.drawing.text import lines_in

    lines = lines_in(TEXT, room, SimpleNamespace(preferences=None))
    blf.size(0, 11.0)
    assert " ".join(lines) == TEXT
    assert max(blf.dimensions(0, line)[0] for line in lines) <= room + 2
    for line, following in pairwise(lines):
        assert blf.dimensions(0, f"{line} {following.split()[0]}")[0] > room - 4  # the next word had no room


def test_a_word_longer_than_a_line_is_divided() -> None:
    from blender_addon.drawing.text import lines_in

    lines = lines_in(f"at {'long' * 40} end", 150.0, SimpleNamespace(preferences=None))
    assert "".join(lines).replace(" ", "") == f"at{'long' * 40}end" and len(lines) > 4
    assert lines_in("", 150.0, SimpleNamespace(preferences=None)) == []


def test_a_volume_shows_its_size_and_values_in_full(blender) -> None:
    """A properties editor of Blender's own width cut off the range of the values, and the titles of curves."""
    from blender_addon.drawing.text import text_width
    from blender_addon.panels.parts import column_room
    from blender_addon.panels.volume import TITLE_SHARE, SPECTRAL_PT_volume

    shown: list[str] = []

    class Layout:
        def label(self, text: str = "", **_options: object) -> None:
            shown.append(text)

        def __getattr__(self, _name: str) -> object:
            return lambda *_arguments, **_options: self

    data = bpy.data.volumes.new("scan")
    data.spectral.facts = "512 × 512 × 512 voxels of int16, -1024 to 3071"
    data.spectral.materials.add()
    region = SimpleNamespace(width=240, type="WINDOW")
    context = SimpleNamespace(
        scene=bpy.context.scene, region=region, preferences=None, volume=data, object=bpy.data.objects.new("scan", data)
    )
    SPECTRAL_PT_volume.draw(SimpleNamespace(layout=Layout()), context)
    room = column_room(context, 1)
    facts = [line for line in shown if line and line in data.spectral.facts]
    assert " ".join(facts) == data.spectral.facts
    assert max(text_width(line, context) for line in facts) < room - 20  # beside the icon
    titles = [line for line in shown if line.endswith("over the data")]
    assert len(titles) == 2 and max(text_width(line, context) for line in titles) < TITLE_SHARE * (room - 14)


@pytest.mark.parametrize("width", [200, 252, 300, 420])
@pytest.mark.parametrize(
    ("name", "choices"), [("refractive_caustics", "on|off"), ("transport", "rgb|spectral"), ("fluorescence", "off")]
)
def test_the_plan_names_effects_in_full(width: int, name: str, choices: str) -> None:
    """A properties editor of Blender's own width showed "Transparen…" and "Refractive …" beside their buttons."""
    from blender_addon.drawing.text import text_width
    from blender_addon.panels.render import _draw_decision

    shares: list[float] = []

    class Layout:
        def split(self, factor: float) -> Layout:
            shares.append(factor)
            return self

        def __getattr__(self, _name: str) -> object:
            return lambda *_arguments, **_options: self

    line = SimpleNamespace(
        name=name, value="off", choices=choices, is_overridable=True, is_artists=False, reason="", cost="", error=0.0,
        time_share=0.0, how="exact",
    )  # fmt: skip
    context = SimpleNamespace(region=SimpleNamespace(width=width, type="WINDOW"), preferences=None)
    _draw_decision(Layout(), context, line)
    title = name.replace("_", " ").capitalize()
    for share in shares:  # none: the buttons are below the name
        assert share * (width - 33) > text_width(title, context) + 38  # as seen in a window of 4.3
    assert shares or width < 300


def test_an_effect_that_is_left_out_does_not_take_its_share_of_the_time() -> None:
    from blender_addon.panels.render import _figures

    line = SimpleNamespace(value="off", cost="", error=0.0, how="exact", time_share=0.5)
    assert _figures(line) == "ΔE 0 without it (exact); it would take 50 % of the time."
    assert _figures(SimpleNamespace(**{**vars(line), "value": "on"})) == "ΔE 0 without it (exact), 50 % of the time."


@pytest.mark.parametrize("width", [160, 199, 230, 292])
@pytest.mark.parametrize("icon", ["NONE", "INFO"])
def test_no_line_is_wider_than_a_narrow_panel(width: int, icon: str) -> None:
    """In a sidebar of 199 pixels the texts beside icons, and those beside curves, ended with "…"."""
    from blender_addon.drawing.text import text_width
    from blender_addon.panels.parts import wrapped

    shown: list[str] = []

    class Layout:
        def label(self, text: str, **_options: object) -> None:
            shown.append(text)

        def column(self, **_options: object) -> Layout:
            return self

    context = SimpleNamespace(region=SimpleNamespace(width=width, type="UI"), preferences=None)
    wrapped(Layout(), context, TEXT, icon=icon)
    room = width - 20 - 40 - (20 if icon == "INFO" else 0)  # beside the tabs and the margins of a panel
    assert max(text_width(line, context) for line in shown) <= room


@pytest.mark.parametrize("scale", [0.75, 0.9, 1.0, 1.5, 2.0])
def test_texts_are_measured_at_the_scale_of_the_interface(scale: float) -> None:
    """Letters end at whole pixels: "Reflectance 12" is up to 4 % wider at other scales than its size tells."""
    from blender_addon.drawing.text import lines_in, text_width

    style = SimpleNamespace(widget=SimpleNamespace(points=11.0))
    preferences = SimpleNamespace(ui_styles=[style], system=SimpleNamespace(ui_scale=scale))
    context = SimpleNamespace(preferences=preferences)
    for text in ("Reflectance 12", "Sodium street lamp", "m12"):
        blf.size(0, 11.0 * scale)
        assert text_width(text, context) == pytest.approx(blf.dimensions(0, text)[0] / scale)
    lines = lines_in(TEXT, 150.0, context)
    assert " ".join(lines) == TEXT and max(text_width(line, context) for line in lines) <= 150.0
    for line, following in pairwise(lines):
        assert text_width(f"{line} {following.split()[0]}", context) > 150.0 - 4


@pytest.mark.parametrize(("width", "are_beside"), [(199, False), (240, False), (292, True), (420, True)])
def test_requirements_of_a_lamp_are_named_in_full(blender, width: int, are_beside: bool) -> None:
    """The panel of a recipe showed "Rendering …" at a scale of 0.75, and in a narrow sidebar "Ren…" and no number."""
    from blender_addon.drawing.text import text_width
    from blender_addon.panels.recipe import QUALITIES, SPECTRAL_PT_recipe

    shares: list[float] = []

    class Layout:
        def split(self, factor: float, **_options: object) -> Layout:
            shares.append(factor)
            return self

        def __getattr__(self, _name: str) -> object:
            return lambda *_arguments, **_options: self

    region = SimpleNamespace(width=width, type="UI")
    context = SimpleNamespace(scene=blender.context.scene, region=region, preferences=None)
    recipe = context.scene.spectral.recipe
    recipe.kind, recipe.text = "LAMP", ""
    SPECTRAL_PT_recipe.draw(SimpleNamespace(layout=Layout()), context)
    labels = [recipe.bl_rna.properties[switch].name for switch, _ in QUALITIES]
    assert len(shares) == (len(labels) if are_beside else 0)
    for share in shares:
        assert share * (width - 62) > max(text_width(label, context) for label in labels) + 20  # beside the tick
