# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply: written data, refusals, brightness of other objects, and messages on deleted data-blocks."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.translate.spectra.stored import spectrum_of, store_spectrum, strength_of
from spectral_core.errors import InvalidInputError
from spectral_core.spectra.catalogue import reflectance


@pytest.fixture
def scene(blender):
    """The preset hidden mark, assigned to a lamp and a material of an object."""
    scene = blender.context.scene
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    lamp = blender.data.lights.new("Sun", "POINT")
    scene.collection.objects.link(blender.data.objects.new("Sun", lamp))
    palette = scene.spectral.palette
    palette.lights[0].light = lamp
    palette.materials[0].material = blender.data.materials.new("Mark")
    return scene


@pytest.fixture
def linked(blender, tmp_path):
    """A material that is linked from a library."""
    blender.data.materials.new("Glaze").use_fake_user = True
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    blender.ops.wm.read_factory_settings(use_empty=True)
    with blender.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, into):
        into.materials = ["Glaze"]
    return blender.data.materials["Glaze"]


@pytest.mark.parametrize("name", ["HP1", "D65", "led 450"])
def test_a_lamp_gets_the_color_of_its_spectrum(blender, name):
    from blender_addon.translate.palette.apply import store_colors
    from spectral_core.palette.texture.lights import led
    from spectral_core.spectra.catalogue import illuminant

    lamp = blender.data.lights.new("lamp", "POINT")
    store_spectrum(lamp.spectral, led(450, 20) if name == "led 450" else illuminant(name))
    lamp.color = (0.2, 0.9, 0.4)
    store_colors(lamp)
    red, green, blue = lamp.color
    if name == "D65":
        assert (red, green, blue) == pytest.approx((1.0, 1.0, 1.0), abs=0.02)
    else:  # sodium: orange, and no blue; a blue diode
        assert red > 2 * green > 10 * blue if name == "HP1" else blue > 5 * max(red, green)


def test_a_temperature_does_not_tint_the_color_of_a_spectrum(blender):
    """EEVEE and Cycles multiply both, so that the color of a sodium lamp was reddened once more."""
    from blender_addon.translate.palette.apply import store_colors
    from spectral_core.spectra.catalogue import illuminant

    lamps = [blender.data.lights.new("lamp", "POINT") for _ in range(2)]
    if not hasattr(lamps[1], "use_temperature"):
        pytest.skip("lamps have no temperature before 4.5")
    lamps[1].use_temperature, lamps[1].temperature = True, 2700.0
    for lamp in lamps:
        store_spectrum(lamp.spectral, illuminant("HP1"))
        store_colors(lamp)
    shown = [np.array(lamp.color) * (lamp.temperature_color if lamp.use_temperature else 1.0) for lamp in lamps]
    np.testing.assert_allclose(shown[1], shown[0], rtol=1e-6)


def test_an_exposure_at_its_limit_is_restored(blender, scene):
    palette, view = scene.spectral.palette, scene.view_settings
    palette.brightness, view.exposure = 5.0, 31.0
    blender.ops.spectral.palette_apply()
    assert view.exposure == 32.0
    palette.level_to = "LIGHTS"
    blender.ops.spectral.palette_apply()
    assert view.exposure == pytest.approx(31.0, abs=1e-5)


def test_apply_keeps_the_power_of_lamps_and_sets_the_exposure_of_the_view(blender, scene):
    palette = scene.spectral.palette
    palette.brightness = 5.0
    scene.view_settings.exposure = 0.5
    lamp = palette.lights[0].light
    blender.ops.spectral.palette_apply()
    assert strength_of(lamp) == pytest.approx(palette.lights[0].intensity, rel=1e-5)
    assert scene.view_settings.exposure == pytest.approx(0.5 + np.log2(5.0), abs=1e-5)
    palette.brightness = 2.5
    blender.ops.spectral.palette_apply()  # a second Apply adds nothing
    assert scene.view_settings.exposure == pytest.approx(0.5 + np.log2(2.5), abs=1e-5)
    palette.level_to = "LIGHTS"
    blender.ops.spectral.palette_apply()
    assert strength_of(lamp) == pytest.approx(2.5 * palette.lights[0].intensity, rel=1e-5)
    assert scene.view_settings.exposure == pytest.approx(0.5, abs=1e-5)


def test_a_linked_material_is_refused_by_name_and_nothing_is_written(blender, linked):
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    palette = blender.context.scene.spectral.palette
    lamp = blender.data.lights.new("Sun", "POINT")
    palette.lights[0].light, palette.materials[0].material = lamp, linked
    with pytest.raises(RuntimeError, match=r"material 'Glaze' is linked from library\.blend .*Mend Table"):
        blender.ops.spectral.palette_apply()
    assert lamp.spectral.source == "NONE"
    assert linked.spectral.source == "NONE"
    with pytest.raises(InvalidInputError, match="'Glaze' is linked"):
        store_spectrum(linked.spectral, reflectance("dark skin"))


def test_a_linked_material_is_made_local_on_request_and_keeps_its_spectrum(blender, linked, tmp_path):
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    palette = blender.context.scene.spectral.palette
    palette.materials[0].material = linked
    blender.ops.spectral.palette_apply(make_local=True)
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "user.blend"))
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "user.blend"))
    loaded = blender.context.scene.spectral.palette.materials[0].material
    assert loaded.library is None
    assert spectrum_of(loaded).values.size > 30


def test_an_override_is_refused_because_its_spectrum_would_not_be_saved(linked):
    override = linked.override_create(remap_local_usages=True)
    with pytest.raises(InvalidInputError, match="'Glaze' is linked from library"):
        store_spectrum(override.spectral, reflectance("dark skin"))


def test_deleted_and_renamed_data_blocks_are_reported_and_corrected(blender, scene):
    from blender_addon.editing.palette.bindings import faults

    palette = scene.spectral.palette
    assert faults(palette) == []
    row, column = palette.materials[0], palette.lights[0]
    row.name = "Mark"
    row.material.name = "Seal"
    blender.data.objects.remove(blender.data.objects["Sun"])
    assert [(fault.kind, fault.text) for fault in faults(palette)] == [
        ("unused", f"{column.name}: nothing in the scene uses light 'Sun'"),
        ("renamed", "Mark: material 'Mark' is now named 'Seal'"),
    ]
    blender.data.materials.remove(row.material)
    assert faults(palette)[1].text == "Mark: material 'Mark' was deleted"
    blender.data.materials.new("Mark")
    assert blender.ops.spectral.palette_mend() == {"FINISHED"}
    assert faults(palette) == []
    assert row.material == blender.data.materials["Mark"]
    assert column.light is None


def test_a_renamed_light_of_a_deleted_object_is_unused(blender, scene, capfd):
    """It was called renamed, and Apply reported its spectrum without a warning."""
    column = scene.spectral.palette.lights[0]
    column.light.name = "Old Sun"
    blender.data.objects.remove(blender.data.objects["Sun"])
    blender.ops.spectral.palette_apply()
    assert "nothing in the scene uses light 'Old Sun'" in "".join(capfd.readouterr())


def test_a_row_follows_the_new_name_of_its_material(blender, scene):
    palette = scene.spectral.palette
    palette.materials[0].name = "Mark"
    palette.materials[0].material.name = "Seal"
    blender.ops.spectral.palette_mend()
    assert palette.materials[0].name == "Seal"
    assert palette.materials[0].material_name == "Seal"


def test_a_table_with_nothing_to_mend_makes_no_undo_step(blender, scene, capfd):
    """The step was named Mend Table and changed nothing, so that the next Ctrl+Z seemed to do nothing."""
    assert blender.ops.spectral.palette_mend() == {"CANCELLED"}
    assert "nothing to mend: every name in the table is current" in "".join(capfd.readouterr())


@pytest.mark.parametrize(
    "operator",
    ["spectra_export", "swatches_export", "palette_export", "palette_import", "board_motion", "dial_save"],
)
def test_an_operator_without_a_path_reports_it(blender, scene, operator):
    from blender_addon.editing.board import live

    if operator == "board_motion":
        live.start(scene)[0].events.append((0.0, "x", 0.5))
    try:
        with pytest.raises(RuntimeError, match="no file is chosen"):
            getattr(blender.ops.spectral, operator)()
    finally:
        live.stop()


def test_results_of_an_earlier_version_get_swatches(blender, scene, tmp_path):
    """A file that has linear colors only."""
    cell = scene.spectral.palette.materials[0].cells[1]
    before = tuple(cell.actual)
    for _, each in [(None, c) for material in scene.spectral.palette.materials for c in material.cells]:
        each.actual_display = each.wanted_display = (0.0, 0.0, 0.0)
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "old.blend"))
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "old.blend"))
    assert tuple(blender.context.scene.spectral.palette.materials[0].cells[1].actual) == pytest.approx(before, abs=1e-6)


def test_a_linked_volume_is_refused_by_name(blender, tmp_path):
    from blender_addon.translate.volume_looks.transfer import stated_transfer, store_transfer

    local = blender.data.volumes.new("Smoke")
    local.use_fake_user = True
    from blender_addon.translate.volume_looks.curves import add_material

    add_material(local, "Haze")
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    blender.ops.wm.read_factory_settings(use_empty=True)
    with blender.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, into):
        into.volumes = ["Smoke"]
    linked = blender.data.volumes["Smoke"]
    with pytest.raises(InvalidInputError, match=r"volume 'Smoke' is linked from library\.blend"):
        store_transfer(linked, stated_transfer(linked))
    assert len(linked.spectral.materials) == 1


def test_a_light_of_two_columns_is_named_with_the_spectrum_that_it_gets(blender, scene, capfd):
    from blender_addon.editing.palette.bindings import shared

    palette = scene.spectral.palette
    assert shared(palette) == []
    palette.lights[1].light = palette.lights[0].light
    assert shared(palette) == ["'Sun' is chosen for Daylight and Sodium, and has the spectrum of Sodium"]
    blender.ops.spectral.palette_apply()
    assert "choose another one for each" in capfd.readouterr().out
    assert spectrum_of(palette.lights[0].light).name == palette.lights[1].result.spectrum_name


def test_the_first_table_of_an_artist_can_be_applied_by_a_button(blender):
    """An idea names no material of the scene, and the option is in reach only after a call that succeeds."""
    from unittest.mock import MagicMock

    from blender_addon.panels.palette import draw_palette

    scene = blender.context.scene
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")

    def buttons() -> list[str]:
        layout = MagicMock()
        draw_palette(layout, blender.context)
        return [call.kwargs["text"] for call in layout.mock_calls if "text" in call.kwargs and "operator" in call[0]]

    assert "Apply and Make Materials" in buttons()
    with pytest.raises(RuntimeError, match="press Apply and Make Materials"):
        blender.ops.spectral.palette_apply()
    assert blender.ops.spectral.palette_apply(create=True) == {"FINISHED"}
    assert [row.material.spectral.source for row in scene.spectral.palette.materials] == ["DESIGNED", "DESIGNED"]
    assert "Apply and Make Materials" not in buttons()


def test_the_button_that_a_refusal_names_makes_linked_data_local(blender, linked):
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    blender.context.scene.spectral.palette.materials[0].material = linked
    with pytest.raises(RuntimeError, match="Mend Table"):
        blender.ops.spectral.palette_apply()
    assert blender.ops.spectral.palette_mend() == {"FINISHED"}
    assert blender.ops.spectral.palette_apply() == {"FINISHED"}
    assert blender.context.scene.spectral.palette.materials[0].material.library is None


def test_a_light_that_nothing_uses_is_not_called_deleted(blender, scene, capfd):
    """The warning was "the table names deleted data", of a light that exists."""
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    scene.spectral.palette.lights[0].light = blender.data.lights.new("Spare", "POINT")
    blender.ops.spectral.palette_apply()
    said = "".join(capfd.readouterr())
    assert "deleted or unused data: Daylight: nothing in the scene uses light 'Spare'" in said, said
