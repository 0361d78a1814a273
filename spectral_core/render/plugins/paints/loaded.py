# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading programs in a kernel: their instructions are code, their numbers are data."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.paints.programs import DrJit
from spectral_core.render.plugins.paints.ray_marks import LENGTH
from spectral_core.render.plugins.paints.tables import SceneTables
from spectral_core.scene.shading import OPERATIONS, Instruction, Program, step

SHARED = frozenset(
    name
    for name in OPERATIONS
    if name.startswith(("noise", "voronoi", "wave", "brick", "magic", "white_noise", "gabor"))
)
"""Operations with so much code that a kernel contains it once and calls it."""


def shared(backend: DrJit, instruction: Instruction, results: list[Any]) -> Any:
    """Value of an operation as a call: Dr.Jit keeps one copy of the code of equal calls."""
    tables = backend.tables
    mi, dr, of = tables.mi, tables.dr, OPERATIONS[instruction.operation]
    operands = [results[k] for k in instruction.inputs]
    given = [tuple(map(mi.Float, each)) if isinstance(each, tuple) else mi.Float(each) for each in operands]

    def run(given: list[Any], active: Any) -> Any:
        found = of.function(DrJit(tables, None, active), *given, *instruction.settings)
        return tuple(map(mi.Float, found)) if of.result == 3 else mi.Float(found)

    def nothing(given: list[Any], active: Any) -> Any:
        return (mi.Float(0.0),) * 3 if of.result == 3 else mi.Float(0.0)

    # with two targets, because the code of a single one would be inlined; with a name, because Dr.Jit fails at the
    # third nested call of one name
    return dr.switch(tables.first_target, [run, nothing], given, mi.Bool(backend.active), label="operation")


class TracedProgram:
    """A program's code; the numbers are separate, and those of every program of equal structure can be used."""

    def __init__(self, tables: SceneTables, program: Program) -> None:
        self.tables, self.program = tables, program
        tables.reads_lengths |= f"ray:{LENGTH}" in program.inputs
        self.offsets: list[int] = []
        count = 0
        for instruction in program.instructions:
            self.offsets.append(count)
            count += len(instruction.values)
        # now: what is first read within a recorded launch may be freed before it is replayed
        self.contents = tables.contents_of(program.instructions)

    def take_contents(self, program: Program) -> None:
        """Read the images and tables of ``program`` from now on, which has the same structure."""
        for mine, given in zip(self.program.instructions, program.instructions, strict=True):
            if mine.data is not None and mine.data is not given.data:
                self.tables.replace(mine.data, given.data)
        self.program, self.contents = program, self.tables.contents_of(program.instructions)

    def value(self, numbers: Any, start: Any, si: Any, active: Any) -> Any:
        """Value at a hit point: one number or three; ``start``: index of its first entry in ``numbers``."""
        mi, dr = self.tables.mi, self.tables.dr
        backend = DrJit(self.tables, si, mi.Bool(active), self.contents)
        results: list[Any] = []
        for place, instruction in enumerate(self.program.instructions):
            offset = start + self.offsets[place]

            def constant(item: Instruction, offset: Any = offset) -> list[Any]:
                return [dr.gather(mi.Float, numbers, offset + k) for k in range(len(item.values))]

            if instruction.operation in SHARED:
                results.append(shared(backend, instruction, results))
            else:
                results.append(step(instruction, results, backend, constant))
        return results[-1]


class LoadedProgram(TracedProgram):
    """A program with its numbers on the device: another number needs no new kernel."""

    def __init__(self, tables: SceneTables, program: Program) -> None:
        super().__init__(tables, program)
        # a list, not an array: Dr.Jit would map NumPy's memory, which is another type for a recorded kernel launch
        self.numbers = tables.mi.Float(numbers_of(program) or [0.0])

    def can_take(self, other: LoadedProgram) -> bool:
        """True if one kernel runs both."""
        return self.tables is other.tables and self.program.shape == other.program.shape

    def take(self, other: LoadedProgram) -> None:
        """Compute ``other`` from now on, a program of the same structure; kernels stay valid."""
        self.take_contents(other.program)
        self.numbers = other.numbers

    def __call__(self, si: Any, active: Any) -> Any:
        """Value at a hit point: one number or three."""
        return self.value(self.numbers, self.tables.mi.UInt32(0), si, active)


def numbers_of(program: Program) -> list[float]:
    """All numbers of a program, in order."""
    return [float(value) for instruction in program.instructions for value in instruction.values]
