# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of a loaded scene; each is made in place, or refused without a reason.

A refusal is no error: the whole scene is then loaded again, which is always correct.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from spectral_core.render.job import Loaded
from spectral_core.render.live import media
from spectral_core.render.live.in_place.transplant import transplant
from spectral_core.render.live.trees import Trees, far_emitters
from spectral_core.render.mitsuba_scene import geometry, light, surface
from spectral_core.render.mitsuba_scene.assemble import bounding_sphere
from spectral_core.render.mitsuba_scene.light import LightObject
from spectral_core.render.plan.inventory import dyed
from spectral_core.render.same import equal
from spectral_core.scene import Instance, Light, Material, Mesh, Scene, SunLight, World

LEAST_VOLUME = 1e-6
"""Least condition of a matrix, as a ratio: flatter ones cannot be inverted for an instance."""


class Edit:
    """One change of a loaded scene from ``old`` to ``new``. Call ``finish`` after all parts of the change."""

    def __init__(self, loaded: Loaded, old: Scene, new: Scene, trees: Trees | None = None) -> None:
        self._mi, self._loaded, self._parts = loaded.mitsuba, loaded, loaded.scene.parts
        self._old, self._new = old, new
        self._trees = trees
        self._in_trees: list[Callable[[Trees], None]] = []
        """Changes of single search trees."""
        self._moved = False
        """True if all search trees must be built anew."""
        self._rows_changed = self._vertices_changed = self._faces_changed = False

    def finish(self) -> None:
        """Update the search trees if anything has moved."""
        if self._loaded.scene.chosen is not None:
            self._loaded.scene.chosen.weigh(self._new)
        if self._rows_changed:
            self._parts.context.tables.rebuild()
        if self._vertices_changed:
            self._parts.context.meshes.write_vertices(faces=self._faces_changed)
        if self._moved or (self._in_trees and not self._updated_trees()):
            self._loaded.scene.scene.parameters_changed()
            # Mitsuba's environment hears of the scene's size before that is computed
            self._loaded.scene.scene.parameters_changed()
            if self._trees is not None:
                self._trees.tell_size()
            else:
                for emitter in far_emitters(self._loaded.scene.scene):
                    emitter.set_scene(self._loaded.scene.scene)

    def _updated_trees(self) -> bool:
        """Change single trees; False if that is not possible."""
        import drjit as dr

        if self._trees is None:
            return False
        dr.sync_thread()  # a launch may still be tracing
        for change in self._in_trees:
            change(self._trees)
        return self._trees.finish()

    def _made(self) -> int:
        return len(self._parts.context.made)

    def _drop(self, kept: int) -> None:
        """Free objects that were loaded only to copy their values."""
        del self._parts.context.made[kept:]

    def material(self, old: Material, new: Material) -> bool:
        """Change the numbers of a material."""
        if dyed(old) or dyed(new):
            return False  # the emission of dyes is stored in tables of the whole scene
        if not equal(old.medium, new.medium) and not self._medium(old, new):
            return False
        surfaces = self._parts.context.bsdf.surfaces
        if not surfaces.has(old.name):  # not assigned to any rendered object
            return True
        context, kept = self._parts.context, self._made()
        was = surface.emission(context, old.surface, old.name)
        radiance = surface.emission(context, new.surface, new.name)
        if (was is None) != (radiance is None):
            self._drop(kept)
            return False
        made = surface.leaves_of(context, new.surface, new.name)
        done = surfaces.take(new.name, made, lambda mine, given: transplant(mine, given, self._mi))
        if done and radiance is not None:
            done = all(transplant(emitter.radiance, radiance, self._mi) for emitter in self._emitters_of(new.name))
        self._drop(kept)
        return done

    def _medium(self, old: Material, new: Material) -> bool:
        """Change the numbers of a material's medium."""
        if old.medium is None or new.medium is None:
            return False
        kept = self._made()
        done = media.take(self._loaded, new.name, new.medium)
        self._drop(kept)
        return done

    def _emitters_of(self, name: str) -> list[Any]:
        """Emitters of the shapes that have a material."""
        found = []
        for instance in self._new.instances:
            if name in instance.materials:
                shapes = self._parts.placed[instance.name]
                surfaces = self._parts.context.bsdf.surfaces
                assigned = [shape for shape in shapes if surfaces.is_assigned(shape, name)]
                found += [shape.emitter() for shape in assigned if shape.emitter() is not None]
        return found

    def light(self, old: Light, new: Light) -> bool:
        """Change the numbers or the position of a lamp."""
        rules = ("group", "hidden_from", "max_bounces", "camera_visible", "casts_shadow", "is_met")
        if type(old) is not type(new) or any(not equal(_of(old, name), _of(new, name)) for name in rules):
            return False
        kept = self._made()
        made = light.light_objects(self._parts.context, new, bounding_sphere(self._new))
        there = self._parts.lights[old.name]
        done = len(made) == len(there)
        for mine, given in zip(there, made, strict=False):
            done = done and self._carry(mine, given)
        self._drop(kept)
        return done

    def _carry(self, mine: LightObject, given: LightObject) -> bool:
        if not transplant(mine.emitter, given.emitter, self._mi):
            return False
        if mine.entry is mine.emitter:
            return True
        own, theirs = self._mi.traverse(mine.entry), self._mi.traverse(given.entry)
        names = [name for name in own.keys() if "." not in name]  # noqa: SIM118 - not a dict
        changed = [name for name in names if not _same(own[name], theirs[name])]
        if any(np.shape(own[name]) != np.shape(theirs[name]) for name in changed):
            return False
        for name in changed:
            own[name] = theirs[name]
        if changed:
            own.update()
            mine.entry.surface_area()  # Mitsuba builds its table of areas at the first query
            self._parts.context.meshes.add(mine.entry)
            self._vertices_changed = True
            self._follow(mine.entry, changed)
        return True

    def _follow(self, shape: Any, changed: list[str]) -> None:
        """Move a lamp's shape in the search trees: in its own if it is a mesh of the same triangles."""
        if not shape.is_mesh() or "faces" in changed:
            self._moved = True
        elif "vertex_positions" in changed:
            positions = np.array(self._mi.traverse(shape)["vertex_positions"]).reshape(-1, 3)
            self._in_trees.append(lambda trees: trees.follow(shape, positions))

    def suns(self) -> bool:
        """Put the disks of suns farther away that the scene has outgrown; False if that cannot be done in place."""
        made = {each: self._parts.lights[each.name] for each in self._new.lights if isinstance(each, SunLight)}
        disks = {sun: of[0] for sun, of in made.items() if of and of[0].entry is not of[0].emitter}
        sphere = bounding_sphere(self._new) if disks else (np.zeros(3), 0.0)
        return all(light.is_far(self._mi, sun, disk, sphere) or self.light(sun, sun) for sun, disk in disks.items())

    def world(self, old: World, new: World) -> bool:
        """Change the numbers of the environment."""
        if old.is_black or new.is_black or not equal(_without_color(old), _without_color(new)):
            return False
        if old.camera_view is not None or new.camera_view is not None:
            return False
        kept = self._made()
        done = transplant(self._parts.world, light.world_emitter(self._parts.context, new), self._mi)
        self._drop(kept)
        return done

    def place(self, old: Instance, new: Instance) -> bool:
        """Move an object."""
        if not equal(replace(old, world_from_object=new.world_from_object), new):
            return False
        shapes, matrix = self._parts.placed[old.name], new.world_from_object
        if np.linalg.cond(matrix[:3, :3]) > 1 / LEAST_VOLUME or len(shapes) != 1:
            return False
        if shapes[0].class_name() != "Instance":
            return False  # an emissive object is stored as separate triangles
        parameters = self._mi.traverse(shapes[0])
        if "to_world" not in parameters:
            return False
        parameters["to_world"] = type(parameters["to_world"])(self._mi.ScalarTransform4f(matrix))
        parameters.update()
        self._parts.context.tables.place(shapes[0], new, is_instance=True)
        self._in_trees.append(lambda trees: trees.place(shapes[0], matrix))
        self._rows_changed = True
        return True

    def mesh(self, old: Mesh, new: Mesh) -> bool:
        """Change vertices of a mesh, and the corners of its triangles if there are as many."""
        if old.triangles.shape != new.triangles.shape or not equal(old.material_indices, new.material_indices):
            return False
        faces = not equal(old.triangles, new.triangles)
        if [a.name for a in old.attributes] != [a.name for a in new.attributes]:
            return False
        if any(
            i.mesh == new.name and self._parts.placed[i.name] and not self._is_placed(i) for i in self._new.instances
        ):
            return False
        if old.is_strands != new.is_strands:
            return False
        before, after = geometry.split_by_material(old), geometry.split_by_material(new)
        if before.keys() != after.keys():  # triangles of a material have lost all their area, or gained one
            return False
        shapes = self._parts.shapes.meshes.get(new.name, [])
        for index, shape, group in shapes:
            if not geometry.fill(self._mi, shape, before[index], after[index], faces=faces):
                return False
            group.parameters_changed()
            self._parts.context.meshes.add(shape)
            self._vertices_changed, self._faces_changed = True, self._faces_changed or faces
        copies: dict[tuple[str, ...], list[Any]] = {}
        for instance in self._new.instances:
            if instance.mesh == new.name:
                copies.setdefault(instance.materials, []).extend(self._parts.placed[instance.name])
        for materials, placed in copies.items():
            of_group = self._parts.shapes.geometry.groups.get((new.name, materials))
            if placed and of_group is not None:
                parts = [after[index] for index, _, _ in of_group[1]]
                self._in_trees.append(partial(_reshape, placed, parts))
        return True

    def warm(self) -> None:
        """Write every editable mesh and the ball of every lamp once with its present values.

        Buffers that were written after the scene was created have another type for a recorded launch: without this
        first write, the first edit of each mesh would cause a new recording.
        """
        bodies = [each.entry for made in self._parts.lights.values() for each in made if each.entry is not each.emitter]
        for body in bodies:
            if not body.is_mesh():
                self._parts.context.read_numbers(body, ["to_world"])
                self._moved = True
        for mesh in self._new.meshes:
            placed = [instance for instance in self._new.instances if instance.mesh == mesh.name]
            if all(self._is_placed(instance) for instance in placed):
                parts = geometry.split_by_material(mesh)
                for index, shape, group in self._parts.shapes.meshes.get(mesh.name, []):
                    geometry.fill(self._mi, shape, parts[index], parts[index], faces=True)
                    group.parameters_changed()
                    self._moved = True
        self.finish()

    def _is_placed(self, instance: Instance) -> bool:
        return all(shape.class_name() == "Instance" for shape in self._parts.placed[instance.name])


def _reshape(placed: list[Any], parts: list[geometry.Part], trees: Trees) -> None:
    trees.reshape(placed, parts)


def _of(item: Any, name: str) -> Any:
    return getattr(item, name, None)


def _without_color(world: World) -> World:
    return replace(world, color=World().color, strength=1.0)


def _same(first: Any, second: Any) -> bool:
    return np.shape(first) == np.shape(second) and np.array_equal(np.array(first), np.array(second))
