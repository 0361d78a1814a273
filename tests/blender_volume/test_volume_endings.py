# SPDX-License-Identifier: GPL-3.0-or-later
"""The importer offers every volume format that the core reads: in its file browser, menu, tooltip and for drops."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.operators import volume_files  # noqa: E402
from spectral_core.volume.files import known_formats  # noqa: E402

ENDINGS = {ending for known in known_formats() for ending in known.extensions}


def test_the_file_browser_shows_every_ending(blender):
    shown = bpy.ops.spectral.volume_import.get_rna_type().properties["filter_glob"].default
    assert {f"*{ending}" for ending in ENDINGS} == set(shown.split(";"))
    assert {".hdr", ".img", ".bin"} <= ENDINGS


def test_files_can_be_dropped_unless_blender_opens_them(blender):
    dropped = set(volume_files.SPECTRAL_FH_volume.bl_file_extensions.split(";"))
    assert ENDINGS - dropped == {".vdb", ".tif", ".tiff", ".hdr", ".nii.gz"}
    assert dropped < ENDINGS


def test_menu_and_tooltip_name_every_format(blender):
    drawn = []
    layout = SimpleNamespace(operator=lambda _, text: drawn.append(text))
    volume_files._import_entry(SimpleNamespace(layout=layout), bpy.context)
    tooltip = bpy.ops.spectral.volume_import.get_rna_type().description
    for known in known_formats():
        assert known.extensions[0] in drawn[0]
        assert known.description in tooltip
