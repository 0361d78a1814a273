# SPDX-License-Identifier: GPL-3.0-or-later
"""Paints that are computed from paints: ``mixed_paint``, ``product_paint``, ``root_paint``, ``switched_paint``."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.numbers import opaque_number


def register(mi: Any, dr: Any) -> None:
    """Define and register the textures for the active variant."""

    class ComputedPaint(mi.Texture):
        """A paint made of others; sampling by brightness is left to these."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.scale = opaque_number(mi, dr, properties.get("scale", 1.0))

        def is_spatially_varying(self) -> bool:
            return True

        def mean(self) -> Any:
            return mi.Float(0.5)

        def eval_1_grad(self, si: Any, active: Any = True) -> Any:
            return mi.Vector2f(0.0)

        def to_string(self) -> str:
            return type(self).__name__

    class MixedPaint(ComputedPaint):
        """``scale · ((1 - factor) · first + factor · second)``."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.first, self.second = properties["first"], properties["second"]
            self.factor = properties["factor"]

        def eval(self, si: Any, active: Any = True) -> Any:
            factor = dr.clip(self.factor.eval_1(si, active), 0.0, 1.0)
            return self.scale * dr.lerp(self.first.eval(si, active), self.second.eval(si, active), factor)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            factor = dr.clip(self.factor.eval_1(si, active), 0.0, 1.0)
            return self.scale * dr.lerp(self.first.eval_1(si, active), self.second.eval_1(si, active), factor)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            factor = dr.clip(self.factor.eval_1(si, active), 0.0, 1.0)
            return self.scale * dr.lerp(self.first.eval_3(si, active), self.second.eval_3(si, active), factor)

    class ProductPaint(ComputedPaint):
        """``scale · color · amount``; ``amount`` is a number, possibly varying, or with ``colored`` also a spectrum."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.color, self.amount = properties["color"], properties["amount"]
            self.colored = properties.get("colored", False)

        def is_spatially_varying(self) -> bool:
            return any(part.is_spatially_varying() for part in (self.color, self.amount))

        def eval(self, si: Any, active: Any = True) -> Any:
            amount = self.amount.eval(si, active) if self.colored else self.amount.eval_1(si, active)
            return self.scale * self.color.eval(si, active) * amount

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return self.scale * self.color.eval_1(si, active) * self.amount.eval_1(si, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return self.scale * self.color.eval_3(si, active) * self.amount.eval_1(si, active)

    class SwitchedPaint(ComputedPaint):
        """``color`` times ``amount``, which may be changed between renders: a light group's switch."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.color = properties["color"]
            self.amount = dr.opaque(mi.Float, 1.0)

        def switch(self, on: bool) -> None:
            self.amount = dr.opaque(mi.Float, 1.0 if on else 0.0)

        def is_spatially_varying(self) -> bool:
            return bool(self.color.is_spatially_varying())

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.amount * self.color.eval(si, active)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return self.amount * self.color.eval_1(si, active)

    class RootPaint(ComputedPaint):
        """Square root of ``color``."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.color = properties["color"]

        def eval(self, si: Any, active: Any = True) -> Any:
            return dr.safe_sqrt(self.color.eval(si, active))

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return dr.safe_sqrt(self.color.eval_1(si, active))

    mi.register_texture("switched_paint", lambda properties: SwitchedPaint(properties))
    mi.register_texture("root_paint", lambda properties: RootPaint(properties))
    mi.register_texture("mixed_paint", lambda properties: MixedPaint(properties))
    mi.register_texture("product_paint", lambda properties: ProductPaint(properties))
