# SPDX-License-Identifier: GPL-3.0-or-later
"""An update of the extension while Blender runs: modules of the earlier version are not used with the new one."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

START = Path(__file__).parents[2] / "blender_addon" / "__init__.py"


def imported_as(name: str) -> None:
    """Execute the extension's file as Blender does."""
    spec = importlib.util.spec_from_file_location(name, START)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)


def test_an_updated_extension_imports_its_own_core() -> None:
    name = "bl_ext.user_default.spectral_scene"
    kept = dict(sys.modules)
    try:
        for earlier in ("spectral_core", "spectral_core.errors", f"{name}.engine", f"{name}_other", "spectral_core_x"):
            sys.modules[earlier] = ModuleType(earlier)
        imported_as(name)
        assert not {"spectral_core", "spectral_core.errors", f"{name}.engine"} & set(sys.modules)
        assert {name, f"{name}_other", "spectral_core_x"} <= set(sys.modules)
    finally:
        sys.modules.clear()
        sys.modules.update(kept)


def test_reloaded_scripts_find_no_earlier_modules() -> None:
    """Reload Scripts keeps the namespace of the package; its class was registered without a module, a NameError."""
    name = "bl_ext.user_default.spectral_scene"
    kept = dict(sys.modules)
    try:
        imported_as(name)
        package = sys.modules[name]
        for module in ("registration", "panels", "panels.dial"):
            sys.modules[f"{name}.{module}"] = ModuleType(module)
        package.registration = sys.modules[f"{name}.registration"]  # type: ignore[attr-defined]
        package.panels = sys.modules[f"{name}.panels"]  # type: ignore[attr-defined]
        assert package.__spec__ is not None and package.__spec__.loader is not None
        package.__spec__.loader.exec_module(package)  # as importlib.reload does
        assert not hasattr(package, "registration") and not hasattr(package, "panels")
        assert callable(package.register) and not [each for each in sys.modules if each.startswith(f"{name}.")]
    finally:
        sys.modules.clear()
        sys.modules.update(kept)


def test_a_checkout_keeps_its_modules() -> None:
    import spectral_core.errors

    kept = dict(sys.modules)
    try:
        imported_as("blender_addon_again")
        assert sys.modules["spectral_core.errors"] is spectral_core.errors
    finally:
        sys.modules.clear()
        sys.modules.update(kept)
