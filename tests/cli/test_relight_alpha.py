# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of ``relight`` are as transparent as the film was, as those of F12 and of the dial are."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import Transport
from spectral_core.render.relight.transport_file import write_transport

OpenEXR = pytest.importorskip("OpenEXR", reason="needs OpenEXR: pip install 'spectral-scene[render]'")
COVERAGE = np.array([[1.0, 0.5], [0.25, 0.0]], np.float32)
"""Row 0 at the bottom."""


def recorded(path: Path, coverage: np.ndarray) -> Path:
    """A recording of one white light of linear value 0.5 where the film is covered."""
    channels = np.full((1, 3, 2, 2), 0.5, np.float32) * coverage
    write_transport(path, Transport(MixtureStorage(), ("Key",), channels, coverage, (None,), 1.0, "0" * 64, 1, 0))
    return path


def bytes_of_png(path: Path) -> np.ndarray:
    """Pixels (height, width, channels) of an unfiltered PNG of 8 bits, row 0 on top."""
    data = path.read_bytes()
    width, height, _, kind = struct.unpack(">IIBB", data[16:26])
    rows = np.frombuffer(zlib.decompress(data[data.index(b"IDAT") + 4 :]), np.uint8).reshape(height, -1)
    return rows[:, 1:].reshape(height, width, {2: 3, 6: 4}[kind])


def test_a_transparent_film_stays_transparent(tmp_path: Path) -> None:
    """The picture was black where nothing is, and darker at the edges of objects."""
    recording = recorded(tmp_path / "t.exr", COVERAGE)
    for name in ("p.png", "p.exr", "p.npy"):
        assert main(["relight", str(recording), "--mix", "Key=2", "--out", str(tmp_path / name)]) == 0
    shown = bytes_of_png(tmp_path / "p.png")
    np.testing.assert_array_equal(shown[..., 3], [[64, 0], [255, 128]])
    np.testing.assert_array_equal(shown[..., :3][shown[..., 3] > 0], 255)  # the whole light of what covers a pixel
    found = OpenEXR.File(str(tmp_path / "p.exr"), separate_channels=True).channels()
    for channel in "RGBA":
        np.testing.assert_array_equal(found[channel].pixels, COVERAGE[::-1])
    assert np.load(tmp_path / "p.npy").shape == (2, 2, 3)


def test_an_opaque_film_has_no_alpha(tmp_path: Path) -> None:
    recording = recorded(tmp_path / "t.exr", np.ones((2, 2), np.float32))
    for name in ("p.png", "p.exr"):
        assert main(["relight", str(recording), "--out", str(tmp_path / name)]) == 0
    assert bytes_of_png(tmp_path / "p.png").shape == (2, 2, 3)
    assert "A" not in OpenEXR.File(str(tmp_path / "p.exr"), separate_channels=True).channels()
