# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that overlap, or lie in each other or in the world's medium, add up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.mitsuba_scene.media.around import overlapping_media
from spectral_core.scene import (
    Camera,
    Color,
    Emission,
    Film,
    Instance,
    Material,
    MediumGrid,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    Scene,
    World,
    gray,
)
from tests.render.media.test_medium import box
from tests.render.scenes import matrix

pytest.importorskip("mitsuba")

LAMP = PointLight(name="lamp", world_from_light=matrix((0.4, 0.1, 3.0)), power_w=300.0)


def scene(boxes, *, world=None, camera_z=4.0, lamps=(), samples=64, transport="rgb", bounces=8, shown=None):
    """A narrow view down the z axis through boxes: (low z, high z, medium).

    ``shown``: the numbers of the boxes in view; the others are far off, so that their pictures share a kernel.
    """
    instances = [
        Instance(f"box {k}", "box", placed(low, high, 4.0 + 0.1 * k), (f"medium {k}",))
        for k, (low, high, _) in enumerate(boxes)
    ]
    for k, instance in enumerate(instances):
        if shown is not None and k not in shown:
            instances[k] = replace(instance, world_from_object=matrix((500.0, 0, 0)) @ instance.world_from_object)
    return Scene(
        camera=Camera(world_from_camera=matrix((0.01, 0.02, camera_z)), field_of_view_rad=5e-4, near=1e-4),
        film=Film(8, 8, samples=samples),
        meshes=(box(),),
        materials=tuple(Material(f"medium {k}", None, medium) for k, (_, _, medium) in enumerate(boxes)),
        instances=tuple(instances),
        lights=lamps,
        world=world or World(color=gray(1.0)),
        settings=RenderSettings(transport=transport, max_bounces=bounces),
    )


def placed(low, high, width):
    """Matrix of the box around the z axis."""
    made = np.diag([width, width, high - low, 1.0])
    made[2, 3] = (low + high) / 2
    return made


def absorbing(rgb):
    """A medium that only absorbs."""
    return ScatteringMedium(1.0, gray(0.0), Color(np.array(rgb)))


RED, BLUE, GREEN = (0.1, 0.5, 0.6), (0.7, 0.4, 0.05), (0.4, 0.0, 0.3)


def seen(made):
    return render_scene(made).pixels[..., :3].mean((0, 1))


@pytest.mark.parametrize("second", [(-0.5, 1.5), (-0.4, 0.6), (-2.0, 0.3)], ids=["ahead", "nested", "behind"])
def test_absorption_adds_up_where_boxes_overlap(second):
    first = (-1.0, 1.0)
    depth = 2.0 * np.array(RED) + (second[1] - second[0]) * np.array(BLUE)
    made = scene([(*first, absorbing(RED)), (*second, absorbing(BLUE))])
    np.testing.assert_allclose(seen(made), np.exp(-depth), rtol=2e-3)


def test_the_medium_of_the_world_goes_on_in_objects():
    """Absorption of the world's medium would hide an infinite world: a lamp's floor ends the view."""
    made = scene([(-1.0, 1.0, absorbing(RED)), (-0.5, 1.5, absorbing(BLUE))])
    floor = Instance("wall", "box", placed(-2.2, -2.0, 5.0), ("wall",))
    made = replace(
        made, materials=(*made.materials, Material("wall", Emission(gray(1.0), 1.0))),
        instances=(*made.instances, floor), world=World(color=gray(0.0), medium=absorbing(GREEN)),
    )  # fmt: skip
    depth = 2.0 * np.array(RED) + 2.0 * np.array(BLUE) + 6.0 * np.array(GREEN)
    np.testing.assert_allclose(seen(made), np.exp(-depth), rtol=2e-3)


@pytest.mark.parametrize("camera_z", [0.2, 0.8])
def test_the_camera_may_be_in_several_media(camera_z):
    made = scene([(-1.0, 1.0, absorbing(RED)), (-1.5, 0.5, absorbing(BLUE))], camera_z=camera_z)
    depth = (camera_z + 1.0) * np.array(RED) + (min(camera_z, 0.5) + 1.5) * np.array(BLUE)
    np.testing.assert_allclose(seen(made), np.exp(-depth), rtol=2e-3)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_two_scattering_media_equal_their_sum(transport):
    """Two boxes, almost the same, against one whose coefficients and phase function are the sums."""
    colors = np.array([0.9, 0.6, 0.3]), np.array([0.4, 0.6, 0.9])
    one = ScatteringMedium(0.5, Color(colors[0]), anisotropy=0.6)
    two = ScatteringMedium(0.5, Color(colors[1]), anisotropy=-0.4)
    dark = World(color=gray(0.2))
    even = [replace(each, anisotropy=0.0) for each in (one, two)]
    mean = ScatteringMedium(1.0, Color((colors[0] + colors[1]) / 2))
    boxes = [(-1.0, 1.0, even[0]), (-1.003, 1.003, even[1]), (-1.0, 1.0, mean)]
    rest = {"lamps": (LAMP,), "world": dark, "samples": 1024, "transport": transport}
    added, mixed = (seen(scene(boxes, shown=shown, **rest)) for shown in ((0, 1), (2,)))
    # the mean of two upsampled colors is another spectrum than the upsampled mean
    np.testing.assert_allclose(added, mixed, rtol=0.02 if transport == "rgb" else 0.03)
    # where the colors are equal, so are the shares of the two phase functions at all wavelengths
    whole = ScatteringMedium(1.0, gray(0.6), lobes=((0.5, 0.6, 0.0), (0.5, -0.4, 0.0)))
    boxes = [
        (-1.0, 1.0, replace(one, color=gray(0.6))), (-1.003, 1.003, replace(two, color=gray(0.6))), (-1.0, 1.0, whole)
    ]  # fmt: skip
    alike, expected = (seen(scene(boxes, shown=shown, **rest)) for shown in ((0, 1), (2,)))
    np.testing.assert_allclose(alike, expected, rtol=0.02)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
@pytest.mark.parametrize("partner", ["even", "grid", "world"])
def test_a_grid_adds_up_with_other_media(transport, partner):
    """A grid of ones in another medium against one homogeneous medium of both densities."""
    color = Color(np.array([0.8, 0.6, 0.4]))
    thin = ScatteringMedium(0.4, color, anisotropy=0.3, emission_strength=0.05)
    thick = replace(thin, density=0.8, emission_strength=0.1)
    whole = replace(thin, density=1.2, emission_strength=0.15)
    in_world = World(color=gray(0.3), medium=replace(thin, emission_strength=0.0))
    dark = in_world if partner == "world" else World(color=gray(0.3))
    if partner == "world":
        whole = replace(whole, emission_strength=0.1, density=0.8)
    # the world's medium is in both pictures, around and in the box
    others = {"even": [(-1.003, 1.003, thin)], "grid": [(-1.003, 1.003, varied(thin))], "world": []}[partner]
    boxes = [(-1.0, 1.0, whole), (-1.0, 1.0, varied(thick)), *others]
    made = [
        scene(boxes, lamps=(LAMP,), world=dark, samples=1024, transport=transport, shown=shown)
        for shown in ((1, 2), (0,))
    ]
    one, two = map(seen, made)
    np.testing.assert_allclose(one, two, rtol=0.02)


def varied(medium):
    """The medium with a grid of ones around all of the boxes here."""
    world_from_index = np.diag([2.0, 2.0, 1.0, 1.0])
    world_from_index[:3, 3] = (-5.0, -5.0, -2.0)
    ones = np.ones((6, 6, 5), np.float32)
    return replace(medium, grid=MediumGrid(world_from_index, ones, ones, ones))


def test_boxes_that_touch_do_not_overlap_and_crowds_are_named():
    fog = absorbing(RED)
    assert overlapping_media(scene([(-1.0, 0.0, fog), (0.0, 1.0, fog)])) == (False, ())
    assert overlapping_media(scene([(-1.0, 0.1, fog), (0.0, 1.0, fog)])) == (True, ())
    overlap, crowded = overlapping_media(scene([(-1.0, 0.1, fog), (0.0, 1.0, fog), (-0.5, 0.5, fog)]))
    assert overlap and crowded == ("box 0", "box 1", "box 2")
    made = render_scene(scene([(-1.0, 0.1, fog), (0.0, 1.0, fog), (-0.5, 0.5, fog)], samples=1))
    assert any("more than two volumes" in note.message for note in made.notes)


def test_the_media_at_the_camera_are_found_with_the_same_kernel_for_each_border(monkeypatch):
    """A kernel that traces all borders before it took 100 s in a scene of 150 clouds."""
    import drjit

    from spectral_core.render.mitsuba_scene import assemble

    found, histories, search = [], [], assemble.media_at

    def watched(*given):
        drjit.kernel_history_clear()
        found.append(search(*given))
        histories.append(drjit.kernel_history())
        return found[-1]

    monkeypatch.setattr(assemble, "media_at", watched)
    boxes = [(-1.0 - 0.1 * k, 1.0 + 0.1 * k, absorbing(RED)) for k in range(12)]
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
        render_scene(scene(boxes, camera_z=0.0, samples=1))
    assert found == [(1, 2)]  # the first two boxes
    assert len({kernel["hash"] for kernel in histories[0] if "hash" in kernel}) <= 4
