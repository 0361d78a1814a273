# SPDX-License-Identifier: GPL-3.0-or-later
"""Each check box of the panels of passes requests its pass; passes that have the same name, and their sockets."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

TICKS = {
    "use_pass_emit": {"Emission"},
    "use_pass_environment": {"Environment"},
    "denoising_store_passes": {"Denoising Normal", "Denoising Albedo", "Denoising Depth"},
    "pass_debug_sample_count": {"Debug Sample Count"},
    "use_pass_volume_direct": {"Volume Direct"},
    "use_pass_volume_indirect": {"Volume Indirect"},
}


def asked(bpy):
    from blender_addon.translate.passes import passes_of

    return passes_of(bpy.context.scene, bpy.context.view_layer)


@pytest.mark.parametrize("tick", TICKS)
def test_a_check_box_requests_its_pass(blender, tick) -> None:
    layer = blender.context.view_layer
    for owner in (layer, layer.cycles):
        for each in TICKS:
            if hasattr(owner, each):
                setattr(owner, each, False)
    before = asked(blender)
    names = set() if before is None else set(before.names)
    setattr(layer if hasattr(layer, tick) else layer.cycles, tick, True)
    assert set(asked(blender).names) - names == TICKS[tick]


def test_the_alpha_threshold_is_translated(blender) -> None:
    layer = blender.context.view_layer
    layer.use_pass_z, layer.pass_alpha_threshold = True, 0.25
    assert asked(blender).alpha_threshold == 0.25


def test_an_aov_that_has_the_name_of_another_pass_takes_its_place(blender) -> None:
    """As with Cycles; renders ended in a TypeError. Later light groups and switches are not checked against AOVs."""
    from blender_addon.translate.passes import pass_notes, slots_of

    scene, layer = blender.context.scene, blender.context.view_layer
    for name in ("Combined_key", "Noisy Image"):
        aov = layer.aovs.add()
        aov.name, aov.type = name, "COLOR"
        assert aov.is_valid
    assert pass_notes(layer) == ()
    for name in ("key", "fill"):
        layer.lightgroups.add(name=name)
    scene.spectral.render.denoise = True
    names = [slot.name for slot in slots_of(asked(blender))]
    assert sorted(names) == ["Combined_fill", "Combined_key", "Noisy Image"]
    assert {note.message.split("'")[1] for note in pass_notes(layer)} == {"Combined_key", "Noisy Image"}


def test_the_noisy_picture_has_a_socket_in_the_compositor_only_while_denoising_is_on(blender) -> None:
    scene, tree = blender.context.scene, blender.data.node_groups.new("Composite", "CompositorNodeTree")
    if not hasattr(scene, "compositing_node_group"):
        pytest.skip("before Blender 5 the tree is the scene's own")
    scene.render.engine, scene.compositing_node_group = "SPECTRAL", tree
    outputs = tree.nodes.new("CompositorNodeRLayers").outputs
    for is_on in (False, True, False):
        scene.spectral.render.denoise = is_on
        assert any(each.name == "Noisy Image" and each.enabled for each in outputs) == is_on
