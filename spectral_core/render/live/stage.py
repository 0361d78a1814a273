# SPDX-License-Identifier: GPL-3.0-or-later
"""A loaded scene: changes of numbers, positions and shapes are made in place, all others load it anew."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from spectral_core.errors import SpectralError
from spectral_core.render.job import Measure, RenderJob
from spectral_core.render.live.gathered import Gathered
from spectral_core.render.live.in_place import edits
from spectral_core.render.live.in_place.changes import difference
from spectral_core.render.live.in_place.opened import Opened
from spectral_core.render.live.media import look_from
from spectral_core.render.live.messages import LOADED
from spectral_core.render.live.passes import Launcher
from spectral_core.render.live.trees import Trees
from spectral_core.render.live.view import Viewpoint
from spectral_core.render.mitsuba_scene.assemble import scene_radius
from spectral_core.render.mitsuba_scene.traced_spectra import color_spectra, light_spectra, reflectance_spectra
from spectral_core.render.mitsuba_scene.units import SMALLEST_RADIUS, at_origin, typical_size
from spectral_core.render.plan.decision import EffectPlan
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.render.plan.inventory import dyed
from spectral_core.render.plan.simulated import simulated_scene
from spectral_core.render.same import equal
from spectral_core.render.trace.wavelengths import noise_of, plan_wavelengths
from spectral_core.render.variant import activate, choose_backend
from spectral_core.scene import Note, Scene

MOST_NOISE = 4.0
"""Variance of the light of an edited lamp, over the least, up to which the wavelengths stay the same."""
MOST_WARMED = 300_000
"""Most triangles of a scene whose meshes are prepared for edits while it is loaded; this doubles part of the loading
time.
"""


class Stage:
    """One scene as Mitsuba objects. ``show`` updates it; ``launcher`` traces it.

    ``loads``: number of complete loads. ``number``: increases with every change, so that pictures of an older scene can
    be recognized.
    """

    def __init__(self) -> None:
        self.scene: Scene | None = None
        self.loads = 0
        self.number = 0
        self.how = ""
        """Effect of the last change: ``LOADED``, or a list of the parts that were edited in place."""
        self._gathered = Gathered()
        self._opened = Opened()
        self._simulated: Scene | None = None
        self._plan: EffectPlan | None = None
        self._job: RenderJob | None = None
        self._launcher: Launcher | None = None
        self._trees: Trees | None = None
        self._spare: list[Any] = []
        self._seen_from: Viewpoint | None = None
        self._width = 0
        self._shift = np.zeros(3)
        self._sizes: list[tuple[Scene, float]] = []

    @property
    def launcher(self) -> Launcher:
        """Tracer of the scene."""
        assert self._launcher is not None, "nothing was loaded yet"
        return self._launcher

    @property
    def plan(self) -> EffectPlan:
        """The plan of the scene."""
        assert self._plan is not None, "nothing was loaded yet"
        return self._plan

    @property
    def notes(self) -> tuple[Note, ...]:
        """Notes on features that are approximated."""
        return () if self.scene is None or self._job is None else self.scene.notes + self._job.notes

    def show(self, scene: Scene) -> None:
        """Update the stage to ``scene``.

        Raises InvalidInputError or RenderError if it cannot be rendered; the next scene is then loaded completely.
        """
        try:
            self._show(scene)
        except SpectralError:
            self.forget()
            raise

    def forget(self) -> None:
        """Free the loaded scene."""
        self.scene = self._simulated = self._plan = self._job = self._launcher = self._seen_from = self._trees = None
        self._spare = []
        # Mitsuba's objects and our plugins refer to each other in cycles. Freeing them releases their numbers in
        # Mitsuba's registry to the next scene; its kernels are then equal and need not be compiled again.
        gc.collect()

    def _show(self, scene: Scene) -> None:
        scene, shift = at_origin(scene, self._shift)
        if not np.array_equal(shift, self._shift):
            self._shift, self._seen_from = shift, None
        scene = self._gathered.of(scene)
        held = self._opened.of(scene)
        if self._job is not None and self._stays(held):
            return
        if not self._opened.has_grown:
            held = self._opened.renewed(scene)
        self._load(held, *_planned(held))

    def _stays(self, scene: Scene) -> bool:
        """Make the change to ``scene`` in place; False if that is not possible."""
        simulated, plan = _planned(scene)
        done = self._change(simulated) if self._can_stay(scene, simulated, plan) else None
        if done is None:
            return False
        self.scene, self._simulated, self._plan, self.how = scene, simulated, plan, done
        self.number += 1 if done else 0
        return True

    def activate(self) -> None:
        """Activate the variant of the stage, because stages may alternate."""
        assert self.scene is not None
        activate(choose_backend("spectral" if self.plan.is_spectral else "rgb", self.scene.settings.variant))

    def look_from(self, viewpoint: Viewpoint, width: int = 1920) -> None:
        """Set the camera that shading programs read for the next view, ``width`` pixels wide."""
        if viewpoint.same_as(self._seen_from) and width == self._width:
            return
        self._seen_from, self._width = viewpoint, width
        assert self._job is not None
        seen, context = self.in_units(viewpoint), self._job.loaded.scene.parts.context
        context.tables.look_from(seen.camera_from_world, seen.window, seen.window[0] / width)
        if look_from(self._job.loaded, seen.eye):
            self.launcher.refresh()

    def in_units(self, viewpoint: Viewpoint) -> Viewpoint:
        """The viewpoint in the loaded scene, which may be moved and scaled."""
        assert self._job is not None
        return viewpoint.moved(self._shift).scaled(self._job.unit)

    def _load(self, scene: Scene, simulated: Scene, plan: EffectPlan) -> None:
        self.forget()
        self._job = RenderJob(scene, plan, Measure(movable=True))
        self._spare = self._job.loaded.scene.parts.context.meshes.spare_shapes()
        if sum(len(mesh.triangles) for mesh in simulated.meshes) <= MOST_WARMED:
            edits.Edit(self._job.loaded, simulated, simulated).warm()
        has_guides = not (scene.volumes or plan.is_on("media"))
        self._launcher = Launcher(self._job.loaded, scene.film, self.in_units, has_guides=has_guides)
        self._trees = Trees.of(self._job.loaded.scene.scene, self._spare[0])
        # now: the launch of another stage calls the emitters of this one, too, and must not make their arrays
        self._launcher.refresh()
        self.scene, self._simulated, self._plan = scene, simulated, plan
        self.loads += 1
        self.number += 1
        self.how = LOADED

    def _can_stay(self, scene: Scene, simulated: Scene, plan: EffectPlan) -> bool:
        """True if a change may be possible in place, judged without a look at the objects."""
        old, before = self._simulated, self._plan
        assert old is not None and before is not None and self.scene is not None
        if [d.value for d in plan.decisions] != [d.value for d in before.decisions]:
            return False
        if not equal(_sampling(scene), _sampling(self.scene)) or not equal(scene.settings, self.scene.settings):
            return False
        names = [item.name for item in simulated.instances]
        if len(set(names)) < len(names) or not equal(old.volumes, simulated.volumes):
            return False
        for kind in ("meshes", "materials", "instances", "lights"):
            if [item.name for item in getattr(old, kind)] != [item.name for item in getattr(simulated, kind)]:
                return False
        return min(map(self._size, (self.scene, scene))) >= SMALLEST_RADIUS  # smaller scenes are rescaled

    def _size(self, scene: Scene) -> float:
        """Size by which a scene may be rescaled; those of the last two scenes are kept."""
        for known, size in self._sizes:
            if known is scene:
                return size
        size = min(scene_radius(scene), typical_size(scene))
        self._sizes = [*self._sizes[-1:], (scene, size)]
        return size

    def _draw_again(self, old: Scene, new: Scene) -> bool:
        """Draw other wavelengths if the present ones miss most light of the lamps, surfaces and media with other
        spectra; False if the scene must be loaded for that.
        """
        plan = self.launcher.plan
        if plan is None:
            return True
        others = light_spectra(new, since=old)
        noise = max((noise_of(each, plan) for each in others), default=0.0)
        if noise <= MOST_NOISE:
            return True
        if any(map(dyed, new.materials)):  # the light that excites dyes is in their tables
            return False
        better = plan_wavelengths(
            light_spectra(new),
            reflectances=reflectance_spectra(new),
            colors=color_spectra(new),
            disperses=plan.teeth == 1,
        )
        if noise > MOST_NOISE * max(noise_of(each, better) for each in others) / 2:
            self.launcher.draw_by(better)
        return True

    def _change(self, new: Scene) -> str | None:
        """Make the difference in place. "" if there is none, None if it cannot be made."""
        assert self._simulated is not None and self._job is not None
        old, loaded = self._simulated, self._job.loaded
        change = difference(replace(old, notes=new.notes), new)
        done: list[str] = []
        edit = edits.Edit(loaded, old, new, self._trees)
        steps: list[tuple[str, str, Callable[[Any, Any], bool]]] = [
            ("meshes", "meshes", edit.mesh),
            ("materials", "materials", edit.material),
            ("lights", "lights", edit.light),
            ("instances", "places", edit.place),
        ]
        for kind, word, make in steps:
            for before, after in zip(getattr(old, kind), getattr(new, kind), strict=True):
                if kind in change.items and before is not after and not equal(before, after):
                    if not make(before, after):
                        return None
                    done.append(word)
        if not {"meshes", "places"}.isdisjoint(done) and not edit.suns():
            return None
        if "world" in change.singles:
            if not edit.world(old.world, new.world):
                return None
            done.append("world")
        if not self._draw_again(old, new):
            return None
        edit.finish()
        if done:
            self.launcher.refresh()
        return ", ".join(dict.fromkeys(done))


def _planned(scene: Scene) -> tuple[Scene, EffectPlan]:
    """What is simulated of a scene, and the plan, which omits no effect for its size and has bounces for lights of any
    strength: edits change these.
    """
    plan = plan_from_data(scene, 0.0, lights_vary=True)
    return simulated_scene(scene, plan), plan


def _sampling(scene: Scene) -> Any:
    """The settings of the film that a loaded scene depends on."""
    film = scene.film
    clear = film.transparent, film.transparent_glass
    return clear, film.filter_width, film.filter_kind, film.seed, np.array(film.pixel_aspect)
