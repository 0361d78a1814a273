# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions: the extinction, emission and color of each material as functions of the data value.

A ray collects, for material k, the amount A_k = ∫ T(s)·(κ_k + ε_k)(f(s)) ds with T = exp(-∫ Σ_k κ_k ds). κ is the
extinction and ε the emission at the data value f, both per world unit. The picture is Σ_k A_k·color_k, times the
light where the material is lit. So a fully opaque layer of a material shows its color; an X-ray material (κ = 0,
ε > 0) adds light and absorbs none (thesis 5.4.4); color and light enter only after the march, and any of them can
change without a ray.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_range
from spectral_core.errors import InvalidInputError, counted

FARTHEST_KNOT = 1e300
"""Largest size of a knot: the difference of two knots is a double."""
LARGEST = 1e30
"""Largest extinction, emission, weight and color: its product with a step fits into single precision."""
_DARK = 0.01  # of the brightest color

Array = NDArray[np.float64]


@read_only_when_copied
@dataclass(frozen=True, eq=False)
class Material:
    """One material: knots over the data value, and one color.

    ``values`` (n,) do not decrease; two equal ones make a jump (the later one counts at the value itself). Between
    knots both curves are linear, outside they keep the last knot. ``extinction`` (n,) and ``emission`` (n,) or None
    are per world unit, not negative. ``color`` is linear RGB (3,), or a spectrum on the transfer function's
    wavelengths. ``lit`` says that the color is a reflectance, to be multiplied by the light; else it shines by
    itself. ``gradient_values`` and ``gradient_weights`` (m,), both or neither, make the function two-dimensional:
    both curves are multiplied by the weight at the field's gradient magnitude, in data units per world unit.
    """

    name: str
    values: Array
    extinction: Array
    color: Array
    emission: Array | None = None
    lit: bool = True
    gradient_values: Array | None = None
    gradient_weights: Array | None = None

    def __post_init__(self) -> None:
        where = f"of material {self.name!r}"
        values = _increasing(f"values {where}", self.values)
        emission = np.zeros(len(values)) if self.emission is None else self.emission
        given = {"extinction": self.extinction, "emission": emission}
        checked = {"values": values} | {
            key: _not_negative(f"{key} {where}", curve, len(values)) for key, curve in given.items()
        }
        checked["color"] = frozen_array(f"color {where}", self.color, (None,))
        brightest = float(np.abs(checked["color"]).max(initial=0.0))
        require_range(f"the largest number of color {where}", brightest, 0.0, LARGEST)
        if (self.gradient_values is None) != (self.gradient_weights is None):
            raise InvalidInputError(f"gradient_values and gradient_weights {where} go together; one is missing")
        if self.gradient_values is not None and self.gradient_weights is not None:
            steps = _increasing(f"gradient_values {where}", self.gradient_values)
            checked["gradient_values"] = steps
            checked["gradient_weights"] = _not_negative(f"gradient_weights {where}", self.gradient_weights, len(steps))
        for key, array in checked.items():
            object.__setattr__(self, key, array)

    def weight(self, gradient: Array) -> Array:
        """Weight at gradient magnitudes (any shape); ones where the material is one-dimensional."""
        if self.gradient_values is None or self.gradient_weights is None:
            return np.ones_like(gradient)
        return interpolate(gradient, self.gradient_values, self.gradient_weights)


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """K materials, and the wavelengths (n,) in nm that their colors are given on, or None for linear RGB.

    Raises InvalidInputError for no material, for two of one name, and for colors that do not fit the wavelengths.
    """

    materials: tuple[Material, ...]
    wavelengths_nm: Array | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.materials, tuple | list) or not all(isinstance(m, Material) for m in self.materials):
            raise InvalidInputError(f"materials are {str(self.materials)[:60]!r}; expected a tuple of Material")
        object.__setattr__(self, "materials", tuple(self.materials))
        names = self.names
        if not names:
            raise InvalidInputError("a transfer function has no material; give at least one")
        if len(set(names)) < len(names):
            raise InvalidInputError(
                f"two materials of a transfer function share a name: {', '.join(names)}; rename one"
            )
        if self.wavelengths_nm is not None:
            grid = _increasing("wavelengths_nm", self.wavelengths_nm)
            if len(grid) < 2 or np.any(np.diff(grid) <= 0):
                raise InvalidInputError("wavelengths_nm must be at least two, each above the one before")
            object.__setattr__(self, "wavelengths_nm", grid)
        length = 3 if self.wavelengths_nm is None else len(self.wavelengths_nm)
        for material in self.materials:
            if len(material.color) != length:
                kind = "linear RGB" if self.wavelengths_nm is None else "the wavelengths of the transfer function"
                raise InvalidInputError(
                    f"color of material {material.name!r} has {counted(len(material.color), 'entry', 'entries')}; "
                    f"expected {length} ({kind})"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """The materials' names, in order."""
        return tuple(material.name for material in self.materials)

    @property
    def colors(self) -> Array:
        """The materials' colors, shape (K, 3) or (K, wavelengths)."""
        return np.stack([material.color for material in self.materials])

    @property
    def has_emission(self) -> bool:
        """True if some material has emission."""
        return any(_emission(material).any() for material in self.materials)

    @property
    def has_dark(self) -> bool:
        """True if a material that takes light is black, or much darker than another: it shows by what it hides."""
        brightest = _DARK * max(float(material.color.max()) for material in self.materials)
        return any(bool(m.extinction.any()) and float(m.color.max()) <= brightest for m in self.materials)

    @property
    def uses_gradient(self) -> bool:
        """True if some material depends on the gradient magnitude too."""
        return any(material.gradient_values is not None for material in self.materials)

    def scaled(self, factor: float) -> TransferFunction:
        """The same function with every extinction and emission times ``factor`` (thicker or thinner)."""
        factor = require_range("the factor", factor, 0.0, LARGEST)
        scaled = [replace(m, extinction=m.extinction * factor, emission=_emission(m) * factor) for m in self.materials]
        return replace(self, materials=tuple(scaled))

    def shows(self, low: float, high: float) -> bool:
        """True if some value between ``low`` and ``high`` is visible; gradient weights do not count."""
        for material in self.materials:
            inside = (material.values >= low) & (material.values <= high)
            for heights in (material.extinction, _emission(material)):
                ends = interpolate(np.array([low, high]), material.values, heights)
                if ends.any() or heights[inside].any():
                    return True
        return False

    def curves(self, values: Array, gradient: Array | None = None) -> tuple[Array, Array]:
        """(extinction, source) per material at data values of any shape, each (..., K); source = extinction + emission.

        ``gradient`` is the gradient magnitude at the same places; it is needed where ``uses_gradient``.
        """
        if self.uses_gradient and gradient is None:
            raise InvalidInputError("this transfer function is two-dimensional; give the gradient magnitudes too")
        values = np.asarray(values, dtype=np.float64)
        extinction = [interpolate(values, m.values, m.extinction) for m in self.materials]
        emission = [interpolate(values, m.values, _emission(m)) for m in self.materials]
        if gradient is not None:
            weights = [m.weight(np.asarray(gradient, dtype=np.float64)) for m in self.materials]
            extinction = [curve * w for curve, w in zip(extinction, weights, strict=True)]
            emission = [curve * w for curve, w in zip(emission, weights, strict=True)]
        taken = np.stack(extinction, axis=-1)
        return taken, taken + np.stack(emission, axis=-1)


def interpolate(x: Array, knots: Sequence[float] | Array, heights: Sequence[float] | Array) -> Array:
    """Piecewise linear curve through the knots, constant outside; at a jump the later knot counts."""
    knots, heights = np.asarray(knots, dtype=np.float64), np.asarray(heights, dtype=np.float64)
    after = np.clip(np.searchsorted(knots, x, side="right"), 1, max(len(knots) - 1, 1))
    if len(knots) == 1:
        return np.full(np.shape(x), heights[0])
    left, right = knots[after - 1], knots[after]
    width = np.where(right > left, right - left, 1.0)
    part = np.clip((x - left) / width, 0.0, 1.0)
    # Past the last knot, searchsorted lands on the last piece; a jump there has no width, and the later knot counts.
    part = np.where((right == left) & (x >= right), 1.0, part)
    return heights[after - 1] + part * (heights[after] - heights[after - 1])


def _emission(material: Material) -> Array:
    return np.zeros_like(material.extinction) if material.emission is None else material.emission


def _increasing(name: str, knots: Sequence[float] | Array) -> Array:
    checked = frozen_array(name, knots, (None,))
    require_range(f"the largest number of {name}", float(np.abs(checked).max(initial=0.0)), 0.0, FARTHEST_KNOT)
    if len(checked) == 0 or np.any(np.diff(checked) < 0):
        raise InvalidInputError(
            f"{name} must be at least one number, none below the one before; got {checked.tolist()}"
        )
    return checked


def _not_negative(name: str, curve: Sequence[float] | Array, length: int) -> Array:
    checked = frozen_array(name, curve, (length,))
    if np.any(checked < 0):
        raise InvalidInputError(f"{name} has the negative entry {checked.min()}; expected none below zero")
    require_range(f"the largest number of {name}", float(checked.max(initial=0.0)), 0.0, LARGEST)
    return checked
