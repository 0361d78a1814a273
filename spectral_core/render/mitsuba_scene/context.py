# SPDX-License-Identifier: GPL-3.0-or-later
"""Data for the translation of every part of a scene: the renderer, the type of transport, and the list of notes."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from spectral_core.render.lights.listing import LightList
from spectral_core.render.plugins.mesh_tables import MeshTables
from spectral_core.render.plugins.paints.computed import computed_classes
from spectral_core.render.plugins.paints.loaded import LoadedProgram
from spectral_core.render.plugins.paints.tables import SceneTables
from spectral_core.render.plugins.paints.upsampling import Upsampling
from spectral_core.render.plugins.surfaces.scene_bsdf import scene_bsdf_class
from spectral_core.render.plugins.surfaces.table import SurfaceTables
from spectral_core.render.trace.reradiation import Dyed
from spectral_core.scene import Note, Program
from spectral_core.spectra.spectrum import Spectrum


@dataclass
class Context:
    """Translation of one scene to Mitsuba.

    ``mitsuba``: the module with its variant set. ``spectral``: spectral or RGB transport. ``switches``: functions by
    light group that turn its emitters on and off, None without groups. ``notes``: features that are approximated, each
    once. ``white``: the white that emitted colors tint, with Y = 1; None for D65.
    """

    mitsuba: Any
    spectral: bool
    switches: dict[str, list[Callable[[bool], None]]] | None = None
    notes: list[Note] = field(default_factory=list)
    white: Spectrum | None = None
    lights: LightList | None = None
    """Tables of lamps and emissive meshes for our path integrator; None if Mitsuba's emitters are used."""
    movable: bool = False
    """True if meshes will be edited later."""
    made: list[Any] = field(default_factory=list)
    """All objects in the order of their creation: a live view edits them and collects their arrays."""

    filter_glossy: float = 0.0
    """Strength of Filter Glossy, which blurs mirrors and glass that diffuse light reaches; 0 for none."""
    has_holdouts: bool = False
    """True if any surface is a holdout."""
    has_subsurface: bool = False
    """True if any surface has subsurface scattering."""
    has_disks: bool = False
    """True if some of it is by the profile of Christensen and Burley."""
    has_dyes: bool = False
    """True if ultraviolet light below the visible wavelengths is traced, too, because it excites dyes."""
    dyed: dict[str, Dyed] = field(default_factory=dict)
    """By material its fluorescent closures, in spectral transport."""
    material_of_shape: list[tuple[Any, str]] = field(default_factory=list)
    """Every mesh and the name of its material."""

    @cached_property
    def tables(self) -> SceneTables:
        """Data of the scene that shading programs read."""
        import drjit

        return SceneTables(self.mitsuba, drjit)

    @cached_property
    def upsampling(self) -> Upsampling | None:
        """Conversion of colors to spectra at a hit point; None in RGB transport."""
        import drjit

        return Upsampling(self.mitsuba, drjit) if self.spectral else None

    @cached_property
    def bsdf(self) -> Any:
        """The one BSDF of all shapes; its ``surfaces`` hold the material of each shape."""
        return self._kept(scene_bsdf_class(self.mitsuba.variant())(self._surfaces()))

    def _surfaces(self) -> SurfaceTables:
        return SurfaceTables(self.tables, self.upsampling)

    @cached_property
    def meshes(self) -> MeshTables:
        """The triangles of all shapes."""
        made = self.tables.meshes = MeshTables(self.tables, movable=self.movable)
        return made

    def adopt(self, bsdf: Any, meshes: MeshTables) -> None:
        """Use the BSDF and the triangles of another scene of equal geometry, which has ended."""
        bsdf.surfaces, meshes.scene = self._surfaces(), self.tables
        self.bsdf, self.meshes, self.tables.meshes = self._kept(bsdf), meshes, meshes

    def computed(self, program: Program, light: Any = None) -> Any:
        """Texture of a shading program; ``light``: texture of the white that an emitted color tints."""
        kind, _ = computed_classes(self.mitsuba.variant())
        return self._kept(kind(LoadedProgram(self.tables, program), self.upsampling, light))

    def constant(self, value: float) -> Any:
        """Texture of one number, which kernels read from memory."""
        return self._kept(computed_classes(self.mitsuba.variant())[1](value))

    def note(self, subject: str, message: str) -> None:
        """Add a note, once."""
        if not any(note.subject == subject and note.message == message for note in self.notes):
            self.notes.append(Note(subject, message))

    def switched(self, texture: Any, group: str) -> Any:
        """An emitter's color under its light group's switch, if groups are separate."""
        if self.switches is None:
            return texture
        paint = self.load({"type": "switched_paint", "color": texture})
        self.switches.setdefault(group, []).append(paint.switch)
        return paint

    def load(self, description: dict[str, Any]) -> Any:
        """Mitsuba object of a description.

        One thread and no merging of equal children: emitters keep their order and identity, so that equal seeds give
        equal paths.
        """
        return self._kept(self.mitsuba.load_dict(description, parallel=False, optimize=False))

    def read_numbers(self, made: Any, names: Collection[str] = ()) -> Any:
        """Let kernels read numbers of one of Mitsuba's objects from memory, so that others need no new kernel: those of
        ``names``, all if there are none. Returns the object.
        """
        import drjit as dr

        parameters = self.mitsuba.traverse(made)
        for name, value in list(parameters.items()):
            if name in names or (not names and dr.is_jit_v(value)):
                dr.make_opaque(value)
                parameters[name] = value
                parameters.set_dirty(name)
        parameters.update()
        return made

    def _kept(self, made: Any) -> Any:
        self.made.append(made)
        return made
