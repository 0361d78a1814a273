# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading programs of any structure as data: one loop in the kernel runs them all, instruction by instruction.

The code grows with the number of different operations in a scene, not with the number of programs. A few programs are
faster as code of their own.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.paints.programs import DrJit
from spectral_core.render.plugins.paints.tables import SceneTables
from spectral_core.scene.shading import OPERATIONS, Instruction, Program

REGISTERS = (4, 10)
"""Results that the programs of a scene may use at one time: few, as each takes time at every step, or most."""
CONSTANT, WIDE = 1 << 31, 1 << 30
"""Bits of an operand: it is an index into the program's numbers; it has three components."""


class Interpreter:
    """Programs by number. ``enter`` adds a program; ``run`` computes it."""

    def __init__(self, tables: SceneTables) -> None:
        self.tables = tables
        self.program_values: list[int] = []
        """Per program its first row of code, the row after its last, and the register of its result."""
        self.code: Any = None
        self.programs: Any = None
        self._targets: list[Instruction] = []
        self._places: dict[Any, int] = {}
        self._contents: dict[int, Any] = {}
        self._rows: list[list[int]] = []
        self._widths: list[int] = []
        self._registers = REGISTERS[0]

    def enter(self, program: Program) -> int | None:
        """Number of a program; None if its results need too many registers."""
        rows = self._allocated(program)
        if rows is None:
            return None
        first = len(self._rows)
        self._rows += rows
        self.program_values += [first, len(self._rows), rows[-1][1]]
        return len(self.program_values) // 3 - 1

    @property
    def code_values(self) -> list[int]:
        """All rows, one after another, padded to the longest."""
        size = 2 + len(self._widths)
        return [value for row in self._rows for value in row + [0] * (size - len(row))]

    def _allocated(self, program: Program) -> list[list[int]] | None:
        """One row per instruction that is no constant: operation, register of the result, operands."""
        last_use = {operand: k for k, item in enumerate(program.instructions) for operand in item.inputs}
        if program.instructions[-1].values:
            return None
        free, places, rows, offset = list(range(REGISTERS[-1])), {}, [], 0
        used = 0
        for k, item in enumerate(program.instructions):
            if item.values:
                places[k] = CONSTANT | (WIDE if len(item.values) == 3 else 0) | offset
                offset += len(item.values)
                continue
            operands = [places[operand] for operand in item.inputs]
            for operand in set(item.inputs):
                if last_use[operand] == k and not places[operand] & CONSTANT:
                    free.append(places[operand])
            if not free:
                return None
            places[k] = free.pop(free.index(min(free)))
            used = max(used, places[k] + 1)
            rows.append([self._target(item), places[k], *operands])
        self._registers = next(count for count in REGISTERS if count >= max(used, self._registers))
        return rows

    def _target(self, item: Instruction) -> int:
        key = (item.operation, item.settings, id(item.data))
        if key not in self._places:
            self._places[key] = len(self._targets)
            self._targets.append(item)
            self._contents |= self.tables.contents_of((item,))  # before any launch is recorded
            for k, width in enumerate(OPERATIONS[item.operation].widths):
                if k == len(self._widths):
                    self._widths.append(1)
                self._widths[k] = max(self._widths[k], width)
        return self._places[key]

    def run(self, numbers: Any, which: tuple[Any, Any], si: Any, active: Any) -> Any:
        """Three numbers, the result of a program at a hit; ``which``: its number, and the index of its first entry in
        ``numbers``.
        """
        mi, dr = self.tables.mi, self.tables.dr
        program, start = which
        row, end, out = (dr.gather(mi.UInt32, self.programs, program * 3 + k, active) for k in range(3))
        size, registers_used = 2 + len(self._widths), self._registers
        targets = [self._call(item) for item in self._targets]

        def operand(k: int, at: Any, registers: tuple[Any, ...], active: Any) -> Any:
            given = dr.gather(mi.UInt32, self.code, at + 2 + k, active)
            is_number = given >= CONSTANT
            place, step = start + (given & (WIDE - 1)), (given >> 30) & 1
            parts = []
            for c in range(self._widths[k]):
                held = registers[c]
                for r in range(1, registers_used):
                    held = dr.select(given == r, registers[3 * r + c], held)
                number = dr.gather(mi.Float, numbers, place + step * c, active & is_number)
                parts.append(dr.select(is_number, number, held))
            return tuple(parts)

        def body(row: Any, *registers: Any) -> tuple[Any, ...]:
            running, at = active & (row < end), row * size
            operation = dr.gather(mi.UInt32, self.code, at, running)
            into = dr.gather(mi.UInt32, self.code, at + 1, running)
            operands = [operand(k, at, registers, running) for k in range(len(self._widths))]
            if len(targets) == 1:
                found = targets[0](operands, si, running)
            else:
                found = dr.switch(operation, targets, operands, si, running, label="step")
            kept = [dr.select(into == k // 3, found[k % 3], register) for k, register in enumerate(registers)]
            return (row + 1, *kept)

        begin = (row, *(mi.Float(0.0) for _ in range(3 * registers_used)))
        registers = dr.while_loop(begin, lambda row, *_: active & (row < end), body)[1:]
        parts = []
        for c in range(3):
            held = registers[c]
            for r in range(1, registers_used):
                held = dr.select(out == r, registers[3 * r + c], held)
            parts.append(dr.select(dr.isfinite(held), held, 0.0))
        return mi.Color3f(*parts)

    def _call(self, item: Instruction) -> Any:
        """One operation on operands; a single number is returned three times."""
        tables, of = self.tables, OPERATIONS[item.operation]

        def call(operands: list[Any], si: Any, active: Any) -> tuple[Any, Any, Any]:
            mi = tables.mi
            given = [part if width == 3 else part[0] for part, width in zip(operands, of.widths, strict=False)]
            data = () if item.data is None else (item.data,)
            found = of.function(DrJit(tables, si, mi.Bool(active), self._contents), *given, *data, *item.settings)
            parts = found if isinstance(found, tuple) else (found,) * 3
            red, green, blue = (mi.Float(part) for part in parts)
            return red, green, blue

        return call
