# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures whose values a shading program computes at the hit point."""

from __future__ import annotations

from functools import cache
from typing import Any

from spectral_core.render.plugins.paints.loaded import LoadedProgram
from spectral_core.scene.shading.arithmetic import luminance


@cache
def computed_classes(variant: str) -> tuple[Any, Any]:
    """The classes of computed and of constant textures under ``variant``, which must be the active one."""
    import drjit as dr
    import mitsuba as mi

    class Base(mi.Texture):
        def __init__(self) -> None:
            super().__init__(mi.Properties())

        def is_spatially_varying(self) -> bool:
            return True

        def mean(self) -> Any:
            return mi.Float(0.5)

        def eval_1_grad(self, si: Any, active: Any = True) -> Any:
            return mi.Vector2f(0.0)

        def to_string(self) -> str:
            return type(self).__name__

    class Computed(Base):
        """Value of a program: a reflectance, clipped to [0, 1], or an emitted color of either sign, as in Cycles.

        ``light``: a texture of the white that emitted colors tint; None for reflectances.
        """

        def __init__(self, program: LoadedProgram, upsampling: Any, light: Any = None) -> None:
            super().__init__()
            self.program, self.upsampling, self.light = program, upsampling, light

        def values(self, si: Any, active: Any) -> Any:
            found = self.program(si, active)
            parts = found if isinstance(found, tuple) else (found,) * 3
            return tuple(dr.select(dr.isfinite(part), part, 0.0) for part in parts)

        def eval(self, si: Any, active: Any = True) -> Any:
            rgb = self.values(si, active)
            if self.light is None:
                rgb = tuple(dr.clip(c, 0.0, 1.0) for c in rgb)
                return mi.Color3f(*rgb) if self.upsampling is None else self.upsampling(rgb, si.wavelengths)
            if self.upsampling is None:
                return mi.Color3f(*rgb) * self.light.eval(si, active)
            size = mi.Float(1e-20)
            for c in rgb:
                size = dr.maximum(size, dr.abs(c))
            # each sign has its own spectrum: upsampled reflectances are never negative
            share = tuple(c / size for c in rgb)
            lit = self.upsampling(share, si.wavelengths) - self.upsampling(tuple(-c for c in share), si.wavelengths)
            return lit * self.light.eval(si, active) * size

        def eval_1(self, si: Any, active: Any = True) -> Any:
            rgb = self.values(si, active)
            return luminance(None, rgb) if self.program.program.width == 3 else rgb[0]

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(*self.values(si, active))

    class Constant(Base):
        """One number, which kernels read from memory."""

        def __init__(self, value: float) -> None:
            super().__init__()
            self.value = dr.opaque(mi.Float, float(value))

        def is_spatially_varying(self) -> bool:
            return False

        def mean(self) -> Any:
            return self.value

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(self.value)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return mi.Float(self.value)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(self.value)

    return Computed, Constant
