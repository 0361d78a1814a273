# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures of the shapes of a scene with their weights: rows of tables that kernels read.

A material is a range of leaves, a leaf a closure with a weight. A hit finds its material by the number of its shape in
Mitsuba's registry; another number, another material or another mix of known closures needs no new kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from spectral_core.render.plugins.numbers import table
from spectral_core.render.plugins.paints.interpreter import Interpreter
from spectral_core.render.plugins.paints.tables import SceneTables
from spectral_core.render.plugins.surfaces.kinds import Buffers, ClosureKind
from spectral_core.render.plugins.surfaces.slots import FIRST_TEXTURE, Slot, build_of
from spectral_core.render.plugins.surfaces.sources import Lobe, Programmed, Source, Textured


@dataclass(frozen=True, eq=False)
class Leaf:
    """A closure with its weight: ``constant`` times the ``factors``, some of which are subtracted from 1."""

    lobe: Lobe
    constant: float
    factors: tuple[tuple[Source, bool], ...] = ()


@dataclass
class _Entry:
    """A leaf in the tables: its type, its row, the index of its first factor, and its material."""

    leaf: Leaf
    kind: int
    row: int
    factor: int


FACTOR = 2
"""Entries of a factor in the rows: its value, and 1 if it is subtracted from 1."""


class SurfaceTables:
    """All surfaces of a scene: ``add`` and ``assign`` fill it, ``seal`` writes it to the device, ``take`` edits it."""

    def __init__(self, scene: SceneTables, upsampling: Any) -> None:
        self.mi, self.dr = scene.mi, scene.dr
        self.buffers = Buffers(scene, upsampling, interpreter=Interpreter(scene))
        self.kinds: list[ClosureKind] = []
        self.factor = Slot("number", 0)
        """Reads factors of weights."""
        self._numbers: list[float] = []
        self._codes: list[int] = []
        self._entries: list[_Entry] = []
        self.most_factors = 0
        """Largest number of varying factors of a weight."""
        self._materials: dict[str, tuple[int, int]] = {}
        self._assigned: dict[int, str] = {}
        self._written: dict[str, list[Any]] = {}
        self.leaf_kind = self.leaf_row = self.leaf_constant = self.leaf_factor = self.leaf_factors = None
        self.first_leaf = self.leaf_count = self.material_flags = self.material_of_shape = self.shape_count = None

    def add(self, name: str, leaves: Sequence[Leaf]) -> None:
        """A material by its name."""
        self._materials[name] = (len(self._entries), len(leaves))
        for leaf in leaves:
            kind = self._kind_of(leaf.lobe)
            self._enter_sources(leaf)
            self._entries.append(_Entry(leaf, kind, 0, 0))
            self.most_factors = max(self.most_factors, len(leaf.factors))

    def _kind_of(self, lobe: Lobe) -> int:
        build = lobe.build()
        for number, kind in enumerate(self.kinds):
            if kind.build == build:
                return number
        self.kinds.append(ClosureKind(lobe, self.mi.variant()))
        return len(self.kinds) - 1

    def _enter_sources(self, leaf: Leaf) -> None:
        kind = self.kinds[self._kind_of(leaf.lobe)]
        for slot, source in (*kind.pairs(leaf.lobe), *((self.factor, source) for source, _ in leaf.factors)):
            slot.enter(source, self.buffers.scene)

    def _lay_out(self) -> None:
        """Give each leaf a row with room for any type. The types are in the order of their builds: equal types give an
        equal kernel, whichever material comes first.
        """
        order = sorted(range(len(self.kinds)), key=lambda k: repr(self.kinds[k].build))
        self.kinds = [self.kinds[k] for k in order]
        width = max(kind.width for kind in self.kinds)
        row = 0
        for entry in self._entries:
            entry.kind, entry.row, entry.factor = order.index(entry.kind), row, row + width
            row += width + FACTOR * len(entry.leaf.factors)
        self._numbers, self._codes = [0.0] * row, [0] * row
        for entry in self._entries:
            self._write(entry, is_there=False)

    def _write(self, entry: _Entry, *, is_there: bool) -> None:
        """Write the numbers of a leaf; ``is_there``: a previous leaf of equal build, whose programs' entries are
        reused.
        """
        at = entry.row
        for slot, source in self.kinds[entry.kind].pairs(entry.leaf.lobe):
            self._write_source(slot, source, at + slot.offset, is_there)
        for number, (source, complement) in enumerate(entry.leaf.factors):
            at = entry.factor + FACTOR * number
            self._write_source(self.factor, source, at, is_there)
            self._numbers[at + 1] = float(complement)

    def _write_source(self, slot: Slot, source: Source, at: int, is_there: bool) -> None:
        numbers, codes = self.buffers.plain(source)
        place = slot.places.get(build_of(source), 0)
        if place:
            start = self.buffers.start_of(source, self._codes[at + 1] if is_there else None)
            codes = [place, start, *codes[2:]]
        self._numbers[at : at + len(numbers)] = numbers
        self._codes[at : at + len(codes)] = codes

    def assign(self, shape: Any, name: str) -> None:
        """Assign a material to a shape of Mitsuba."""
        self._assigned[self.number_of(shape)] = name

    def is_assigned(self, shape: Any, name: str) -> bool:
        """True if a shape has a material."""
        return self._assigned.get(self.number_of(shape)) == name

    def has(self, name: str) -> bool:
        """True if a material was added."""
        return name in self._materials

    def number_of(self, shape: Any) -> int:
        """Number of a shape in Mitsuba's registry."""
        return int(self.dr.reinterpret_array(self.mi.UInt32, self.mi.ShapePtr(shape))[0])

    @property
    def most_leaves(self) -> int:
        """Largest number of leaves of a material."""
        return max((count for _, count in self._materials.values()), default=0)

    @property
    def flags(self) -> int:
        """Mitsuba's flags of all materials."""
        found = 0
        for kind in self.kinds:
            found |= kind.flags
        return found

    def seal(self) -> None:
        """Write all rows to the device; existing arrays are kept."""
        if not self.kinds:  # nothing can be hit, but kernels are traced
            self.add("", [Leaf(Lobe("clear", {}), 1.0)])
        entries, buffers = self._entries, self.buffers
        if self.leaf_kind is None:
            self._lay_out()
        for slot in (self.factor, *(slot for kind in self.kinds for slot in kind.slots)):
            slot.choose(buffers.interpreter)
        self._put(buffers.interpreter, "code", buffers.interpreter.code_values)
        self._put(buffers.interpreter, "programs", buffers.interpreter.program_values)
        self._put(buffers, "numbers", self._numbers)
        self._put(buffers, "codes", self._codes)
        self._put(buffers, "program_numbers", buffers.program_values)
        self._put(buffers, "albedos", buffers.albedo_values)
        self._put(buffers, "spectra", buffers.spectrum_rows)
        self._put(self, "leaf_kind", [entry.kind for entry in entries])
        self._put(self, "leaf_row", [entry.row for entry in entries])
        self._put(self, "leaf_constant", [float(entry.leaf.constant) for entry in entries])
        self._put(self, "leaf_factor", [entry.factor for entry in entries])
        self._put(self, "leaf_factors", [len(entry.leaf.factors) for entry in entries])
        # row 0 belongs to no material: for rays that miss, and for shapes without an entry
        runs = [(0, 0), *self._materials.values()]
        self._put(self, "first_leaf", [first for first, _ in runs])
        self._put(self, "leaf_count", [count for _, count in runs])
        self._put(self, "material_flags", [self._flags_of(first, count) for first, count in runs])
        places = {name: number for number, name in enumerate(self._materials, 1)}
        last = max(self._assigned, default=0)
        self._put(self, "material_of_shape", [places.get(self._assigned.get(k, ""), 0) for k in range(last + 1)])
        if self._written.get("shape_count") != [last + 1]:
            self.shape_count, self._written["shape_count"] = self.dr.opaque(self.mi.UInt32, last + 1), [last + 1]

    def _flags_of(self, first: int, count: int) -> int:
        found = 0
        for entry in self._entries[first : first + count]:
            found |= self.kinds[entry.kind].flags
        return found

    def _put(self, owner: Any, name: str, values: list[Any]) -> None:
        key = [each.tobytes() for each in values] if name == "spectra" else list(values)
        if self._written.get(name) == key:
            return
        is_real = name in ("numbers", "program_numbers", "albedos", "leaf_constant", "spectra")
        made = table(self.mi.Float, values or [0.0, 0.0]) if is_real else table(self.mi.UInt32, values or [0])
        setattr(owner, name, made)
        self._written[name] = key

    def take(self, name: str, leaves: Sequence[Leaf], carry: Callable[[Any, Any], bool]) -> bool:
        """Change the numbers of a material if that needs no new kernel. ``carry``: copies one texture into another.

        False if it is impossible; the tables must not be used any more after that.
        """
        first, count = self._materials[name]
        entries = self._entries[first : first + count]
        kinds = [kind for kind in map(self._known_kind, leaves) if kind is not None]
        if len(leaves) != count or len(kinds) != count:
            return False
        if any(len(a.leaf.factors) != len(b.factors) for a, b in zip(entries, leaves, strict=True)):
            return False
        same = [(a, b) for a, b, kind in zip(entries, leaves, kinds, strict=True) if a.kind == kind]
        if not self._reads([entry for entry, _ in same], [leaf for _, leaf in same], carry):
            return False
        for entry, leaf, kind in zip(entries, leaves, kinds, strict=True):
            if entry.kind != kind and not all(slot.knows(source) for slot, source in self._sources(kind, leaf)):
                return False
            is_there, entry.leaf, entry.kind = entry.kind == kind, leaf, kind
            self._write(entry, is_there=is_there)
        self.seal()
        return True

    def _known_kind(self, leaf: Leaf) -> int | None:
        """Number of the type of a leaf; None if the kernel does not contain it."""
        build = leaf.lobe.build()
        return next((number for number, kind in enumerate(self.kinds) if kind.build == build), None)

    def _sources(self, kind: int, leaf: Leaf) -> Iterator[tuple[Slot, Source]]:
        yield from self.kinds[kind].pairs(leaf.lobe)
        yield from ((self.factor, source) for source, _ in leaf.factors)

    def _reads(self, entries: Sequence[_Entry], leaves: Sequence[Leaf], carry: Callable[[Any, Any], bool]) -> bool:
        """Let readers of programs and textures read the contents of new leaves."""
        changed: dict[tuple[int, Any], tuple[Slot, Source, list[Source]]] = {}
        for entry, leaf in zip(entries, leaves, strict=True):
            pairs = zip(self._sources(entry.kind, entry.leaf), self._sources(entry.kind, leaf), strict=True)
            for (slot, old), (_, new) in pairs:
                if (build_of(old) is None) != (build_of(new) is None):
                    return False
                if build_of(new) != build_of(old):
                    changed.setdefault((id(slot), build_of(old)), (slot, old, []))[2].append(new)
        return all(self._replace(slot, old, new, carry) for slot, old, new in changed.values())

    def _replace(self, slot: Slot, old: Source, new: list[Source], carry: Callable[[Any, Any], bool]) -> bool:
        """Let one reader read the new contents of all its uses."""
        build, wanted = build_of(old), build_of(new[0])
        uses = sum(
            of is slot and build_of(source) == build
            for entry in self._entries
            for of, source in self._sources(entry.kind, entry.leaf)
        )
        if uses != len(new) or any(build_of(each) != wanted for each in new):
            return False
        if isinstance(old, Programmed) and isinstance(new[0], Programmed):
            if old.program.shape != new[0].program.shape or slot.first_program is not None:
                return False
            slot.programs[slot.places[build] - 1].traced.take_contents(new[0].program)
            slot.places[wanted] = slot.places.pop(build)
            return True
        if not isinstance(old, Textured) or not isinstance(new[0], Textured):
            return False
        # into the texture that the kernel reads, which is that of the first material, not of the latest
        if not carry(slot.textures[slot.places[build] - FIRST_TEXTURE], new[0].texture):
            return False
        slot.places[wanted] = slot.places.pop(build)
        return True
