# SPDX-License-Identifier: GPL-3.0-or-later
"""Two copies of the extension in one process: a command of the sources in a Blender that enables the installed one."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CODE = """
import bpy
import addon_utils, installed_copy

{enable}
import blender_addon
from blender_addon import jobs

blender_addon.register_once()
scene = bpy.context.scene
scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "SPECTRAL", 8, 8
caught = []


def stop(translated):
    caught.append(translated)
    raise RuntimeError("only the scene")


with jobs.request(jobs.RenderRequest(translated=stop)):
    try:
        bpy.ops.render.render()
    except RuntimeError:
        pass
print("CAUGHT", len(caught), addon_utils.check("installed_copy")[1])
"""
SECOND = """
import bpy
import addon_utils, blender_addon

blender_addon.register()
print("ENABLED", addon_utils.enable("installed_copy") is not None)
print("USED", bpy.ops.spectral.palette_preset(preset="HIDDEN_MARK"))
blender_addon.unregister()
print("LEFT", hasattr(bpy.types.Scene, "spectral"))
print("AFTER", addon_utils.enable("installed_copy") is not None)
"""


@pytest.mark.parametrize("enable", ["installed_copy.register()", "addon_utils.enable('installed_copy')"])
def test_requests_reach_the_engine_of_the_copy_that_is_asked(tmp_path: Path, enable: str) -> None:
    """The engine of the other copy answered: a sweep's points ended with "Blender did not start the render"."""
    done = _with_two_copies(tmp_path, CODE.format(enable=enable))
    assert done.returncode == 0, done.stderr
    assert "CAUGHT 1 False" in done.stdout, done.stdout + done.stderr


def test_a_second_copy_is_refused_and_the_first_one_stays_whole(tmp_path: Path) -> None:
    """It took the classes of the first copy, which could then not be disabled."""
    done = _with_two_copies(tmp_path, SECOND)
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    for line in ("ENABLED False", "USED {'FINISHED'}", "LEFT False", "AFTER True"):
        assert line in done.stdout, said
    assert "another copy of Spectral Scene Design is enabled, as blender_addon" in said


@pytest.mark.parametrize("register", ["register", "register_once"])
def test_a_script_may_import_the_extension_before_bpy(tmp_path: Path, register: str) -> None:
    """bpy from PyPI puts Blender's own modules on the path when it is imported; one was imported before it."""
    pytest.importorskip("bpy")
    code = f"import blender_addon; blender_addon.{register}(); import bpy; print(bpy.context.scene.spectral.palette)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)}, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def _with_two_copies(folder: Path, code: str) -> subprocess.CompletedProcess[str]:
    """Run ``code`` where the sources are "blender_addon" and a copy of them is "installed_copy"."""
    pytest.importorskip("bpy")
    shutil.copytree(ROOT / "blender_addon", folder / "installed_copy", ignore=shutil.ignore_patterns("__pycache__"))
    paths = os.pathsep.join([str(ROOT), str(folder)])
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=folder,
        env={**os.environ, "PYTHONPATH": paths}, timeout=120, check=False,
    )  # fmt: skip
