# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of a closure at a hit: read once from the tables, then returned at every use."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.facets.albedo import LAYERS, SIZE
from spectral_core.render.plugins.paints import spectrum_rows
from spectral_core.render.plugins.paints.interpreter import Interpreter
from spectral_core.render.plugins.paints.loaded import TracedProgram
from spectral_core.render.plugins.paints.tables import SceneTables
from spectral_core.render.plugins.surfaces.sources import Programmed, Sampled, Source, Textured
from spectral_core.scene.shading.arithmetic import luminance

FIRST_TEXTURE = 1 << 16
"""Number of the first texture among the readers of an input; programs count from 1."""
SPECTRUM = 1 << 30
"""Number of the reader of sampled spectra."""
MOST_PROGRAMS = 6
"""Most programs of an input that have code of their own; if there are more, the interpreter runs them."""
WIDTHS = {"number": 2, "color": 3, "bright": 4, "vector": 2, "table": 1}
"""Entries of an input in the row of a closure: numbers, and integers (reader, first number)."""
COLORS = ("color", "bright")
"""Types of inputs that are spectra or colors."""


class ProgramReader:
    """Computes programs of one structure that read the same images and tables."""

    def __init__(self, traced: TracedProgram, kind: str) -> None:
        self.traced, self.kind = traced, kind

    def __call__(self, buffers: Any, start: Any, si: Any, active: Any) -> Any:
        """One number for inputs of that type, else three."""
        import drjit as dr
        import mitsuba as mi

        found = self.traced.value(buffers.program_numbers, start, si, active)
        parts = found if isinstance(found, tuple) else (found,) * 3
        red, green, blue = (dr.select(dr.isfinite(part), part, 0.0) for part in parts)
        if self.kind != "number":
            return mi.Color3f(red, green, blue)
        return red if self.traced.program.width == 1 else luminance(None, (red, green, blue))


class AlbedoLookup:
    """One of the stacked albedo tables at a hit, called as ``(roughness, cosine)``."""

    def __init__(self, stack: Any, first: Any) -> None:
        self.stack, self.first = stack, first

    def __call__(self, roughness: Any, cosine: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        last = SIZE - 1
        # as ``albedo.nodes`` are spaced
        x, y = dr.safe_sqrt(dr.safe_sqrt(cosine)), dr.safe_sqrt(roughness)
        x, y = (dr.clip(place, 0.0, 1.0) * last for place in (x, y))
        column, row = (dr.minimum(mi.UInt32(place), last - 1) for place in (x, y))
        right, up = x - mi.Float(column), y - mi.Float(row)
        at = self.first + row * SIZE + column
        low, next_low, high, next_high = (dr.gather(mi.Float, self.stack, at + k) for k in (0, 1, SIZE, SIZE + 1))
        return dr.lerp(dr.lerp(low, next_low, right), dr.lerp(high, next_high, right), up)

    def layer(self, place: Any, roughness: Any, cosine: Any, count: int = LAYERS) -> Any:
        """Value of a stack of ``count`` tables; ``place``: in [0, 1] from the first to the last."""
        import drjit as dr
        import mitsuba as mi

        place = dr.clip(place, 0.0, 1.0) * (count - 1)
        low = dr.minimum(mi.UInt32(place), count - 2)
        below, above = (
            AlbedoLookup(self.stack, self.first + (low + k) * (SIZE * SIZE))(roughness, cosine) for k in (0, 1)
        )
        return dr.lerp(below, above, place - mi.Float(low))

    def entry(self, place: Any) -> Any:
        """One number of the table, by its place."""
        import drjit as dr
        import mitsuba as mi

        return dr.gather(mi.Float, self.stack, self.first + place)


class Slot:
    """An input. ``offset``: its first entry in a closure's row; ``readers``: programs and textures that compute it."""

    def __init__(self, kind: str, offset: int) -> None:
        self.kind, self.offset = kind, offset
        self.programs: list[ProgramReader] = []
        self.textures: list[Any] = []
        self.places: dict[Any, int] = {}
        """By build of a source: the entry of its program or texture in a row."""
        self.has_numbers = self.has_spectra = False
        self.first_program: int | None = None
        """Number of the first of its programs in the interpreter; None if each has its own code."""
        self.value: Any = None
        self.computed: Any = None
        """Result of its program, if that ran before the type of the closure was known."""

    def enter(self, source: Source, tables: SceneTables) -> int:
        """Entry of a row for the reader of a source; 0 for a plain number."""
        build = build_of(source)
        if build is None:
            self.has_numbers = True
            return 0
        if build not in self.places:
            if isinstance(source, Programmed):
                self.programs.append(ProgramReader(TracedProgram(tables, source.program), self.kind))
                self.places[build] = len(self.programs)
            elif isinstance(source, Textured):
                self.places[build] = FIRST_TEXTURE + len(self.textures)
                self.textures.append(source.texture)
            elif isinstance(source, Sampled):
                self.places[build], self.has_spectra = SPECTRUM, True
        return self.places[build]

    def knows(self, source: Source) -> bool:
        """True if the kernel can read a source here."""
        build = build_of(source)
        return self.has_numbers if build is None else build in self.places

    def choose(self, interpreter: Interpreter) -> None:
        """Select the interpreter if there are many programs."""
        if len(self.programs) > MOST_PROGRAMS and self.first_program is None:
            numbers = [interpreter.enter(read.traced.program) for read in self.programs]
            self.first_program = None if None in numbers else numbers[0]

    def eval(self, si: Any, active: Any = True) -> Any:
        """The value as a spectrum."""
        import mitsuba as mi

        return mi.Spectrum(self.value) if self.kind == "number" else self.value

    def eval_1(self, si: Any, active: Any = True) -> Any:
        """The value as a number."""
        return self.value

    eval_3 = eval_1

    def __call__(self, roughness: Any, cosine: Any) -> Any:
        """Entry of a table of albedos."""
        return self.value(roughness, cosine)

    def layer(self, place: Any, roughness: Any, cosine: Any, count: int = LAYERS) -> Any:
        """Value of a stack of tables of albedos."""
        return self.value.layer(place, roughness, cosine, count)

    def entry(self, place: Any) -> Any:
        """Number of a table at a place."""
        return self.value.entry(place)

    def read(self, buffers: Any, row: Any, si: Any, active: Any) -> None:
        """Compute the value at a hit; ``row``: first entry of the closure's row."""
        import drjit as dr
        import mitsuba as mi

        at = row + self.offset
        if self.kind == "table":
            self.value = AlbedoLookup(buffers.albedos, dr.gather(mi.UInt32, buffers.codes, at, active))
            return
        found = self._number(buffers, at, si, active) if self.has_numbers else None
        if not self.places:
            self.value = found
            return
        code = dr.gather(mi.UInt32, buffers.codes, at, active)
        start = dr.gather(mi.UInt32, buffers.codes, at + 1, active)
        if self.has_spectra:
            mine = active & (code == SPECTRUM)
            value = spectrum_rows.look_up(buffers.spectra, start, si.wavelengths, mine)
            found = value if found is None else dr.select(mine, value, found)
        if self.programs:
            mine = active & (code > 0) & (code < FIRST_TEXTURE)
            found = self._chosen(found, mine, self._program_values, (buffers, code - 1, start, si))
        if self.textures:
            mine = active & (code >= FIRST_TEXTURE) & (code < SPECTRUM)
            found = self._chosen(found, mine, self._texture_values, (buffers, code - FIRST_TEXTURE, start, si))
        self.value = found

    def _number(self, buffers: Any, at: Any, si: Any, active: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        if self.kind not in COLORS:
            return dr.gather(mi.Float, buffers.numbers, at, active)
        found = [dr.gather(mi.Float, buffers.numbers, at + k, active) for k in range(3)]
        color = mi.srgb_model_eval(mi.Vector3f(*found), si.wavelengths) if mi.is_spectral else mi.Color3f(*found)
        return color * dr.gather(mi.Float, buffers.numbers, at + 3, active) if self.kind == "bright" else color

    def _chosen(self, found: Any, mine: Any, read: Any, where: tuple[Any, ...]) -> Any:
        """``found``, but the result of ``read`` for the lanes ``mine``."""
        import drjit as dr

        buffers, code, start, si = where
        if found is None:
            return read(buffers, code, start, si, mine)

        def other(_found: Any, code: Any, start: Any, si: Any, mine: Any) -> Any:
            return dr.select(mine, read(buffers, code, start, si, mine), _found)

        return dr.if_stmt((found, code, start, si, mine), mine, other, lambda found, *_: found)

    def _program_values(self, buffers: Any, code: Any, start: Any, si: Any, active: Any) -> Any:
        import drjit as dr

        if self.first_program is not None:
            found = self.computed
            if found is None:
                found = buffers.interpreter.run(buffers.program_numbers, (code + self.first_program, start), si, active)
            if self.kind == "number":
                wide = any(read.traced.program.width == 3 for read in self.programs)
                found = luminance(None, (found.x, found.y, found.z)) if wide else found.x
            return self._as_kind(buffers, found, si)
        if self.computed is not None:
            return self._as_kind(buffers, self.computed.x if self.kind == "number" else self.computed, si)
        targets = [lambda start, si, active, read=read: read(buffers, start, si, active) for read in self.programs]
        found = (
            targets[0](start, si, active)
            if len(targets) == 1
            else dr.switch(code, targets, start, si, active, label=self.kind)
        )
        return self._as_kind(buffers, found, si)

    def _as_kind(self, buffers: Any, found: Any, si: Any) -> Any:
        """The result of a program in the type of the closure's input."""
        import drjit as dr

        if self.kind not in COLORS:
            return found
        rgb = dr.clip(found, 0.0, 1.0) if self.kind == "color" else dr.maximum(found, 0.0)
        if buffers.upsampling is None:
            return rgb
        if self.kind == "color":
            return buffers.upsampling(tuple(rgb), si.wavelengths)
        size = dr.maximum(dr.max(rgb), 1.0)
        return buffers.upsampling(tuple(rgb / size), si.wavelengths) * size

    def _texture_values(self, buffers: Any, code: Any, start: Any, si: Any, active: Any) -> Any:
        import drjit as dr

        name = {"number": "eval_1", "vector": "eval_3"}.get(self.kind, "eval")
        targets = [
            lambda start, si, active, texture=texture: getattr(texture, name)(si, active) for texture in self.textures
        ]
        return (
            targets[0](start, si, active)
            if len(targets) == 1
            else dr.switch(code, targets, start, si, active, label=self.kind)
        )


def build_of(source: Source) -> Any:
    """Key that is equal for sources with the same reader; None for plain numbers."""
    if isinstance(source, Programmed):
        return (source.program.shape, *(id(i.data) for i in source.program.instructions))
    if isinstance(source, Sampled):
        return "spectrum"
    return ("texture", id(source.texture)) if isinstance(source, Textured) else None
