# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension zip: built, checked by Blender's validator, installed into an empty profile, and used."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
pytest.importorskip("bpy")

INSIDE = """
import json, sys
sys.path[:] = [path for path in sys.path if path not in ("", {root!r})]
import bpy
bpy.ops.extensions.package_install_files(filepath={package!r}, repo="user_default", enable_on_install=True)
import addon_utils, os, spectral_core
from spectral_core.llvm_library import find_llvm
from spectral_core.palette import presets, solve_palette
scene = bpy.context.scene
scene.render.engine = "SPECTRAL"
scene.render.resolution_x, scene.render.resolution_y = 16, 12
scene.spectral.render.samples = 1
scene.render.filepath = {picture!r}
answer = {{
    "core": spectral_core.__file__,
    "llvm": find_llvm()[0] if sys.platform == "linux" else None,
    "recipe": list(bpy.ops.spectral.recipe_find()),
    "status": str(solve_palette(presets.hidden_mark()).status),
    "rendered": list(bpy.ops.render.render(write_still=True)),
    "violations": [str(item) for item in getattr(addon_utils, "_extensions_warnings", {{}}).values()],
}}
bpy.ops.preferences.addon_disable(module="bl_ext.user_default.spectral_scene")
kinds = (bpy.types.Scene, bpy.types.Material, bpy.types.Light)
answer["left_behind"] = [kind.__name__ for kind in kinds if hasattr(kind, "spectral")]
print("ANSWER " + json.dumps(answer))
"""


@pytest.fixture(scope="module")
def package() -> Path:
    """The zip with wheels for this Python only."""
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    build = [sys.executable, "scripts/build_extension.py", "--python", version, "--name", "test"]
    done = subprocess.run(build, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "passes Blender's validator" in done.stdout
    (built,) = (ROOT / "dist").glob("test-*.zip")
    return built


@pytest.mark.slow
@pytest.mark.timeout(1800)  # a limit against hanging: the build downloads and packs 180 MB
def test_the_zip_installs_solves_renders_and_is_removed_completely(package: Path, tmp_path: Path) -> None:
    picture = tmp_path / "picture.png"
    code = INSIDE.format(root=str(ROOT), package=str(package), picture=str(picture))
    for name in ("DRJIT_LIBLLVM_PATH", "SPECTRAL_SCENE_LLVM"):
        os.environ.pop(name, None)
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "profile"), "PYTHONPATH": ""}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path,
                          env=environment)  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.startswith("ANSWER ")]
    assert lines, done.stdout + done.stderr
    answer = json.loads(lines[0].removeprefix("ANSWER "))

    assert answer["core"].startswith(str(tmp_path / "profile"))
    assert answer["status"] == "solved"
    assert answer["recipe"] == ["FINISHED"], "a lamp's color rendering is measured by what the zip carries"
    if sys.platform == "linux":
        assert answer["llvm"].startswith(str(tmp_path / "profile")), "the zip carries an LLVM, and it comes first"
    assert answer["rendered"] == ["FINISHED"]
    assert answer["violations"] == []
    assert answer["left_behind"] == []
    assert picture.stat().st_size > 0
