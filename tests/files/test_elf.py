# SPDX-License-Identifier: GPL-3.0-or-later
"""A Python module that contains OpenEXR, in a program that shares another version with all its modules."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from spectral_core.files.elf import calls_itself, made_to_call_itself

pytest.importorskip("OpenEXR")
pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="libraries of Linux")
ROOT = Path(__file__).resolve().parents[2]

SHARED = """
#include <stdlib.h>
void exr_get_library_version(int *major, int *minor, int *patch, const char **extra) {
    *major = 3; *minor = 1; *patch = 13;
}
int exr_start_read() { abort(); }
int exr_start_write() { abort(); }
"""
PROGRAM = """
import ctypes, sys
sys.path[:0] = [{modules!r}, {root!r}]
ctypes.CDLL({library!r}, ctypes.RTLD_GLOBAL)
from pathlib import Path
import numpy as np
from spectral_core.errors import MissingDependencyError
from spectral_core.files.exr import openexr, read_exr
try:
    module = openexr()
except MissingDependencyError as error:
    sys.exit(f"REFUSED {{error}}")
header = {{"type": module.scanlineimage, "compression": module.ZIP_COMPRESSION}}
module.File(header, {{"Y": np.ones((2, 3), np.float32)}}).write({picture!r})
print("READ", read_exr(Path({picture!r}))[0].channels["Y"].pixels.shape)
"""


def used_beside_another(folder: Path, modules: Path) -> subprocess.CompletedProcess[str]:
    """A program with another OpenEXR whose reader and writer end the process."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler")
    (folder / "shared.c").write_text(SHARED)
    library = folder / "libshared.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-o", library, folder / "shared.c"], check=True)
    code = PROGRAM.format(
        modules=str(modules), root=str(ROOT), library=str(library), picture=str(folder / "picture.exr")
    )
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)


def module_file() -> Path:
    found = importlib.util.find_spec("OpenEXR")
    assert found is not None
    assert found.origin is not None
    return Path(found.origin)


def test_a_module_that_would_call_another_openexr_is_refused(tmp_path: Path) -> None:
    done = used_beside_another(tmp_path, tmp_path / "none")
    assert done.returncode == 1
    assert "cannot be used beside OpenEXR 3.1.13" in done.stderr


def test_a_module_that_calls_its_own_openexr_reads_and_writes(tmp_path: Path) -> None:
    modules = tmp_path / "modules"
    modules.mkdir()
    original = module_file()
    (modules / original.name).write_bytes(made_to_call_itself(original.read_bytes()))
    assert calls_itself(modules / original.name)
    assert not calls_itself(original)
    done = used_beside_another(tmp_path, modules)
    assert "READ (2, 3)" in done.stdout, done.stderr


def test_a_file_without_a_dynamic_section_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.so").write_bytes(b"no library")
    assert not calls_itself(tmp_path / "a.so")
    with pytest.raises(ValueError, match="no 64-bit ELF library"):
        made_to_call_itself(b"no library")
