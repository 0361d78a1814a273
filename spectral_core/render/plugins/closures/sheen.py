# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_sheen``: fabric fibers and dust; ``sheen_clear``: share of light that a layer of it transmits to the layers
below.

Microfiber sheen is a linearly transformed cosine (Zeltner, Burley and Chiang 2022, "Practical multiple-scattering sheen
using linearly transformed cosines"). Its table (roughness, cosine, 3) holds the share of light R and the lobe's a and b
as ``scripts/measure_sheen.py`` finds them in Cycles. Ashikhmin's is Blender's older velvet.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.closures.facets.albedo import SIZE, nodes
from spectral_core.render.plugins.closures.facets.upright import toward_viewer
from spectral_core.render.plugins.closures.lobe import Closure, register_closure

TABLE = Path(__file__).with_name("sheen.npy")


@cache
def table() -> NDArray[np.float32]:
    """(roughness, cosine, 3): R, a and b, both coordinates at i / (n - 1)."""
    return np.asarray(np.load(TABLE), dtype=np.float32)


@cache
def sheen_tables() -> dict[str, NDArray[np.float64]]:
    """The share, a and b at the nodes that all tables of closures have."""
    rows = table().astype(np.float64)
    last = len(rows) - 1
    known, (roughness, cosine) = np.arange(last + 1) / last, nodes()
    rough = np.stack([np.interp(roughness, known, column) for column in rows.reshape(last + 1, -1).T], axis=1)
    rough = rough.reshape(SIZE, last + 1, 3)
    names = ("share", "a", "b")
    return {name: np.stack([np.interp(cosine, known, row) for row in rough[..., k]]) for k, name in enumerate(names)}


def mean_share(roughness: float) -> float:
    """Share of even light that Microfiber sheen of a roughness takes from what lies below it, over all angles."""
    rows = table()[..., 0].astype(np.float64)
    known = np.linspace(0.0, 1.0, len(rows))
    at = np.array([np.interp(np.clip(roughness, 0.0, 1.0), known, column) for column in rows.T])
    cosines = (np.arange(512) + 0.5) / 512
    return float(2 * np.mean(cosines * np.interp(cosines, np.linspace(0.0, 1.0, len(at)), at)))


class SharedLight:
    """The table of shares on the device."""

    def __init__(self, mi: Any, dr: Any) -> None:
        self._mi, self._dr = mi, dr
        self._size = table().shape[0]
        self._texture = mi.Texture2f(mi.TensorXf(np.ascontiguousarray(table()[..., :1])))

    def can_take(self, _other: SharedLight) -> bool:
        """True: all have the same table."""
        return True

    def take(self, _other: SharedLight) -> None:
        """There is nothing to copy."""

    def __call__(self, roughness: Any, cosine: Any) -> Any:
        last = self._size - 1
        held = self._dr.clip(roughness, 0.0, 1.0), self._dr.clip(cosine, 0.0, 1.0)
        place = self._mi.Point2f(held[1] * last + 0.5, held[0] * last + 0.5) / float(self._size)
        return self._texture.eval(place)[0]


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure and the texture for the active variant."""

    def height_of_viewer(si: Any, normal: Any) -> Any:
        """Cosine of the viewer's direction to a normal on the visible side of the surface."""
        return dr.dot(normal, toward_viewer(mi, dr, si))

    class Sheen(Closure):
        """``color``, ``roughness``; ``ashikhmin``: the older model, else ``share``, ``a`` and ``b`` are tables."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.m_flags = int(mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)
            self.color, self.roughness = inputs["color"], inputs["roughness"]
            self.ashikhmin = inputs["ashikhmin"]
            self.tables = [] if self.ashikhmin else [inputs[name] for name in ("share", "a", "b")]

        def lobe(self, roughness: Any, cosine: Any) -> tuple[Any, Any, Any]:
            # as in Cycles, a normal that leans away from the viewer is seen as if from its horizon
            share, a, b = (table(roughness, dr.maximum(cosine, 0.0)) for table in self.tables)
            return share, dr.maximum(a, 1e-3), b

        def upward(self, si: Any, way: Any) -> Any:
            """A direction in the frame with the viewer above the surface."""
            return mi.Vector3f(way.x, way.y, dr.mulsign(way.z, si.wi.z))

        def viewer(self, si: Any) -> Any:
            """Direction to the viewer in that frame; below 0 where a bent normal leans away from the viewer."""
            wi = self.upward(si, si.wi)
            return mi.Vector3f(wi.x, wi.y, height_of_viewer(si, dr.mulsign(mi.Vector3f(si.sh_frame.n), si.wi.z)))

        def axes(self, wi: Any) -> tuple[Any, Any]:
            """Cosine and sine of the rotation from the first axis to the viewer's side."""
            size = dr.norm(mi.Vector2f(wi.x, wi.y))
            across = size > 1e-6
            scale = dr.rcp(dr.maximum(size, 1e-6))
            return dr.select(across, wi.x * scale, 1.0), dr.select(across, wi.y * scale, 0.0)

        def draw(self, si: Any, wi: Any, sample: Any, active: Any) -> Any:
            if self.ashikhmin:
                return mi.warp.square_to_uniform_hemisphere(sample)
            _, a, b = self.lobe(self.roughness.eval_1(si, active), wi.z)
            cosine = mi.warp.square_to_cosine_hemisphere(sample)
            local = dr.normalize(mi.Vector3f(cosine.x - cosine.z * b, cosine.y, cosine.z * a))
            along, side = self.axes(wi)
            return mi.Vector3f(local.x * along - local.y * side, local.x * side + local.y * along, local.z)

        def measure(self, si: Any, wi: Any, wo: Any, active: Any) -> tuple[Any, Any]:
            """Value · cosine of a white sheen, and density."""
            above = active & (wo.z > 0.0)
            roughness = self.roughness.eval_1(si, active)
            if self.ashikhmin:
                above &= wi.z > 0.0
                value, density = self.velvet(roughness, wi, wo), mi.Float(0.5 / dr.pi)
            else:
                share, a, b = self.lobe(roughness, wi.z)
                along, side = self.axes(wi)
                x, y = wo.x * along + wo.y * side, wo.y * along - wo.x * side
                squared = dr.square(a * x + b * wo.z) + dr.square(a * y) + dr.square(wo.z)
                density = wo.z * dr.square(a / dr.maximum(squared, 1e-12)) / dr.pi
                value = share * density
            return dr.select(above, value, 0.0), dr.select(above, density, 0.0)

        def velvet(self, roughness: Any, wi: Any, wo: Any) -> Any:
            """Ashikhmin and Premoze 2007: an inverted Gaussian of half vectors between V-shaped grooves."""
            inverse = dr.rcp(dr.square(dr.clip(roughness, 0.01, 1.0)))
            half = dr.normalize(wi + wo)
            up, facing = dr.clip(half.z, 1e-5, 1.0 - 1e-5), dr.maximum(dr.dot(wi, half), 1e-5)
            sine = 1.0 - up * up
            spread = dr.exp(-up * up / sine * inverse) * inverse / (dr.pi * sine * sine)
            ratio = up / facing
            masked = dr.minimum(1.0, dr.minimum(2.0 * ratio * wi.z, 2.0 * ratio * wo.z))
            return 0.25 * spread * masked / dr.maximum(wi.z, 1e-5)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            wi = self.viewer(si)
            wo = self.draw(si, wi, sample2, active)
            value, density = self.measure(si, wi, wo, active)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.eta, bs.pdf = self.upward(si, wo), mi.Float(1.0), density
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.DiffuseReflection))
            weight = self.color.eval(si, active) * (value / dr.maximum(density, 1e-20))
            return bs, dr.select(active & (density > 0.0), weight, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            value, density = self.measure(si, self.viewer(si), self.upward(si, wo), mi.Bool(active))
            return dr.select(active, self.color.eval(si, active) * value, 0.0), density

    class SheenClear(mi.Texture):
        """Share that a layer of Microfiber sheen of ``weight``, ``roughness`` and ``color`` transmits, at the view
        angle to ``normal``, or to that of the surface.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.weight, self.roughness = properties["weight"], properties["roughness"]
            self.color = properties["color"]
            self.normal = properties.get("normal")
            self.share = SharedLight(mi, dr)

        def cosine(self, si: Any, active: Any) -> Any:
            normal = dr.mulsign(mi.Vector3f(si.sh_frame.n), si.wi.z)
            if self.normal is not None:
                bent = mi.Vector3f(self.normal.eval_3(si, active))
                size = dr.norm(bent)
                normal = dr.select(size > 1e-6, bent / dr.maximum(size, 1e-6), normal)
            return height_of_viewer(si, normal)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            share = self.share(self.roughness.eval_1(si, active), self.cosine(si, active))
            amount = dr.clip(self.weight.eval_1(si, active), 0.0, 1.0) * dr.max(self.color.eval(si, active))
            return dr.clip(1.0 - amount * share, 0.0, 1.0)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.UnpolarizedSpectrum(self.eval_1(si, active))

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(self.eval_1(si, active))

        def mean(self) -> Any:
            return mi.Float(0.5)

        def to_string(self) -> str:
            return "SheenClear[]"

    register_closure(mi, "blender_sheen", Sheen)
    mi.register_texture("sheen_clear", lambda properties: SheenClear(properties))
