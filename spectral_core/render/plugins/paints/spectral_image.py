# SPDX-License-Identifier: GPL-3.0-or-later
"""``spectral_image``: a texture of K weights per texel and K spectra, for spectral transport."""

from __future__ import annotations

from typing import Any


def register(mi: Any, dr: Any) -> None:
    """Define and register the texture for the active variant."""

    class SpectralImage(mi.Texture):
        """Reflectance Σ_k weight_k(u, v) · spectrum_k(λ), both by linear interpolation.

        ``weights``: TensorXf (height, width, K); ``spectra``: TensorXf (n, K) at equal steps from ``first_nm`` to
        ``last_nm``; ``u_row`` and ``v_row``: rows of the affine map from the mesh's UV; ``wrap_mode`` and
        ``filter_type`` as ``bitmap`` has them.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            wraps = {"repeat": dr.WrapMode.Repeat, "mirror": dr.WrapMode.Mirror, "clamp": dr.WrapMode.Clamp}
            wrap = wraps[properties.get("wrap_mode", "repeat")]
            filters = {"bilinear": dr.FilterMode.Linear, "nearest": dr.FilterMode.Nearest}
            filter_mode = filters[properties.get("filter_type", "bilinear")]
            self.weights = mi.Texture2f(properties["weights"], filter_mode=filter_mode, wrap_mode=wrap)
            self.spectra = mi.Texture1f(properties["spectra"])
            self.knots = properties["spectra"].shape[0]
            self.first_nm, self.last_nm = float(properties["first_nm"]), float(properties["last_nm"])
            self.u_row, self.v_row = properties["u_row"], properties["v_row"]

        def is_spatially_varying(self) -> bool:
            return True

        def mean(self) -> Any:
            return mi.Float(0.5)

        def _amounts(self, si: Any, active: Any) -> list[Any]:
            u, v = (row[0] * si.uv.x + row[1] * si.uv.y + row[2] for row in (self.u_row, self.v_row))
            return list(self.weights.eval(mi.Point2f(u, v), active))

        def eval(self, si: Any, active: Any = True) -> Any:
            amounts = self._amounts(si, active)
            result = dr.zeros(mi.UnpolarizedSpectrum)
            for channel in range(len(si.wavelengths)):
                position = (si.wavelengths[channel] - self.first_nm) / (self.last_nm - self.first_nm)
                # A texel's center is at (i + 0.5) / n; knot i shall be at i / (n - 1).
                texel = (position * (self.knots - 1) + 0.5) / self.knots
                inside = active & (position >= 0) & (position <= 1)
                values = self.spectra.eval(mi.Point1f(texel), inside)
                value = mi.Float(0)
                for amount, spectrum in zip(amounts, values, strict=True):
                    value = dr.fma(amount, spectrum, value)
                result[channel] = dr.select(inside, value, 0)
            return result

        def eval_1(self, si: Any, active: Any = True) -> Any:
            amounts = self._amounts(si, active)
            return sum(amounts[1:], amounts[0]) / len(amounts)

        def eval_1_grad(self, si: Any, active: Any = True) -> Any:
            return mi.Vector2f(0.0)

        def to_string(self) -> str:
            return "SpectralImage"

    mi.register_texture("spectral_image", lambda properties: SpectralImage(properties))
