# SPDX-License-Identifier: GPL-3.0-or-later
"""Placed meshes as PLY files: in world space, or once in object space for many instances."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_export import closures
from spectral_core.render.mitsuba_export import xml_elements as xml
from spectral_core.render.mitsuba_export.draft import Draft
from spectral_core.render.mitsuba_export.media import medium
from spectral_core.render.mitsuba_scene.emission import is_dark
from spectral_core.render.mitsuba_scene.geometry import Part, has_area, split_by_material, transformed
from spectral_core.render.mitsuba_scene.shapes import PLAIN, SHARED_TRIANGLES
from spectral_core.scene import Instance, Material, Scene

_WRITTEN = {
    "name", "mesh", "world_from_object", "materials", "group", "color", "index", "random", "attributes", "shown_as",
    "asset",
}  # fmt: skip


class Bodies:
    """The shapes of a scene, with the materials and media that they use defined before them."""

    def __init__(self, draft: Draft, scene: Scene, around: str) -> None:
        """``around``: identifier of the world's medium, "" for none."""
        self.draft, self.scene, self.around = draft, scene, around
        self.defined: list[xml.Element] = []
        self._materials = {material.name: material for material in scene.materials}
        self._identifiers: dict[str, str] = {}
        self._media: dict[str, str] = {}
        self._parts = {mesh.name: split_by_material(mesh) for mesh in scene.meshes}
        self._groups: dict[tuple[str, tuple[str, ...]], str] = {}
        self._uses = Counter((instance.mesh, instance.materials) for instance in scene.instances)

    def shapes(self) -> list[xml.Element]:
        """Shapes of all instances; ``defined`` then has what they refer to."""
        return [shape for instance in self.scene.instances for shape in self._of(instance)]

    def _of(self, instance: Instance) -> Iterator[xml.Element]:
        self.draft.leftover(instance.name, instance, _WRITTEN)
        matrix = instance.world_from_object
        if np.linalg.matrix_rank(matrix[:3, :3]) < 2:
            self.draft.note(instance.name, "is scaled to a line or a point, so nothing of it can be seen")
            return
        if self._is_shared(instance):
            reference = xml.reference(self._group(instance))
            yield xml.plugin("shape", "instance", reference, xml.transform("to_world", matrix))
            return
        for index, part in self._parts[instance.mesh].items():
            placed = transformed(part, matrix)
            if has_area(placed):
                yield self._shape(instance, index, placed, instance.name)

    def _is_shared(self, instance: Instance) -> bool:
        """True if copies have enough triangles for a group, and neither emission nor medium."""
        uses = self._uses[(instance.mesh, instance.materials)]
        triangles = sum(len(part.triangles) for part in self._parts[instance.mesh].values())
        if uses < 2 or uses * triangles < SHARED_TRIANGLES or np.linalg.cond(instance.world_from_object[:3, :3]) > 1e6:
            return False
        materials = [self._material(instance, index) for index in self._parts[instance.mesh]]
        return all(item.medium is None and is_dark(item.surface) for item in materials)

    def _group(self, instance: Instance) -> str:
        key = (instance.mesh, instance.materials)
        if key not in self._groups:
            parts = self._parts[instance.mesh].items()
            shapes = [self._shape(instance, index, part, instance.mesh) for index, part in parts]
            identifier = self._groups[key] = self.draft.name(f"group_{instance.mesh}", "id")
            self.defined.append(xml.plugin("shape", "shapegroup", *shapes, identifier=identifier))
        return self._groups[key]

    def _material(self, instance: Instance, index: int) -> Material:
        if not instance.materials:
            return PLAIN
        return self._materials[instance.materials[min(index, len(instance.materials) - 1)]]

    def _shape(self, instance: Instance, index: int, part: Part, name: str) -> xml.Element:
        material = self._material(instance, index)
        subject = material.name or instance.name
        path = self.draft.file("meshes", name, ".ply", lambda path: write_ply(path, part))
        children = [xml.string("filename", path), xml.boolean("face_normals", part.normals is None)]
        if part.uvs is not None:
            children.append(xml.boolean("flip_tex_coords", True))
        children.append(xml.reference(self._bsdf(material, subject)))
        inside = self._inside(material, subject)
        if inside:
            children.append(xml.reference(inside, "interior"))
        if self.around:
            children.append(xml.reference(self.around, "exterior"))
        emitter = closures.emitter(self.draft, material.surface, subject)
        return xml.plugin("shape", "ply", *children, *([] if emitter is None else [emitter]))

    def _bsdf(self, material: Material, subject: str) -> str:
        if material.name not in self._identifiers:
            identifier = self.draft.name(material.name or "no material", "id")
            made = closures.bsdf(self.draft, material.surface, subject)
            made.set("id", identifier)
            self._identifiers[material.name] = identifier
            self.defined.append(made)
        return self._identifiers[material.name]

    def _inside(self, material: Material, subject: str) -> str:
        if material.medium is None:
            return ""
        if material.name not in self._media:
            identifier = self.draft.name(f"medium_{material.name}", "id")
            made = medium(self.draft, material.medium, subject, identifier)
            self._media[material.name] = "" if made is None else identifier
            if made is not None:
                self.defined.append(made)
        return self._media[material.name]


def write_ply(path: Path, part: Part) -> None:
    """Write triangles as a binary PLY file with normals and UVs where they exist."""
    from spectral_core.files.whole import write_bytes

    columns: list[tuple[str, Any]] = [(name, part.positions[:, k]) for k, name in enumerate("xyz")]
    if part.normals is not None:
        columns += [(f"n{name}", part.normals[:, k]) for k, name in enumerate("xyz")]
    if part.uvs is not None:
        columns += [(name, part.uvs[:, k]) for k, name in enumerate("uv")]
    vertices = np.stack([values for _, values in columns], axis=1).astype("<f4")
    faces = np.empty(len(part.triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, part.triangles
    header = [
        "ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}",
        *(f"property float {name}" for name, _ in columns),
        f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header",
    ]  # fmt: skip
    write_bytes(path, ("\n".join(header) + "\n").encode("ascii") + vertices.tobytes() + faces.tobytes())
