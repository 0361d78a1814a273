# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of other programs, whole and cut: Blender writes a part of one on a full disk, and reports no error."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, FileWriteError
from spectral_core.files.whole_picture import require_whole_picture, require_written

KINDS: list[tuple[str, dict[str, Any]]] = [
    ("a.png", {}), ("a.png", {"optimize": True}), ("a.jpg", {"quality": 90}), ("a.jpg", {"progressive": True}),
    ("a.tif", {}), ("a.tif", {"compression": "tiff_lzw"}), ("a.tif", {"compression": "tiff_deflate"}),
]  # fmt: skip


def made(path: Path, options: dict[str, Any]) -> bytes:
    """A picture of noise by Pillow, or an EXR by OpenEXR."""
    noise = np.random.default_rng(4).integers(0, 255, (37, 53, 3), np.uint8)
    if path.suffix == ".exr":
        openexr = pytest.importorskip("OpenEXR", reason="needs OpenEXR: pip install 'spectral-scene[render]'")
        header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
        openexr.File(header, {"RGB": noise.astype(np.float32)}).write(str(path))
    else:
        image = pytest.importorskip("PIL.Image", reason="needs Pillow: pip install 'spectral-scene[explore]'")
        image.fromarray(noise).save(path, **options)
    return path.read_bytes()


@pytest.mark.parametrize(("name", "options"), [*KINDS, ("a.exr", {})])
def test_every_cut_is_detected(tmp_path: Path, name: str, options: dict[str, Any]) -> None:
    path = tmp_path / name
    whole = made(path, options)
    require_whole_picture(path)
    require_written(path)
    for length in {*range(0, len(whole), 61), *range(40), len(whole) - 1, len(whole) - 12}:
        path.write_bytes(whole[:length])
        with pytest.raises(FileFormatError, match=f"{name} (is truncated|is empty|is no EXR)"):
            require_whole_picture(path)


def test_a_temporary_picture_that_was_not_written_is_told_with_its_folder(tmp_path: Path) -> None:
    with pytest.raises(FileWriteError, match=f"is the disk of {tmp_path} full"):
        require_written(tmp_path / "absent.png")
    (tmp_path / "empty.png").touch()
    with pytest.raises(FileWriteError, match="TMPDIR"):
        require_written(tmp_path / "empty.png")


def test_a_text_is_no_picture(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("not a picture at all")
    with pytest.raises(FileFormatError, match=r"a.png is no EXR file"):
        require_whole_picture(tmp_path / "a.png")
