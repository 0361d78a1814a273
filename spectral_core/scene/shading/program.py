# SPDX-License-Identifier: GPL-3.0-or-later
"""A node tree as a program: named operations in order, each reading earlier results; numbers are data.

Two programs of equal ``shape`` differ in numbers, tables and images only, so a renderer may run both with one kernel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene.shading import arithmetic, colors, geometry, media, pictures, vectors  # noqa: F401
from spectral_core.scene.shading.numpy_backend import NumPy
from spectral_core.scene.shading.registry import OPERATIONS, SMOOTH_NORMAL, UV_SIGN, UV_TANGENT
from spectral_core.scene.shading.textures import gabor, noise, patterns, voronoi  # noqa: F401

Setting = str | int | float | bool


@dataclass(frozen=True, slots=True, eq=False)
class Instruction:
    """One step: ``inputs`` are the numbers of earlier steps.

    ``operation`` is ``"number"`` (1 value) or ``"vector"`` (3) for constants, stored in ``values``, else a name of
    ``OPERATIONS``. ``settings`` belong to the shape, ``values`` and ``data`` (a table or an ImageTexture) do not.
    """

    operation: str
    inputs: tuple[int, ...] = ()
    settings: tuple[Setting, ...] = ()
    values: tuple[float, ...] = ()
    data: Any = None

    @property
    def width(self) -> int:
        """1 for a number, 3 for a color or vector."""
        return len(self.values) or OPERATIONS[self.operation].result

    @property
    def shape(self) -> tuple[Any, ...]:
        """Structure of a program: everything but its numbers and image contents. Equal shapes share a kernel."""
        kind = None if self.data is None else getattr(self.data, "shape_key", ("table", np.shape(self.data)))
        return self.operation, self.inputs, self.settings, kind


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """Instructions in order; the last one's value is the result."""

    instructions: tuple[Instruction, ...]

    @property
    def width(self) -> int:
        """1 for a number, 3 for a color or vector."""
        return self.instructions[-1].width

    @property
    def shape(self) -> tuple[Any, ...]:
        """Equal for programs that one kernel can run."""
        return tuple(instruction.shape for instruction in self.instructions)

    @property
    def inputs(self) -> frozenset[str]:
        """Names of its inputs from the shaded point."""
        return frozenset(str(i.settings[0]) for i in self.instructions if i.operation.endswith("_input")) | frozenset(
            f"{str(space).lower()}_transform"
            for i in self.instructions
            if i.operation == "transformed"
            for space in i.settings[1:]
        )

    @property
    def images(self) -> tuple[Any, ...]:
        """The images that it reads."""
        return tuple(i.data for i in self.instructions if i.data is not None and not isinstance(i.data, np.ndarray))

    def evaluate(
        self,
        read: Callable[[str, int], Any] | None = None,
        dtype: Any = np.float64,
        transform: Callable[..., Any] | None = None,
    ) -> Any:
        """Compute the value with NumPy.

        Parameters
        ----------
        read : inputs by name and shift, arrays (n,) or tuples of three; None if the program reads none.
        dtype : float64, or float32 to compute as the renderer does.
        transform : (vector, kind, space, inverse) to the vector in another space; None if the program needs none.

        Returns
        -------
        (n,) or (n, 3)
        """
        backend = NumPy(dtype)
        backend.input = lambda name, shift: _arrays(backend, read(name, shift))  # type: ignore[attr-defined, misc]
        backend.transform = transform  # type: ignore[attr-defined]
        with np.errstate(all="ignore"):
            result = run(self, backend, lambda i: [backend.number(np.full(1, v)) for v in i.values])
        return np.stack(np.broadcast_arrays(*result), axis=-1) if isinstance(result, tuple) else np.asarray(result)


def _arrays(backend: NumPy, value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(np.atleast_1d(backend.number(part)) for part in value)
    return np.atleast_1d(backend.number(value))


def run(program: Program, backend: Any, constant: Callable[[Instruction], list[Any]]) -> Any:
    """Value of a program under any backend; ``constant`` gives the numbers of a constant instruction."""
    results: list[Any] = []
    for instruction in program.instructions:
        results.append(step(instruction, results, backend, constant))
    return results[-1]


def step(
    instruction: Instruction, results: list[Any], backend: Any, constant: Callable[[Instruction], list[Any]]
) -> Any:
    """Value of one instruction from those before it."""
    if instruction.values:
        numbers = constant(instruction)
        return numbers[0] if len(numbers) == 1 else tuple(numbers)
    operands = [results[k] for k in instruction.inputs]
    if instruction.data is not None:
        operands.append(instruction.data)
    return OPERATIONS[instruction.operation].function(backend, *operands, *instruction.settings)


@dataclass(frozen=True, slots=True, eq=False)
class Computed:
    """A color or number that a program computes at a hit point."""

    program: Program

    @property
    def typical(self) -> NDArray[np.float64]:
        """Mean (1,) or (3,) over a grid of 16 × 16 points, for callers that need one value, such as the plan."""
        return mean_of(self.program)


class Raised(Computed):
    """The normal of a displaced surface, which stands for the surface's own: light does not fade at the horizon of the
    surface without the displacement.
    """


@dataclass(frozen=True, slots=True, eq=False)
class OnRaised(Computed):
    """The normal of a closure on a displaced surface, whose own normal is ``surface``: light fades toward its
    horizon.
    """

    surface: Raised


def mean_of(program: Program, size: int = 16) -> NDArray[np.float64]:
    """Mean (1,) or (3,) of a program over a square of coordinates from 0 to 1, seen perpendicularly from above."""
    u, v = (c.ravel() for c in np.meshgrid(*(((np.arange(size) + 0.5) / size,) * 2)))
    zero, one = np.zeros_like(u), np.ones_like(u)
    vectors_at = {
        "normal": (zero, zero, one), "true_normal": (zero, zero, one), "incoming": (zero, zero, one),
        "position": (2 * u - 1, 2 * v - 1, zero), "object": (2 * u - 1, 2 * v - 1, zero),
        "step_x": (one * 1e-3, zero, zero), "step_y": (zero, one * 1e-3, zero),
        UV_TANGENT: (one, zero, zero), UV_SIGN: (one, one, one), SMOOTH_NORMAL: (zero, zero, one),
    }  # fmt: skip
    widths = {str(i.settings[0]): i.width for i in program.instructions if i.operation.endswith("_input")}

    def read(name: str, shift: int) -> Any:
        if widths[name] == 1:
            typical = {"random": 0.5, "ray:Is Camera Ray": 1.0}
            return zero + typical.get(name, 0.0)
        return vectors_at.get(name.partition(":")[0], (u, v, zero))

    def transform(vector: Any, *_: Any) -> Any:
        return vector

    backend = NumPy()
    backend.input, backend.transform = (lambda n, s: read(n, s)), transform  # type: ignore[attr-defined]
    with np.errstate(all="ignore"):
        value = run(program, backend, lambda i: [backend.number(np.full(1, v)) for v in i.values])
    parts = value if isinstance(value, tuple) else (value,)
    means = np.array([np.mean(np.nan_to_num(np.broadcast_to(part, u.shape))) for part in parts])
    return np.asarray(means, dtype=np.float64)


class Builder:
    """Collects the instructions of a material: equal ones are shared, constants are folded at once."""

    def __init__(self) -> None:
        self._instructions: list[Instruction] = []
        self._known: dict[Any, int] = {}

    @property
    def images(self) -> tuple[Any, ...]:
        """The images that any instruction reads."""
        return tuple(i.data for i in self._instructions if i.data is not None and not isinstance(i.data, np.ndarray))

    @property
    def operations(self) -> frozenset[str]:
        """Names of the operations of all instructions."""
        return frozenset(instruction.operation for instruction in self._instructions)

    def width(self, register: int) -> int:
        """Width of a result."""
        return self._instructions[register].width

    def constant(self, register: int) -> NDArray[np.float64] | None:
        """Value of a constant result, (1,) or (3,); None for others."""
        values = self._instructions[register].values
        return np.array(values, dtype=np.float64) if values else None

    def number(self, value: Any) -> int:
        """A constant: one number or three."""
        flat = tuple(float(v) for v in np.ravel(value))
        finite = tuple(v if np.isfinite(v) else 0.0 for v in flat)
        return self._enter(Instruction("number" if len(finite) == 1 else "vector", values=finite))

    def add(self, operation: str, inputs: tuple[int, ...] = (), *settings: Setting, data: Any = None) -> int:
        """Result of an operation; inputs of other widths are converted as in Blender."""
        known = OPERATIONS[operation]
        converted = tuple(self.as_width(i, w) for i, w in zip(inputs, known.widths, strict=True))
        new = Instruction(operation, converted, settings, data=data)
        if known.folds and all(self._instructions[i].values for i in converted):
            return self.number(self._fold(new))
        return self._enter(new)

    def as_width(self, register: int, width: int, *, is_color: bool = False) -> int:
        """A result as a number (of colors the luminance, of vectors the mean) or as three."""
        if self.width(register) == width:
            return register
        if width == 3:
            return self.add("spread", (register,))
        return self.add("luminance" if is_color else "mean", (register,))

    def program(self, register: int) -> Program:
        """The instructions that a result needs, as a separate program."""
        needed, stack = set(), [register]
        while stack:
            at = stack.pop()
            if at not in needed:
                needed.add(at)
                stack += self._instructions[at].inputs
        copied: list[Instruction] = []
        place: dict[int, int] = {}

        def reads(k: int) -> int:
            """Index of an operand. Each reader of a constant gets its own copy: if equal constants were shared,
            editing one number to equal another would change the shape.
            """
            if not self._instructions[k].values:
                return place[k]
            copied.append(self._instructions[k])
            return len(copied) - 1

        for k in sorted(needed):
            i = self._instructions[k]
            if i.values and k != register:
                continue
            inputs = tuple(reads(operand) for operand in i.inputs)
            place[k] = len(copied)
            copied.append(Instruction(i.operation, inputs, i.settings, i.values, i.data))
        return Program(tuple(copied))

    def _enter(self, new: Instruction) -> int:
        key = (new.operation, new.inputs, new.settings, new.values, id(new.data))
        if key not in self._known:
            self._known[key] = len(self._instructions)
            self._instructions.append(new)
        return self._known[key]

    def _fold(self, new: Instruction) -> NDArray[np.float64]:
        backend = NumPy()
        operands: list[Any] = []
        for k in new.inputs:
            values = [np.full(1, v) for v in self._instructions[k].values]
            operands.append(values[0] if len(values) == 1 else tuple(values))
        if new.data is not None:
            operands.append(new.data)
        with np.errstate(all="ignore"):
            result = OPERATIONS[new.operation].function(backend, *operands, *new.settings)
        return np.ravel([np.ravel(part)[0] for part in (result if isinstance(result, tuple) else (result,))])
