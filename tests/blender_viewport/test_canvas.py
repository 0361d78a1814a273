# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of a view as the graphics card gets them, and texts over it."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from blender_addon.drawing.covered import Covered
from blender_addon.drawing.viewport import LARGEST_HALF, draw_message, half_pixels

MATRIX = np.array([[0.6, 0.3, 0.1], [0.1, 0.8, 0.1], [0.0, 0.1, 0.9]])


@pytest.mark.parametrize("matrix", [None, MATRIX])
def test_pixels_are_converted_and_stay_finite(matrix):
    pixels = np.random.default_rng(1).uniform(0, 2, (5, 4001, 4)).astype(np.float32)  # more than a block
    pixels[0, 0], pixels[1, 1, 3] = np.inf, 0.25
    given, out = pixels.copy(), np.full_like(pixels, np.nan)
    half_pixels(pixels, matrix, out)
    wanted = np.minimum(given, LARGEST_HALF)
    if matrix is not None:
        wanted[..., :3] = np.minimum(wanted[..., :3] @ matrix.T, LARGEST_HALF)
    np.testing.assert_allclose(out, wanted, rtol=1e-6)
    assert np.isfinite(out.astype(np.float16)).all()
    np.testing.assert_array_equal(pixels, given)


def test_memory_is_ready_before_the_first_picture(monkeypatch):
    from blender_addon.drawing import viewport

    threads = []
    thread = lambda **given: SimpleNamespace(start=lambda: threads.append(given))  # noqa: E731
    monkeypatch.setattr(viewport.threading, "Thread", thread)
    memory = viewport._Memory()
    memory.reserve(60)
    memory.reserve(50)  # is being prepared
    assert len(threads) == 1
    threads[0]["target"](*threads[0]["args"])
    whole = memory.of((6, 10, 4))
    assert whole.shape == (6, 10, 4)
    for shape in ((3, 5, 4), (6, 10, 4)):
        assert np.shares_memory(memory.of(shape), whole)
    assert memory.of((7, 10, 4)).shape == (7, 10, 4)  # a view that has grown since
    memory.reserve(70)
    assert len(threads) == 1


def test_a_message_is_beside_the_tools_and_the_sidebar(monkeypatch):
    from blender_addon.drawing import overlay

    plates, texts = [], []
    pen = SimpleNamespace(size=lambda *_: None, dimensions=lambda _font, text: (7.0 * len(text), 12.0))
    monkeypatch.setitem(sys.modules, "blf", pen)
    monkeypatch.setattr(overlay, "draw_triangles", lambda corners, _color: plates.append(corners))
    monkeypatch.setattr(overlay, "write", lambda text, x, *_: texts.append((text, x)))
    text = "the render process was killed by signal 9; " * 5
    draw_message(text, SimpleNamespace(width=1100, height=700), Covered(left=60, right=280), 1.0)
    assert " ".join(line for line, _ in texts).split() == ["The", *text.split()[1:]]
    assert all(x >= 60 and x + 7 * len(line) <= 820 for line, x in texts)
    assert plates[0][:, 0].min() >= 60
    assert plates[0][:, 0].max() <= 820
