# SPDX-License-Identifier: GPL-3.0-or-later
"""A new closure needs a data class and a plugin with its name, and no change in other files of the renderer."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from spectral_core.render import plugins, render_scene
from spectral_core.render.plugins import closures
from spectral_core.scene import Computed, Film, MixSurface, Transparent, World, gray
from spectral_core.scene.paint import Paint, Scalar
from tests.render.scenes import lit_plane

pytest.importorskip("mitsuba")
PLUGIN = """
from spectral_core.render.plugins.closures.lobe import classes, register_closure


def register(mi, dr):
    class Dimmed(classes[mi.variant(), "diffuse"]):
        def __init__(self, inputs):
            super().__init__(inputs)
            self.share, self.halved = inputs["share"], inputs["halved"]

        def value(self, si, wo, active):
            return self.dimming(si, active) * super().value(si, wo, active)

        def weight(self, si, bs, active):
            return self.dimming(si, active) * super().weight(si, bs, active)

        def dimming(self, si, active):
            return self.share.eval_1(si, active) * (0.5 if self.halved else 1.0)

    register_closure(mi, "blender_dimmed", Dimmed)
"""


@dataclass(frozen=True, slots=True, eq=False)
class Dimmed:
    """A diffuse surface that loses part of the light that it reflects."""

    color: Paint = field(default_factory=lambda: gray(0.8))
    share: Scalar = 0.5
    halved: bool = False
    normal: Computed | None = None


def test_a_new_closure_needs_two_files_of_the_core(tmp_path, monkeypatch):
    (tmp_path / "zz_dimmed.py").write_text(PLUGIN, "utf-8")
    monkeypatch.setattr(closures, "__path__", [*closures.__path__, str(tmp_path)])
    monkeypatch.setattr(plugins, "_registered", set())
    surface = MixSurface(0.75, Transparent(gray(1.0)), Dimmed(gray(0.8), 0.6, halved=True))
    scene = lit_plane(surface=surface, film=Film(8, 8, samples=64), world=World(gray(1.0)))

    pixels = render_scene(scene).pixels[..., :3].mean(axis=(0, 1))

    assert pixels == pytest.approx([0.25 + 0.75 * 0.8 * 0.6 * 0.5] * 3, rel=0.02)
