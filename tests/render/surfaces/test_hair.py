# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of hair: a fiber that absorbs nothing is invisible in even light, and light passes through its tube."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    STRAND_SIDES,
    STRAND_TANGENT,
    Camera,
    Color,
    Computed,
    EllipseHair,
    Film,
    Hair,
    HairLobe,
    Instance,
    Material,
    Mesh,
    PointLight,
    Rays,
    RenderSettings,
    Scene,
    Surface,
    World,
    gray,
)
from spectral_core.scene.geometry import Attribute
from spectral_core.scene.shading import Builder
from tests.render.scenes import matrix

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


def tangent() -> Computed:
    """The strand's direction, as the translation of Blender's nodes reads it."""
    builder = Builder()
    read = builder.add("vector_input", (), STRAND_TANGENT, 0)
    return Computed(builder.program(read))


def strand(radius: float = 0.5) -> Mesh:
    """One strand along x, from -3 to 3."""
    turn = 2 * np.pi * np.arange(STRAND_SIDES) / STRAND_SIDES
    around = np.stack([0 * turn, np.cos(turn), np.sin(turn)], axis=-1)
    ends = np.array([[-3.0, 0, 0], [3.0, 0, 0]])
    positions = (ends[:, None] + radius * around).reshape(-1, 3).astype(np.float32)
    faces = []
    for k in range(STRAND_SIDES):
        a, b = k, (k + 1) % STRAND_SIDES
        faces += [(a, b + STRAND_SIDES, b), (a, a + STRAND_SIDES, b + STRAND_SIDES)]
    normals = np.tile(around, (2, 1)).astype(np.float32)
    along = Attribute(STRAND_TANGENT, np.tile([1.0, 0, 0], (len(positions), 1)))
    made = Mesh("strand", positions, np.array(faces, np.uint32), normals, attributes=(along,), is_strands=True)
    corners = made.positions[made.triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = np.einsum("ti,ti->t", facing, made.normals[made.triangles[:, 0]]) > 0
    return made if outward.all() else replace(made, triangles=made.triangles[:, ::-1])


def shown(surface: Surface, *, transport: str = "rgb", samples: int = 256) -> np.ndarray:
    """Pixels across the strand in even white light."""
    scene = Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 5)), kind="orthographic", orthographic_scale=1.2),
        film=Film(8, 8, samples=samples),
        meshes=(strand(),),
        materials=(Material("hair", surface),),
        instances=(Instance("strand", "strand", np.eye(4), ("hair",)),),
        world=World(gray(1.0)),
        settings=RenderSettings(transport=transport, max_bounces=8),  # type: ignore[arg-type]
    )
    return render_scene(scene).pixels[..., :3]


@pytest.mark.parametrize("roughness", [0.05, 0.3, 0.9])
@pytest.mark.parametrize("radial", [0.1, 0.9])
def test_a_fiber_that_absorbs_nothing_is_invisible(roughness: float, radial: float) -> None:
    surface = Hair(gray(1.0), True, 1.0, roughness, radial, 0.3, 1.55, 0.05, tangent())
    assert shown(surface).mean() == pytest.approx(1.0, abs=0.01)


def axis() -> Computed:
    """The larger axis of a cross-section, along z of the world."""
    builder = Builder()
    return Computed(builder.program(builder.number((0.0, 0.0, 1.0))))


@pytest.mark.parametrize("aspect", [1.0, 0.5, 2.0])
@pytest.mark.parametrize("roughness", [0.15, 0.5])
def test_an_ellipse_that_absorbs_nothing_is_nearly_invisible(aspect: float, roughness: float) -> None:
    """Light beside an ellipse passes; what is drawn and what is measured have the same energy."""
    surface = EllipseHair(
        gray(1.0), True, roughness=roughness, aspect_ratio=aspect, tangent=tangent(), major_axis=axis()
    )
    assert shown(surface).mean() == pytest.approx(1.0, abs=0.05)


def test_an_ellipse_is_seen_as_wide_as_it_is() -> None:
    """Strands that send no light on are black as far as the ellipse reaches, which ends within rows."""
    black = {"reflection": 0.0, "transmission": 0.0, "secondary_reflection": 0.0, "tangent": tangent()}
    wide, narrow = (
        shown(EllipseHair(gray(0.1), False, 50.0, aspect_ratio=aspect, major_axis=axis(), **black))[..., 1].mean(axis=1)
        for aspect in (1.0, 0.5)
    )
    assert wide[1:7].max() < 0.02 and narrow[3:5].max() < 0.02 and narrow[[0, 1, 6, 7]].min() > 0.98
    assert np.sum(1.0 - narrow) == pytest.approx(0.5 * np.sum(1.0 - wide), abs=0.15)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_absorption_is_per_channel_and_wavelength(transport: str) -> None:
    """Depth multiplies the absorption: a squared transmittance at half the depth is the same fiber."""
    color = np.array([0.8, 0.4, 0.1])
    once = shown(Hair(Color(color), False, 1.0, tangent=tangent()), transport=transport)
    twice = shown(Hair(Color(np.sqrt(color)), False, 2.0, tangent=tangent()), transport=transport)
    means = once.mean(axis=(0, 1))
    assert means[0] > means[1] > means[2] and means[0] < 0.95
    assert twice.mean(axis=(0, 1)) == pytest.approx(means, abs=0.04)


@pytest.mark.parametrize(("transport", "within"), [("rgb", 0.004), ("spectral", 0.04)])
def test_a_coat_changes_no_luminance_in_even_light(transport: str, within: float) -> None:
    """As in Cycles, a coat is drawn with another roughness than it has: luminance decides how often each lobe is.

    It is known for three channels, and about for the four wavelengths of a path.
    """
    color, of_rgb = Color(np.array([0.9, 0.1, 0.05])), np.array([0.2126, 0.7152, 0.0722])
    plain, coated = (
        shown(Hair(color, False, 1.0, 0.9, 0.4, coat, tangent=tangent()), transport=transport) @ of_rgb
        for coat in (0.0, 0.95)
    )
    assert plain.mean() < 0.9
    assert coated.mean() == pytest.approx(plain.mean(), rel=within)


def test_lobes_reflect_or_pass() -> None:
    """Either lobe alone gives back no more than it gets; light of the transmitted lobe passes the strand's own wall."""
    for transmits in (False, True):
        lobe = HairLobe(gray(1.0), transmits, 0.2, 0.4, 0.0, tangent())
        mean = shown(lobe).mean()
        assert 0.6 < mean <= 1.01, transmits


def test_a_wall_is_met_from_outside_only() -> None:
    """Without the mark of a strand the transmitted light meets the far wall and is scattered again."""
    lobe = HairLobe(gray(0.5), True, 0.1, 0.1, 0.0, tangent())
    through = shown(lobe)[3:5].mean()
    assert through == pytest.approx(0.5, abs=0.06)


def crossed(*, by_nearest: bool) -> np.ndarray:
    """Pixels of strands that lie within one another, beside and above a lamp; ``by_nearest``: shadow rays look for the
    nearest hit, since a small object far away casts no shadow.
    """
    turned = np.eye(4)[[1, 0, 2, 3]] * np.array([1.0, 1.0, -1.0, 1.0])
    moved = [matrix((0, 0, 0)), matrix((0, 0.3, 0.2)), matrix((0, -0.7, 0.1)), matrix((0, 0, 0.5)) @ turned]
    placed = [Instance(f"strand {k}", "strand", world, ("hair",)) for k, world in enumerate(moved)]
    if by_nearest:
        placed.append(Instance("clear", "strand", matrix((0, 900, 0), 0.01), ("hair",), hidden_from=Rays.SHADOW))
    scene = Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 5)), kind="orthographic", orthographic_scale=2.4),
        film=Film(16, 16, samples=256),
        meshes=(strand(),),
        materials=(Material("hair", Hair(Color(np.array([0.9, 0.7, 0.5])), False, tangent=tangent())),),
        instances=tuple(placed),
        lights=(
            PointLight(name="above", world_from_light=matrix((0.5, 1.5, 3)), power_w=100.0, radius=0.3),
            PointLight(name="below", world_from_light=matrix((-1, 0.5, -3)), power_w=300.0, radius=0.3),
        ),
        settings=RenderSettings(transport="rgb", max_bounces=8),
    )
    return render_scene(scene).pixels[..., :3].astype(np.float64)


def test_any_hit_tells_whether_light_comes_through_strands() -> None:
    """Also where strands overlap: light that starts within another strand passes its wall, as by the nearest hit."""
    short, long = crossed(by_nearest=False), crossed(by_nearest=True)
    assert long.min(axis=2).mean() > 0.01
    assert short.mean(axis=(0, 1)) == pytest.approx(long.mean(axis=(0, 1)), rel=2e-3)
    assert np.abs(short - long).mean() < 5e-3 * long.mean()
