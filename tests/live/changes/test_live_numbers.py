# SPDX-License-Identifier: GPL-3.0-or-later
"""Any number of a material is edited in place, also across the value at which it has no effect."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live.in_place.opened import HELD, Opened
from spectral_core.render.live.stage import Stage
from spectral_core.scene import (
    Color,
    Computed,
    Diffuse,
    EllipseHair,
    Emission,
    Glass,
    Glossy,
    Hair,
    HairLobe,
    Metal,
    MixSurface,
    Principled,
    RenderSettings,
    Scene,
    Sheen,
    Subsurface,
    Toon,
    Translucent,
    Transparent,
    gray,
)
from spectral_core.scene.shading import Builder
from tests.live import test_live_session as session
from tests.live.changes.test_live_programs import _pictured

scene = session.scene

SURFACES = (
    Principled(
        Color((0.5, 0.4, 0.3)), alpha=0.9, metallic=0.3, transmission=0.2, coat_weight=0.3, sheen_weight=0.3,
        diffuse_roughness=0.3, subsurface_weight=0.2, emission_strength=0.2, specular_tint=Color((0.9, 0.8, 0.7)),
        coat_tint=Color((0.9, 0.8, 0.7)), anisotropic=0.3, thin_film_thickness=200.0,
    ),
    Diffuse(gray(0.5), roughness=0.3), Glossy(gray(0.5), roughness=0.3, anisotropy=0.2), Glass(gray(0.5), 0.3),
    Translucent(gray(0.5)), Toon(gray(0.5)), Metal(gray(0.6)), Transparent(gray(0.5)), Sheen(gray(0.5)),
    Emission(gray(0.5)), Subsurface(gray(0.5)), MixSurface(0.3, Diffuse(gray(0.5)), Glossy(gray(0.5))),
    EllipseHair(gray(0.5)), Hair(gray(0.5)), HairLobe(gray(0.5)),
)  # fmt: skip
LOADED_ANEW = {("Metal", "edge_scale")}
"""A constant of the translation, not a number of the artist."""


def painted(scene: Scene, surface: Any, name: str = "red") -> Scene:
    return replace(
        scene, materials=tuple(replace(m, surface=surface) if m.name == name else m for m in scene.materials)
    )


def changes(surface: Any) -> Iterator[tuple[str, Any]]:
    for entry in fields(surface):
        value = getattr(surface, entry.name)
        if (type(surface).__name__, entry.name) in LOADED_ANEW:
            continue
        if isinstance(value, Color):
            yield entry.name, Color(value.linear_rgb * 0.93)
        elif isinstance(value, float) and value > 0:
            yield entry.name, value * 1.07


@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: type(surface).__name__)
def test_every_number_of_a_material_is_edited_in_place(scene: Scene, surface: Any) -> None:
    """Every edit of a material with sheen loaded the scene."""
    stage = Stage()
    stage.show(painted(scene, surface))
    for name, value in changes(surface):
        stage.show(painted(scene, replace(surface, **{name: value})))
        assert stage.loads == 1, name
        assert stage.how == "materials", name


BASES = {
    "Principled": Principled(Color((0.5, 0.4, 0.3))), "Diffuse": Diffuse(gray(0.5)),
}  # fmt: skip
CROSSED = [(of.__name__, field, key) for of, held in HELD.items() for field, keys in held.items() for key in keys]


@pytest.mark.parametrize(("kind", "field", "key"), CROSSED)
def test_a_number_is_raised_and_lowered_with_one_load(scene: Scene, kind: str, field: str, key: Any) -> None:
    base = replace(BASES[kind], transmission=0.5) if field == "metallic" else BASES[kind]
    if field == "coat_tint":
        base = replace(base, coat_weight=0.5)
    without = Color(np.ones(3)) if key == "white" else key
    effect = Color((0.9, 0.5, 0.4)) if key == "white" else 0.4
    stage = Stage()
    for value in (without, effect, without, 0.7 * effect if key != "white" else gray(0.7), without):
        stage.show(painted(scene, replace(base, **{field: value})))
    assert stage.loads == 2
    lowered = Stage()
    for value in (effect, without, effect, without):
        lowered.show(painted(scene, replace(base, **{field: value})))
    assert lowered.loads == 1


def test_what_is_held_is_not_seen(scene: Scene) -> None:
    whole = Principled(Color((0.5, 0.4, 0.3)), roughness=0.4)
    raised = replace(whole, alpha=0.5, transmission=0.5, coat_weight=0.5, sheen_weight=0.5, diffuse_roughness=0.5)
    stage = Stage()
    for surface, samples in ((whole, 1), (raised, 1), (whole, 256)):
        shown = _pictured(stage, painted(scene, surface), samples)
    assert stage.loads == 2
    fresh = _pictured(Stage(), painted(scene, whole), 256)
    np.testing.assert_allclose(shown.mean(axis=(0, 1)), fresh.mean(axis=(0, 1)), rtol=2e-3)
    assert np.abs(shown - fresh).mean() < 0.02 * fresh.mean()


def test_a_number_raised_in_one_material_is_held_in_all(scene: Scene) -> None:
    stage, plain = Stage(), Principled(gray(0.5))
    scene = painted(painted(scene, plain), plain, "gray")
    stage.show(scene)
    for name in ("red", "gray", "shiny"):
        scene = painted(scene, Principled(gray(0.5), coat_weight=0.6), name)
        stage.show(scene)
    assert stage.loads == 2


def test_another_load_ends_what_no_material_uses(scene: Scene) -> None:
    opened, plain = Opened(), Principled(gray(0.5))
    first, raised = painted(scene, plain), painted(scene, replace(plain, coat_weight=0.5))
    assert opened.of(first) is first and opened.renewed(first) is first
    held = opened.of(raised)
    assert opened.has_grown
    assert all(m.surface.coat_weight > 0 for m in held.materials if isinstance(m.surface, Principled))
    assert opened.renewed(raised).materials == held.materials  # the same objects, so that nothing is compared
    again = opened.of(first)
    assert not opened.has_grown and again.materials[1].surface.coat_weight > 0
    assert opened.renewed(first).materials == first.materials


def test_another_node_opens_nothing(scene: Scene) -> None:
    """A texture, another closure, or a number that was already there."""
    build = Builder()
    varying = Computed(build.program(build.add("vector_input", (), "position", 0)))
    opened, plain = Opened(), Principled(gray(0.5), coat_weight=0.2)
    for surface in (plain, replace(plain, coat_weight=0.3), Diffuse(gray(0.5)), plain, Diffuse(varying)):
        opened.of(painted(scene, surface))
        assert not opened.has_grown


def test_an_edit_across_the_neutral_value_compares_in_spectra(scene: Scene) -> None:
    stage = Stage()
    for weight in (0.0, 0.4, 0.0, 0.8):
        shown = painted(scene, Principled(gray(0.5), coat_weight=weight))
        stage.show(replace(shown, settings=RenderSettings(transport="spectral")))
    assert stage.loads == 2
