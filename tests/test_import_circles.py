# SPDX-License-Identifier: GPL-3.0-or-later
"""No module imports itself through others; imports within functions count."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter

import pytest

grimp = pytest.importorskip("grimp", reason="needs import-linter: pip install 'spectral-scene[dev]'")

SWITCHED_ON = [("blender_addon.commands._blend", "blender_addon")]
"""Outside Blender the command line enables the add-on; inside Blender the add-on registers the command line."""


@pytest.mark.parametrize("package", ["blender_addon", "spectral_core"])
def test_no_import_circle(package):
    graph = grimp.build_graph(package, exclude_type_checking_imports=True, cache_dir=None)
    for importer, imported in SWITCHED_ON:
        if importer in graph.modules:
            graph.remove_import(importer=importer, imported=imported)
    order = TopologicalSorter({name: graph.find_modules_directly_imported_by(name) for name in graph.modules})
    try:
        order.prepare()
    except CycleError as error:
        pytest.fail(" → ".join(error.args[1]))
