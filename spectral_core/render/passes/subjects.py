# SPDX-License-Identifier: GPL-3.0-or-later
"""Data on objects and materials for passes, by the numbers of the shapes that rays hit."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene import LoadedScene, paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.paint import color_pixels, emitted_rgb
from spectral_core.render.passes.cryptomatte import id_of
from spectral_core.render.plugins.numbers import table
from spectral_core.scene import Color, Computed, ImageTexture, Scene
from spectral_core.scene.passes import Passes
from spectral_core.spectra.spectrum import Spectrum


class Subjects:
    """Tables by shape: rows of objects and of materials, and the meaning of each row.

    ``names``: of objects, materials and assets, in the order of their rows, from 1; ``ids``: their ids by row.
    """

    def __init__(self, mitsuba: Any, scene: Scene, loaded: LoadedScene, wanted: Passes) -> None:
        self._mi = mitsuba
        context, placed = loaded.parts.context, loaded.parts.placed
        materials = {material.name: row for row, material in enumerate(scene.materials, 1)}
        meshes = {mesh.name: mesh for mesh in scene.meshes}
        objects = [(shape, row) for row, item in enumerate(scene.instances, 1) for shape in placed[item.name]]
        material_rows = [(shape, materials.get(name, 0)) for shape, name in context.material_of_shape]
        self._objects, self._materials = self._rows(objects), self._rows(material_rows)
        self.names = {
            "CryptoObject": [item.shown_as or item.name for item in scene.instances],
            "CryptoMaterial": [item.shown_as or item.name for item in scene.materials],
            "CryptoAsset": [item.asset or item.shown_as or item.name for item in scene.instances],
        }
        self.ids = {kind: np.array([0.0, *map(id_of, names)], np.float32) for kind, names in self.names.items()}
        self._distinct = {kind: _firsts(names) for kind, names in self.names.items()}
        self.numbers = {kind: table(mitsuba.UInt32, [0, *rows]) for kind, rows in self._distinct.items()}
        self.object_index = table(mitsuba.Float, [0.0, *(float(item.index) for item in scene.instances)])
        self.material_index = table(mitsuba.Float, [0.0, *(float(item.index) for item in scene.materials)])
        mapped = {name: float(mesh.uvs is not None and mesh.has_uv_map) for name, mesh in meshes.items()}
        has_uv = [mapped[item.mesh] for item in scene.instances]
        self.has_uv = table(mitsuba.Float, [0.0, *has_uv])
        self.outputs = _outputs(context, scene, wanted)
        """By AOV: the material's row and three textures of numbers."""
        shows_world = not scene.film.transparent or "Environment" in wanted.names  # as in Cycles
        of_world = {name: _numbers(context, value) for name, value in wanted.of_world if shows_world}
        self.of_world = {name: textures for name, textures in of_world.items() if textures is not None}
        """By AOV: three textures of numbers where rays meet the environment."""
        if any(self.outputs.values()) or self.of_world:
            context.tables.rebuild()  # writes the data on objects that the programs of the AOVs read

    def _rows(self, shapes: list[tuple[Any, int]]) -> Any:
        import drjit as dr

        mi = self._mi
        numbers = [(int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0]), row) for shape, row in shapes]
        rows = np.zeros(max((number for number, _ in numbers), default=0) + 1, np.uint32)
        for number, row in numbers:
            rows[number] = row
        return table(mi.UInt32, rows)

    def of_hit(self, tables: Any, si: Any, active: Any) -> tuple[Any, Any]:
        """Rows of the object and of the material of a hit; 0 if there is none."""
        import drjit as dr

        mi = self._mi
        found = []
        for rows, number in ((self._objects, tables.shape_number(si)), (self._materials, tables.number(si.shape))):
            known = active & (number < dr.opaque(mi.UInt32, dr.width(rows)))
            found.append(dr.gather(mi.UInt32, rows, number, known))
        return found[0], found[1]


def _firsts(names: list[str]) -> list[int]:
    """For each name the number, from 1, of the first equal one."""
    first: dict[str, int] = {}
    return [first.setdefault(name, number) for number, name in enumerate(names, 1)]


def _outputs(context: Context, scene: Scene, wanted: Passes) -> dict[str, list[tuple[int, list[Any]]]]:
    found: dict[str, list[tuple[int, list[Any]]]] = {name: [] for name, _ in wanted.aovs}
    for row, material in enumerate(scene.materials, 1):
        for name, value in material.outputs:
            if name in found and material.surface is not None:  # the border of a volume has no values
                textures = _numbers(context, value)
                if textures is None:
                    context.note(material.name, f"AOV {name!r} is a mix of textures, which passes do not hold; it is 0")
                else:
                    found[name].append((row, textures))
    return found


def _numbers(context: Context, value: Any) -> list[Any] | None:
    """Three textures of numbers: red, green, blue, or the same one three times."""
    if isinstance(value, (int, float)):
        return [context.constant(float(value))] * 3
    if isinstance(value, (Color, Spectrum)):
        return [context.constant(float(part)) for part in emitted_rgb(value)]
    if isinstance(value, Computed):
        made = context.computed(value.program)
        return [_Channel(made, k) for k in range(3)] if value.program.width == 3 else [made] * 3
    if isinstance(value, ImageTexture):
        pixels = color_pixels(value)
        parts = [np.ascontiguousarray(pixels[..., min(k, pixels.shape[2] - 1)][..., None]) for k in range(3)]
        return [paint.bitmap(context, value, part, "") for part in parts]
    return None


class _Channel:
    """One channel of a texture of three."""

    def __init__(self, texture: Any, channel: int) -> None:
        self._texture, self._channel = texture, channel

    def eval_1(self, si: Any, active: Any) -> Any:
        return self._texture.eval_3(si, active)[self._channel]
