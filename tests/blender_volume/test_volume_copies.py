# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of a Volume: each has separate curves, whoever changes them; a lost curve is reported."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.translate.volume_looks import curves as stored  # noqa: E402
from blender_addon.translate.volume_looks.transfer import stated_transfer  # noqa: E402
from spectral_core.errors import InvalidInputError  # noqa: E402
from tests.blender_volume.test_volume_objects import _openvdb, imported, translated  # noqa: E402, F401 - a fixture

HALF = ([0.0, 0.5, 1.0], [0.0, 1.0, 0.0])


@pytest.fixture
def pair(blender: Any) -> tuple[Any, Any]:
    """A Volume with a material, and its copy; neither is in a scene, so that no update separates them."""
    first = bpy.data.volumes.new("first")
    stored.set_curve(first, stored.add_material(first, "bone"), "density", *HALF)
    second = first.copy()
    assert second.spectral.curves == first.spectral.curves
    return first, second


def points(volume: Any, number: int = 0) -> Any:
    """Positions and heights of a material's density curve."""
    return np.array(stored.curve_points(volume, volume.spectral.materials[number], "density"))


def test_a_preset_on_a_copy_leaves_the_original_as_it_is(blender: Any, ramp: Any) -> None:
    first = imported(ramp[0], preset="wide")
    second = first.copy()
    second.data = first.data.copy()
    bpy.context.collection.objects.link(second)
    bpy.context.view_layer.objects.active = second
    before = stated_transfer(first.data).transfer
    assert bpy.ops.spectral.transfer_preset(preset="opaque") == {"FINISHED"}
    after = stated_transfer(first.data).transfer
    assert after.names == before.names != stated_transfer(second.data).transfer.names
    for old, new in zip(before.materials, after.materials, strict=True):
        assert np.array_equal(old.values, new.values) and np.array_equal(old.extinction, new.extinction)
    assert len(second.data.spectral.curves.nodes) == len(second.data.spectral.materials)


def test_materials_of_a_copy_are_removed_without_the_originals(pair: Any) -> None:
    first, second = pair
    stored.clear(second)
    assert np.allclose(points(first), HALF)
    assert len(second.spectral.curves.nodes) == 0


def test_a_changed_curve_of_the_original_stays_as_it_was_in_the_copy(pair: Any) -> None:
    first, second = pair
    stored.set_curve(first, first.spectral.materials[0], "density", [0.0, 1.0], [1.0, 0.0])
    assert np.allclose(points(first), ([0.0, 1.0], [1.0, 0.0])) and np.allclose(points(second), HALF)


def test_new_materials_of_original_and_copy_have_curves_of_their_own(pair: Any) -> None:
    for volume, end in zip(pair, (0.25, 0.75), strict=True):
        stored.set_curve(volume, stored.add_material(volume, "skin"), "density", [0.0, end], [1.0, 0.0])
    assert [points(volume, 1)[0, 1] for volume in pair] == pytest.approx([0.25, 0.75])
    assert all(np.allclose(points(volume), HALF) for volume in pair)


def test_the_curves_of_one_volume_are_not_copied(blender: Any) -> None:
    volume = bpy.data.volumes.new("only")
    entry = stored.add_material(volume, "bone")
    tree = volume.spectral.curves
    tree.use_fake_user = True
    stored.set_curve(volume, entry, "density", *HALF)
    bpy.context.collection.objects.link(bpy.data.objects.new("only", volume))
    bpy.context.view_layer.update()
    assert volume.spectral.curves == tree and len(bpy.data.node_groups) == 1


def test_widgets_change_the_curve_of_their_volume_alone(pair: Any) -> None:
    """They write to the node that the panel shows, so an update of the scene separates a copy before."""
    for volume in pair:
        bpy.context.collection.objects.link(bpy.data.objects.new(volume.name, volume))
    bpy.context.view_layer.update()
    first, second = pair
    assert first.spectral.curves != second.spectral.curves
    stored.curve_node(second, second.spectral.materials[0], "density").mapping.curves[0].points[1].location = (0.25, 1)
    assert points(second)[0, 1] == pytest.approx(0.25)
    assert np.allclose(points(first), HALF)


def test_a_lost_curve_of_the_density_is_reported_and_can_be_drawn_anew(blender: Any, ramp: Any) -> None:
    data = imported(ramp[0], preset="wide").data
    entry = data.spectral.materials[data.spectral.active]
    data.spectral.curves.nodes.remove(stored.curve_node(data, entry, "density"))
    with pytest.raises(
        InvalidInputError, match=f"the density curve of material '{entry.name}' of volume '{data.name}'"
    ):
        stored.curve_points(data, entry, "density")
    data.update_tag()
    scene = translated()
    assert scene.volumes == () and any("is lost; press Draw its Curve" in note.message for note in scene.notes)
    assert bpy.ops.spectral.volume_curve_add(which="density") == {"FINISHED"}
    assert len(translated().volumes) == 1
