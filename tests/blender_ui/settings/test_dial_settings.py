# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting of the light dial reaches the core, without a render."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.dial.live import shares_of, weights_of  # noqa: E402
from blender_addon.properties.dial import STORAGE  # noqa: E402
from blender_addon.translate.dial import storage_name, storage_of  # noqa: E402


@pytest.fixture
def dial(blender):
    dial = blender.context.scene.spectral.dial
    for place in ((0.0, 1.0), (0.9, -0.5), (-0.9, -0.5)):
        dial.bulbs.add().place = place
    return dial


def test_selector_bulbs_switches_and_intensity_make_the_weights(dial) -> None:
    dial.selector = dial.bulbs[1].place
    assert list(shares_of(dial)) == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    dial.bulbs[2].place, dial.bulbs[1].place = dial.bulbs[1].place[:], dial.bulbs[2].place[:]
    assert list(shares_of(dial)) == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)
    dial.selector = (0.1, 0.2)
    dial.bulbs[0].is_on = False
    assert shares_of(dial)[0] == 0.0 and shares_of(dial).sum() == pytest.approx(1.0)
    dial.intensity = 2.5
    assert weights_of(dial) == pytest.approx(2.5 * shares_of(dial))


def test_each_storage_of_the_panel_is_one_of_the_core(dial) -> None:
    names = set()
    for identifier, name, *_ in STORAGE:
        dial.storage = identifier
        assert storage_name(storage_of(dial)) == name
        names.add(tuple(storage_of(dial).channel_names()))
    assert len(names) == len(STORAGE)
