# SPDX-License-Identifier: GPL-3.0-or-later
"""Each check box of the panels of passes requests its pass."""

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
