# SPDX-License-Identifier: GPL-3.0-or-later
"""EXR files that another program wrote: whole ones pass, and one that ends earlier is refused wherever it ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.files.exr import require_whole_exr

OpenEXR = pytest.importorskip("OpenEXR")
COMPRESSIONS = [OpenEXR.NO_COMPRESSION, OpenEXR.ZIPS_COMPRESSION, OpenEXR.ZIP_COMPRESSION, OpenEXR.PIZ_COMPRESSION]
HEIGHT, WIDTH = 37, 5


def written(path: Path, compression: object, corner: int, parts: int) -> None:
    """Noise, whose chunks no compression makes small; ``corner``: first pixel of the data window."""
    rng = np.random.default_rng(3)
    window = np.array([corner, corner], np.int32), np.array([corner + WIDTH - 1, corner + HEIGHT - 1], np.int32)
    header = {"compression": compression, "type": OpenEXR.scanlineimage, "dataWindow": window}
    made = [
        OpenEXR.Part(dict(header), {"RGB": rng.random((HEIGHT, WIDTH, 3)).astype(np.float32)}, name=f"part {number}")
        for number in range(parts)
    ]
    OpenEXR.File(made).write(str(path))


@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("corner", [0, 50])
@pytest.mark.parametrize("compression", COMPRESSIONS, ids=str)
def test_a_file_that_ends_before_its_last_byte_is_refused(
    tmp_path: Path, compression: object, corner: int, parts: int
) -> None:
    path = tmp_path / "whole.exr"
    written(path, compression, corner, parts)
    require_whole_exr(path)
    content = path.read_bytes()
    ends = {0, 3, 8, len(content) - 1, *np.random.default_rng(1).integers(0, len(content), 60).tolist()}
    for end in ends:
        cut = tmp_path / "cut.exr"
        cut.write_bytes(content[:end])
        with pytest.raises(FileFormatError):
            require_whole_exr(cut)
