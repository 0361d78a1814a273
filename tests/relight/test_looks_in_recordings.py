# SPDX-License-Identifier: GPL-3.0-or-later
"""The exposure and adaptation of a scene's look in its recording: files, pictures and pages have them, as renders."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.exr import exr_headers
from spectral_core.render.relight.mix import LiveMix, relight
from spectral_core.render.relight.page import write_page
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import Transport
from spectral_core.render.relight.transport_file import read_transport, write_transport
from spectral_core.scene.look import Look
from spectral_core.spectra.catalogue import illuminant

pytest.importorskip("OpenEXR")
LOOK = Look(spectrum=illuminant("A"), exposure_stops=1.5, adapts=True).picture_matrix


@pytest.fixture
def transport(rng: np.random.Generator) -> Transport:
    channels = rng.uniform(0, 1, (2, 3, 4, 6)).astype(np.float32)
    return Transport(
        MixtureStorage(), ("Key", "Fill"), channels, np.full((4, 6), 0.5, np.float32), (None, None), 0.5, "h", 1, 0,
        look=LOOK,
    )  # fmt: skip


def test_a_relit_picture_is_exposed_and_adapted_as_renders_are(transport: Transport, tmp_path: Path) -> None:
    write_transport(tmp_path / "t.exr", transport)
    read = read_transport(tmp_path / "t.exr")
    assert read.look is not None
    np.testing.assert_array_equal(read.look, LOOK)
    linear = 0.5 * (0.25 * transport.channels[0] + transport.channels[1])
    expected = np.einsum("ij,jhw->hwi", LOOK, linear)
    found = relight(read, mix={"Key": 0.25})
    np.testing.assert_allclose(found[..., :3], expected, rtol=2e-6, atol=1e-6)
    np.testing.assert_array_equal(found[..., 3], 0.5)
    # the dial in Blender shows it with the present look instead
    np.testing.assert_allclose(LiveMix(read).picture((0.25, 1.0))[..., :3], np.moveaxis(linear, 0, 2), rtol=2e-6)

    out = tmp_path / "out.npy"
    assert main(["relight", str(tmp_path / "t.exr"), "--mix", "Key=0.25", "--out", str(out)]) == 0
    np.testing.assert_allclose(np.load(out)[::-1], expected, rtol=2e-6, atol=1e-6)


def test_a_page_has_the_look(transport: Transport, tmp_path: Path) -> None:
    write_page(tmp_path / "page.html", transport)
    half = re.search(r'"half": "([^"]+)"', (tmp_path / "page.html").read_text("utf-8"))
    assert half is not None
    layers = np.frombuffer(base64.b64decode(half[1]), np.float16).reshape(2, 4, 6, 3)
    expected = np.einsum("ij,ghwj->ghwi", LOOK, 0.5 * np.moveaxis(transport.channels, 1, 3))
    np.testing.assert_allclose(layers, expected, rtol=1e-3, atol=1e-3)


def test_a_scene_without_a_look_has_the_file_of_before(transport: Transport, tmp_path: Path) -> None:
    plain = replace(transport, look=np.eye(3))
    assert plain.look is None
    write_transport(tmp_path / "t.exr", plain)
    assert "look" not in json.loads(exr_headers(tmp_path / "t.exr")[0]["spectralSceneTransport"])
    with pytest.raises(InvalidInputError, match="the matrix of a look"):
        replace(transport, look=np.zeros((3, 2)))


def test_a_damaged_look_is_refused(transport: Transport, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("spectral_core.render.relight.transport_file._meaning", _with_look([[1.0, 2.0], [3.0]]))
    write_transport(tmp_path / "t.exr", transport)
    monkeypatch.undo()
    with pytest.raises(FileFormatError, match="its header was edited or damaged"):
        read_transport(tmp_path / "t.exr")


def _with_look(entry: object) -> Callable[[Transport], dict[str, Any]]:
    from spectral_core.render.relight.transport_file import _meaning

    return lambda transport: {**_meaning(transport), "look": entry}
