# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting of the texture, recipe and sweep panels reaches the core, and can be reset."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.editing import recipe as recipes
from blender_addon.editing.sweep import live as sweeps
from blender_addon.translate.spectra.stored import store_spectrum
from blender_addon.translate.texture.project import project_of
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.palette.texture import project as projects
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.files import write_spectra
from tests.settings_walk import ignored_settings, other_rna, read_rna, settings_of

AFTER_A_TEXTURE = {
    "folder", "status", "failed", "progress", "is_under_way", "designed_as", "texture_file", "report", "lost_1",
    "lost_2", "lamp_1", "lamp_2",
}  # fmt: skip
"""Properties that are no input: the folder of the design, its results, and the lamps that get its lights."""
AFTER_A_RECIPE = {"text", "met", "spectrum", "found_kind"}
OUTSIDE_THE_SWEEP = {
    "active": "the row that the list shows",
    "point": "the row of the table that is set in the scene",
    "status": "of the run", "done": "of the run", "total": "of the run", "is_under_way": "of the run",
    "swept_as": "the scene that owns the folder",
}  # fmt: skip


def walked(owner: Any, names: Any, translated: Any, others: dict[str, Any] | None = None) -> dict[str, str]:
    """``ignored_settings`` for the properties of one struct."""
    others = others or {}

    def other(name: str) -> Any:
        return others[name] if name in others else other_rna(owner, name)

    return ignored_settings(
        names, lambda name: read_rna(owner, name), lambda name, v: setattr(owner, name, v), other, translated
    )


def picture(tmp_path: Path, name: str) -> Any:
    """An image with a file and no other data."""
    made = bpy.data.images.new(name, 4, 4)
    made.filepath_raw, made.file_format = str(tmp_path / f"{name}.png"), "PNG"
    made.save()
    return bpy.data.images.load(str(tmp_path / f"{name}.png"))


@pytest.fixture
def texture(blender, tmp_path):
    design = blender.context.scene.spectral.texture
    design.first, design.second = picture(tmp_path, "first"), picture(tmp_path, "second")
    return design


def test_every_setting_of_a_texture_has_an_effect(texture, tmp_path):
    """In the project of the panel, in its document, and in the project that is read from the document."""

    def designed() -> Any:
        document = projects.document_of(project_of(texture, tmp_path))
        return projects.document_of(projects.project_of(document, tmp_path))

    others = {"first": picture(tmp_path, "third"), "second": picture(tmp_path, "fourth"), "spectra": 8}
    names = set(settings_of(texture, bpy.types.PropertyGroup)) - AFTER_A_TEXTURE - {"wanted_colors"}
    lights = {"light_1", "light_2"}
    for number in (1, 2):
        store_spectrum(getattr(texture, f"light_{number}").spectral, illuminant(f"FL{number}"))
    assert walked(texture, names - lights - {"kind"}, designed, others) == {}
    texture.lights = "GIVEN"
    assert walked(texture, ["kind"], designed) == {}
    for name in lights:
        store = lambda light, name=name: store_spectrum(getattr(texture, name).spectral, illuminant(light))  # noqa: E731
        read = lambda _, name=name: {"light_1": "FL1", "light_2": "FL2"}[name]  # noqa: E731
        assert (
            ignored_settings([name], read, lambda _, light, store=store: store(light), lambda _: "D65", designed) == {}
        )
    texture.kind = "ONE"
    row = texture.wanted_colors.add()
    assert walked(row, ["color", "wanted"], designed) == {}


@pytest.fixture
def asked(monkeypatch):
    """The arguments that a recipe passes to the core, in place of a result."""
    calls: list[Any] = []

    class Found:
        met, lamp = True, illuminant("D65")
        reflectance = lamp
        rendering_index = fidelity = gamut = 100.0

        def text(self, *arguments: Any) -> str:
            return str(arguments)

    def ask(*arguments: Any, **options: Any) -> Found:
        calls.append((arguments, options))
        return Found()

    monkeypatch.setattr(recipes, "lamp_recipe", ask)
    monkeypatch.setattr(recipes, "material_recipe", ask)
    return calls


def test_every_setting_of_a_recipe_has_an_effect(blender, asked, tmp_path):
    scene = blender.context.scene
    recipe = scene.spectral.recipe
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    write_spectra(tmp_path / "mine.csv", [reflectance(each) for each in ("red", "green", "blue", "foliage")])
    write_spectra(tmp_path / "others.csv", [reflectance(each) for each in ("orange", "green", "blue", "foliage")])

    def made() -> Any:
        asked.clear()
        recipes.store(scene, recipes.search(scene)())
        return asked[0], recipe.text

    names = set(settings_of(recipe, bpy.types.PropertyGroup)) - AFTER_A_RECIPE
    recipe.use_gamut = recipe.use_fidelity = True
    of_lamps = {"kind", "most", "cct", "duv", "use_cri", "cri", "use_fidelity", "fidelity", "use_gamut", "gamut_low",
                "gamut_high"}  # fmt: skip
    assert walked(recipe, of_lamps, made, {"gamut_low": 90.0, "gamut_high": 110.0}) == {}
    recipe.kind, recipe.wanted = "PAINTS", "NAMED"
    of_paints = {"wanted", "surface", "grams"}
    assert walked(recipe, of_paints, made, {"surface": "foliage"}) == {}
    recipe.library, recipe.filepath, recipe.kind = "FILE", str(tmp_path / "mine.csv"), "INKS"
    assert walked(recipe, ["filepath", "dot_gain"], made, {"filepath": str(tmp_path / "others.csv")}) == {}
    write_spectra(tmp_path / "lamps.csv", [illuminant(each) for each in ("D65", "A", "HP1", "FL11")])
    recipe.kind, recipe.filepath = "LAMP", str(tmp_path / "lamps.csv")
    assert walked(recipe, ["library"], made) == {}
    assert of_lamps | of_paints | {"filepath", "dot_gain", "library"} == names


@pytest.fixture
def sweep(blender, tmp_path):
    scene = blender.context.scene
    settings = scene.spectral.sweep
    settings.folder = str(tmp_path / "s.cdb")
    sweeps.add(scene, 'bpy.data.scenes["Scene"].render.pixel_aspect_x')
    sweeps.add(scene, 'bpy.data.scenes["Scene"].render.use_border')
    return settings


def test_every_setting_of_a_sweep_has_an_effect(blender, sweep, tmp_path):
    scene = blender.context.scene

    def written() -> Any:
        documents = sweeps.write_documents(scene)
        plain = read_sweep(documents.document)
        words = sweeps.command_line(documents.document, documents.folder, sweep.workers)
        return plain.compute, plain.design.to_dict(), [p.to_dict() for p in plain.space.parameters], words

    names = set(settings_of(sweep, bpy.types.PropertyGroup)) - set(OUTSIDE_THE_SWEEP) - {"parameters"}
    assert walked(sweep, names, written, {"folder": str(tmp_path / "other.cdb"), "design": "sobol"}) == {}
    number, switch = sweep.parameters
    # blender_sweep/test_copied_scenes.py tests data-blocks
    of_numbers = set(settings_of(number, bpy.types.PropertyGroup)) - {"choices", "is_angle", "block"}
    others = {"name": 'bpy.data.scenes["Scene"].render.pixel_aspect_y', "label": "other", "scale": "log", "low": 0.75,
              "high": 1.75}  # fmt: skip
    number.low, number.high = 0.5, 1.5
    assert walked(number, of_numbers - {"whole"}, written, others) == {}
    number.low, number.high = 1.0, 3.0
    assert walked(number, ["whole"], written) == {}
    assert walked(switch, ["choices"], written, {"choices": "on, off"}) == {}
