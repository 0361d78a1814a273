# SPDX-License-Identifier: GPL-3.0-or-later
"""Types of closures in a scene, each traced once, and the numbers in which closures of a type differ."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spectral_core.render.plugins.closures.lobe import classes
from spectral_core.render.plugins.paints import spectrum_rows
from spectral_core.render.plugins.paints.loaded import numbers_of
from spectral_core.render.plugins.paints.tables import SceneTables
from spectral_core.render.plugins.surfaces.slots import FIRST_TEXTURE, WIDTHS, Slot
from spectral_core.render.plugins.surfaces.sources import Albedos, Lobe, Number, Programmed, Sampled, Source, Tint


@dataclass
class Buffers:
    """Data of slots on the device. ``program_values``: the numbers of all programs, one after another;
    ``spectrum_rows``: those of all sampled spectra.

    ``upsampling``: conversion of computed colors to spectra, None in RGB transport.
    """

    scene: SceneTables
    upsampling: Any
    program_values: list[float] = field(default_factory=list)
    albedo_values: list[float] = field(default_factory=list)
    spectrum_rows: list[np.ndarray] = field(default_factory=list)
    interpreter: Any = None
    numbers: Any = None
    codes: Any = None
    program_numbers: Any = None
    albedos: Any = None
    spectra: Any = None
    _albedo_places: dict[bytes, int] = field(default_factory=dict)

    def plain(self, source: Source) -> tuple[list[float], list[int]]:
        """Numbers and integers of a source, as many as its type needs; zeros for computed sources."""
        width = WIDTHS[source.kind]
        if isinstance(source, Number):
            return [float(source.value), 0.0], [0, 0]
        if isinstance(source, Tint):
            size = max(float(np.max(source.rgb)), 1.0) if source.kind == "bright" else 1.0
            return [*self._reflectance(np.asarray(source.rgb) / size), size][:width], [0] * width
        if isinstance(source, Albedos):
            return [0.0], [self._albedo_place(np.asarray(source.values, np.float32))]
        return [0.0] * width, [0] * width

    def _reflectance(self, rgb: Any) -> list[float]:
        """A color, or in spectral transport the coefficients of its smooth spectrum."""
        mi = self.scene.mi
        color = [float(part) for part in rgb]
        if not mi.is_spectral:
            return color
        found = mi.srgb_model_fetch(mi.ScalarColor3f(color))
        return [float(found[k]) for k in range(3)]

    def _albedo_place(self, values: Any) -> int:
        """Index of a table's first entry in the stack; equal tables are stored once."""
        key = values.tobytes()
        if key not in self._albedo_places:
            self._albedo_places[key] = len(self.albedo_values)
            self.albedo_values += values.ravel().tolist()
        return self._albedo_places[key]

    def start_of(self, source: Source, place: int | None) -> int:
        """Index of a program's first number or of a spectrum's row; they are written at ``place`` or, for None,
        appended.
        """
        if isinstance(source, Sampled):
            if place is None:
                place = len(self.spectrum_rows)
                self.spectrum_rows.append(np.zeros(0))
            self.spectrum_rows[place] = spectrum_rows.row(source.spectrum)
            return place
        if not isinstance(source, Programmed):
            return 0
        values = numbers_of(source.program)
        if place is None:
            place = len(self.program_values)
            self.program_values += values
        else:
            self.program_values[place : place + len(values)] = values
        return place


class ClosureKind:
    """One type of closure in the kernel: an object of its class whose inputs are slots."""

    def __init__(self, lobe: Lobe, variant: str) -> None:
        self.build = lobe.build()
        self.slots: list[Slot] = []
        named: dict[int, Slot] = {}
        offset = 0
        for source in lobe.sources:
            named[id(source)] = Slot(source.kind, offset)
            self.slots.append(named[id(source)])
            offset += WIDTHS[source.kind]
        self.width, self.name = offset, lobe.name
        self.closure = _made(lobe, named, variant)
        self.flags = int(self.closure.flags())

    @property
    def programmed(self) -> list[Slot]:
        """Inputs that programs compute."""
        return [slot for slot in self.slots if slot.programs]

    def prepare(self, buffers: Buffers, row: Any, si: Any, active: Any, computed: tuple[Any, ...] = ()) -> Any:
        """The closure with the inputs of a hit; ``row``: index of its first number; ``computed``: of
        ``computed_inputs``.
        """
        for slot, found in zip(self.programmed, computed, strict=False):
            slot.computed = found
        for slot in self.slots:
            slot.read(buffers, row, si, active)
        return self.closure

    def clear(self) -> None:
        """Clear the inputs, which are variables of the call that has read them."""
        for slot in self.slots:
            slot.value = slot.computed = None

    def pairs(self, lobe: Lobe) -> Iterator[tuple[Slot, Source]]:
        """Each slot with the source of that input in a closure of this type."""
        return zip(self.slots, lobe.sources, strict=True)


def computed_inputs(kinds: list[ClosureKind], buffers: Buffers, at: tuple[Any, Any], si: Any, active: Any) -> Any:
    """Results of the programs for the first programmed input of a closure, the second, …; ``at``: the closure's type
    and the index of its first number.

    They are computed before the kernel branches by type: the interpreter, which is long, is then there once instead of
    once for each type, and all uses of a closure at a hit share the results.
    """
    count = max(len(each.programmed) for each in kinds)
    return tuple(_computed_input(kinds, buffers, number, at, si, active) for number in range(count))


def _computed_input(
    kinds: list[ClosureKind], buffers: Buffers, number: int, at: tuple[Any, Any], si: Any, active: Any
) -> Any:
    """Three numbers: the programmed input ``number`` of each lane's closure."""
    import drjit as dr
    import mitsuba as mi

    kind, row = at
    offset, first, is_listed, has_code = mi.UInt32(0), mi.UInt32(0), mi.Bool(False), mi.Bool(False)
    targets: list[Any] = []
    for place, each in enumerate(kinds):
        if number >= len(each.programmed):
            continue
        slot, here = each.programmed[number], kind == place
        offset = dr.select(here, slot.offset, offset)
        if slot.first_program is None:
            first = dr.select(here, len(targets), first)
            targets += slot.programs
            has_code |= here
        else:
            first = dr.select(here, slot.first_program, first)
            is_listed |= here
    code = dr.gather(mi.UInt32, buffers.codes, row + offset, active & (is_listed | has_code))
    start = dr.gather(mi.UInt32, buffers.codes, row + offset + 1, active & (is_listed | has_code))
    active = active & (code > 0) & (code < FIRST_TEXTURE)
    which, found = code - 1 + first, mi.Color3f(0.0)
    if any(number < len(each.programmed) and each.programmed[number].first_program is not None for each in kinds):
        found = buffers.interpreter.run(buffers.program_numbers, (which, start), si, active & is_listed)
    if targets:

        def call(read: Any) -> Callable[..., Any]:
            return lambda start, si, active: mi.Color3f(read(buffers, start, si, active))

        calls = [*map(call, targets), lambda start, si, active: mi.Color3f(0.0)]
        chosen = dr.select(active & has_code, which, len(targets))
        found = dr.select(has_code, dr.switch(chosen, calls, start, si, active & has_code, label="input"), found)
    return found


def _made(lobe: Lobe, named: dict[int, Slot], variant: str) -> Any:
    inputs = {
        name: _made(part, named, variant) if isinstance(part, Lobe) else named.get(id(part), part)
        for name, part in lobe.parts.items()
    }
    return classes[variant, lobe.name](inputs)
