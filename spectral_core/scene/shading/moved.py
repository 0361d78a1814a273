# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs for a scene that is scaled or moved for the renderer: they see points and lengths of the scene as it was."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from spectral_core.scene.shading.program import Instruction, Program

POINTS = ("position", "object_location")
"""Inputs that are points of the world."""
LENGTHS = ("step_x", "step_y", "edge_u", "edge_v", "ray:Ray Length")
"""Inputs that are vectors or lengths of the world."""
READS_A_LENGTH = {"occlusion": 1, "bevel": 1, "wireframe": 0}
"""Operations that the renderer computes from a length of the world, and which of their inputs that is."""


@dataclass(frozen=True, slots=True)
class Units:
    """The renderer's scene: each point of the world without ``shift``, times ``factor``."""

    factor: float = 1.0
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)


Result = Literal["", "point", "length"]
"""What the renderer takes the result of a program for: a value, or a point or lengths in its own units."""


def in_units(program: Program, units: Units, result: Result = "") -> Program:
    """The program for the renderer's units; the same object if these make no difference."""
    if not result and not any(map(_depends, program.instructions)):
        return program
    writer = _Writer(units)
    for instruction in program.instructions:
        writer.copy(instruction)
    writer.finish(result)
    return Program(tuple(writer.made))


def _depends(instruction: Instruction) -> bool:
    if instruction.operation.endswith("_input"):
        return instruction.settings[0] in POINTS or instruction.settings[0] in LENGTHS
    return instruction.operation == "transformed" or instruction.operation in READS_A_LENGTH


class _Writer:
    """Copies instructions. ``made``: those so far."""

    def __init__(self, units: Units) -> None:
        self.made: list[Instruction] = []
        self._place: list[int] = []  # where the result of each original instruction is
        self._own: dict[int, int] = {}  # from a point of the scene to the same point in the renderer's units
        self._units = units
        self._zero = self._enter("number", values=(0.0,))
        self._shift = self._enter("vector", values=units.shift)
        self._factors = {
            (up, width): self._enter("vector" if width == 3 else "number", values=(value,) * width)
            for up, value in ((True, units.factor), (False, 1.0 / units.factor))
            for width in (1, 3)
        }

    def _enter(self, operation: str, inputs: tuple[int, ...] = (), settings: Any = (), values: Any = ()) -> int:
        self.made.append(Instruction(operation, inputs, settings, values))
        return len(self.made) - 1

    def _vector(self, mode: str, register: int, other: int) -> int:
        return self._enter("vector_math", (register, other, self._shift, self._zero), (mode,))

    def _scaled(self, register: int, *, up: bool) -> int:
        """A vector or length times the factor, or (not ``up``) over it."""
        if self._units.factor == 1.0:
            return register
        if self.made[register].width == 3:
            return self._vector("MULTIPLY", register, self._factors[up, 3])
        return self._enter("math", (register, self._factors[up, 1], self._zero), ("MULTIPLY",))

    def _as_scene(self, register: int, *, is_point: bool) -> int:
        """A result in the renderer's units as one of the scene."""
        made = self._scaled(register, up=False)
        if is_point:
            made = self._vector("ADD", made, self._shift)
            self._own[made] = register
        return made

    def _as_renderer(self, register: int, *, is_point: bool) -> int:
        """The reverse: without rounding where the point was read in the renderer's units."""
        if is_point and register in self._own:
            return self._own[register]
        return self._scaled(self._vector("SUBTRACT", register, self._shift) if is_point else register, up=True)

    def copy(self, instruction: Instruction) -> None:
        """Append an instruction with its inputs at their new places."""
        inputs = tuple(self._place[k] for k in instruction.inputs)
        name, settings = instruction.operation, instruction.settings
        if name in READS_A_LENGTH and not (name == "wireframe" and settings[0]):  # or its size is in pixels
            at = READS_A_LENGTH[name]
            inputs = (*inputs[:at], self._as_renderer(inputs[at], is_point=False), *inputs[at + 1 :])
        is_space = name == "transformed" and settings[0] != "NORMAL" and settings[1] != settings[2]
        is_point = is_space and settings[0] == "POINT"
        if is_space and settings[1] != "OBJECT":
            inputs = (self._as_renderer(inputs[0], is_point=is_point and settings[1] == "WORLD"),)
        self.made.append(Instruction(name, inputs, settings, instruction.values, instruction.data))
        made = len(self.made) - 1
        if is_space and settings[2] != "OBJECT":
            made = self._as_scene(made, is_point=is_point and settings[2] == "WORLD")
        elif name.endswith("_input") and (settings[0] in POINTS or settings[0] in LENGTHS):
            made = self._as_scene(made, is_point=settings[0] in POINTS)
        self._place.append(made)

    def finish(self, result: Result) -> None:
        """Make the last original result that of the program."""
        made = self._place[-1]
        if result:
            made = self._as_renderer(made, is_point=result == "point")
        if made != len(self.made) - 1:  # the last instruction is the result
            self._vector("ADD", made, self._enter("vector", values=(0.0, 0.0, 0.0)))
