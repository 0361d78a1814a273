# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's files and scene use the same names for its glazes."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def test_ground_and_mark_have_the_same_names_in_the_scene_and_in_the_files(blender, tmp_path: Path) -> None:
    from blender_addon.translate.spectra.stored import spectrum_of
    from examples.demo import materials, run, still_life
    from spectral_core.spectra.files import read_spectra

    still_life.build(blender)
    solution = run._design(blender, tmp_path)
    nodes = blender.data.materials[materials.VASE].node_tree.nodes
    in_file = {spectrum.name: spectrum for spectrum in read_spectra(tmp_path / "glazes.csv")}

    for name, node in (("ground", materials.GROUND), ("mark", materials.MARK)):
        np.testing.assert_allclose(spectrum_of(nodes[node]).values, in_file[name].values, atol=1e-6)
    ground, mark = solution.actual_linear_rgb[:, 1]
    assert ground[0] > 2 * mark[0]
