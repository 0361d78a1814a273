# SPDX-License-Identifier: GPL-3.0-or-later
"""A view follows a change of every setting that the translation reads, with nothing but Blender's report of it."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.translate.ledger import entries  # noqa: E402
from tests.blender.conftest import build, builders  # noqa: E402, F401
from tests.blender.node_walk import Bench, names_of  # noqa: E402
from tests.blender.test_settings_are_read import CASES  # noqa: E402
from tests.blender_viewport.edits.test_viewport_edits import updated, whole  # noqa: E402
from tests.settings_walk import fingerprint, other_rna, read_rna  # noqa: E402

UNREPORTED = {
    ("object", "lightgroup"), ("world", "lightgroup"),
    *((f"ShaderNode{name}Curve", f"mapping.{setting}") for name in ("RGB", "Float") for setting in (
        "clip_min_x", "clip_max_x", "curves[0].points[0].handle_type", "curves[0].points[0].location",
    )),
}  # fmt: skip
"""Settings whose change by a script Blender reports to no engine; a view shows it after the next edit."""
UNREPORTED_CASES = ("light paths", "lamp in Cycles", "world in Cycles")
"""Cases whose every setting is one of Cycles, of which Blender reports none."""
IN_ANOTHER_WAY = ("matrix_basis", "matrix_local", "matrix_parent_inverse", "matrix_world", "parent_type", "use_nodes")
"""Settings without another value that any object or material can have."""


def outdated(stage, block=None):
    """The parts of the sent scene that differ from a full translation, and this translation.

    ``block``: evaluated again, as for F12, if Blender does not report each change of it; its copy has those that are
    reported.
    """
    from spectral_core.render.live.in_place.changes import difference

    if block is not None:
        block.update_tag()
        bpy.context.view_layer.update()  # the view is not told
    true = whole(stage)
    left = difference(next(iter(stage.link.scenes.values())), true)
    return [*left.items, *(single for single in left.singles if single not in ("film", "notes"))], true


@pytest.mark.parametrize("name", CASES)
def test_settings_of_data_blocks(build, stage, name):  # noqa: F811
    case = CASES[name]
    owner = case.made(build)
    for first, value in case.first.items():
        setattr(owner, first, value)
    updated(stage)
    listed = entries()[case.kind].read | set(entries()[case.kind].noted)
    declared = {each.identifier: each for each in owner.bl_rna.properties if not each.is_readonly}
    stale = set()
    for setting in sorted(listed & declared.keys() - set(IN_ANOTHER_WAY)):
        if declared[setting].type == "POINTER":
            continue
        kept = read_rna(owner, setting)
        for value in (case.others.get(setting) or other_rna(owner, setting), kept):
            updated(stage, lambda _stage, setting=setting, value=value: setattr(owner, setting, value))
            if outdated(stage, owner.id_data)[0]:
                stale.add((name, setting))
                updated(stage, lambda _stage: owner.id_data.update_tag())
    if name not in UNREPORTED_CASES:
        assert stale <= UNREPORTED


def test_settings_of_shader_nodes(coarse):
    stage = coarse
    bpy.data.objects.remove(bpy.data.objects["Floor"])
    updated(stage)
    stale, seen = set(), 0
    for name in sorted(each for each in entries() if each.startswith("ShaderNode") and hasattr(bpy.types, each)):
        try:
            bench = Bench.of(name)
        except RuntimeError:  # a node of worlds or lamps
            continue
        bpy.data.objects["Ball"].data.materials[0] = bench.owner
        changing = ""

        def translated(name=name, bench=bench):
            updated(stage)
            parts, true = outdated(stage, bench.owner)
            if parts:
                stale.add((name, changing))  # noqa: B023
            return fingerprint(true.materials)

        bench.translated = translated
        for changing in sorted(names_of(bench)):
            seen += bench.changes(changing, varying=False)
        bpy.data.objects["Ball"].data.materials[0] = stage.material
        bench.remove()
    assert seen > 300
    assert stale <= UNREPORTED
