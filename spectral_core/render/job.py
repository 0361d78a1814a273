# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene during rendering: loaded once, traced in passes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import RenderError, SpectralError, counted
from spectral_core.render.denoise import Guides
from spectral_core.render.lights.mitsuba_lights import MitsubaLights
from spectral_core.render.mitsuba_scene import LoadedScene, load_scene
from spectral_core.render.mitsuba_scene.assemble import scene_radius, size_note
from spectral_core.render.mitsuba_scene.fluorescent import emission_spectra, reradiation
from spectral_core.render.mitsuba_scene.paint import white_light
from spectral_core.render.mitsuba_scene.rules import RayRules, Tables
from spectral_core.render.mitsuba_scene.traced_spectra import color_spectra, light_spectra, reflectance_spectra
from spectral_core.render.mitsuba_scene.units import in_working_units, typical_size
from spectral_core.render.passes.light_path import Groups, light_pass_class
from spectral_core.render.plan.decision import EffectPlan
from spectral_core.render.plan.inventory import take_inventory
from spectral_core.render.trace.accumulate import Accumulator
from spectral_core.render.trace.chosen_pixels import ChosenPixels
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.render.trace.guides import GuidePass
from spectral_core.render.trace.media.sampled import SampledVolumes
from spectral_core.render.trace.path.integrator import scene_path
from spectral_core.render.trace.path.settings import PathSettings
from spectral_core.render.trace.wavelengths import Bands, WavelengthPlan, plan_wavelengths
from spectral_core.render.variant import activate, choose_backend
from spectral_core.render.volumes import missed_qualities, sampled_volumes
from spectral_core.render.volumes_as_media import with_volumes
from spectral_core.scene import Note, Scene
from spectral_core.spectra.spectrum import Spectrum

DYES_IN_BANDS = (
    "dyes emit light at other wavelengths than they absorb, so the stored bands hold for lamps of the spectra that "
    "they are recorded with; record Mixtures for any other"
)
ONE_INDEX = "RGB transport refracts all light as at 589 nm, without its dispersion; choose spectral transport"


@dataclass(frozen=True, slots=True, eq=False)
class Measure:
    """Quantities to measure beside the picture.

    ``bands``: spectral channels (makes the transport spectral). ``groups``: one render per light group, all with the
    paths of the whole scene, so that they add up to it; a tuple of names renders those alone. ``sampling_lights``:
    lights whose wavelengths are drawn most often; None for the scene's own. Renders with equal seeds and equal
    ``sampling_lights`` trace the same paths, however bright their lights are; renders of groups
    do so, too. ``movable``: objects can be moved in the loaded scene, and its lamps are Mitsuba's emitters.
    """

    bands: Bands | None = None
    groups: bool | tuple[str, ...] = False
    sampling_lights: Sequence[Spectrum] | None = None
    movable: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Loaded:
    """Parts of a job for a live view: the active ``mitsuba``, its ``scene`` with access to its objects, the tracers
    (``first_hit``, ``integrator``), and the ``wavelengths`` to draw, None in RGB transport.
    """

    mitsuba: Any
    scene: LoadedScene
    first_hit: FirstHit
    integrator: Any
    wavelengths: WavelengthPlan | None


@dataclass(frozen=True, slots=True, eq=False)
class TracedScene:
    """A loaded scene for a tracer of its own; ``unit``: the renderer's working units per unit of the scene."""

    mitsuba: Any
    scene: Any
    rules: RayRules
    lights: Any
    first_hit: FirstHit
    unit: float


class RenderJob:
    """One scene under one plan. Raises RenderError if Mitsuba cannot load it."""

    def __init__(self, scene: Scene, plan: EffectPlan, measure: Measure = Measure()) -> None:
        radius = scene_radius(scene)
        size = min(radius, typical_size(scene))
        simulated, self.plan, joining = with_volumes(scene, plan)
        plan = self.plan
        self.scene = in_working_units(simulated, size)
        self._unit = 1.0 if self.scene is simulated else 1.0 / size
        backend = choose_backend("spectral" if plan.is_spectral else "rgb", scene.settings.variant)
        self.variant = backend.variant
        self._mitsuba = activate(backend)
        wavelengths = None
        lights = list(measure.sampling_lights or light_spectra(self.scene)) if plan.is_spectral else []
        if plan.is_spectral:
            wavelengths = plan_wavelengths(
                [*lights, *emission_spectra(self.scene, lights)],
                measure.bands,
                reflectances=reflectance_spectra(self.scene),
                colors=color_spectra(self.scene),
                disperses=plan.is_on("dispersion"),
                follow_bands=measure.sampling_lights is None,
            )
        self._wavelengths = wavelengths
        self._loaded_notes: tuple[Note, ...] = size_note(radius) + joining
        if measure.bands is not None and measure.groups and plan.is_on("fluorescence"):
            self._loaded_notes += (Note("Fluorescence", DYES_IN_BANDS),)
        if not plan.is_spectral:
            self._loaded_notes += tuple(Note(name, ONE_INDEX) for name in take_inventory(self.scene).dispersive)
        try:
            own_paths = not self.scene.volumes
            self._loaded = load_scene(
                self.scene,
                self._mitsuba,
                spectral=plan.is_spectral,
                groups=bool(measure.groups),
                movable=measure.movable,
                own_lights=own_paths and not measure.movable,
                even=bool(measure.groups) or measure.sampling_lights is not None,
            )
            teeth = 4 if wavelengths is None else wavelengths.teeth
            self._loaded.rules.reradiation = reradiation(self._loaded.parts.context, lights, teeth)
            self._integrators = self._load_integrators(groups=bool(measure.groups))
            if self.scene.volumes:
                self._loaded_notes += missed_qualities(next(iter(self._integrators.values())).sampled.fields)
            self._first_hit = FirstHit(
                self._mitsuba,
                self._loaded.scene,
                self.scene.film.transparent,
                self._loaded.background,
                Tables(self._mitsuba, self._loaded.rules),
                any(light.camera_visible for light in self.scene.lights),
                self._loaded,
                getattr(next(iter(self._integrators.values())), "layers", None),
            )
            names = list(self._loaded.switches) if measure.groups else [""]
            if isinstance(measure.groups, tuple):
                names = [name for name in names if name in measure.groups]
            self._sums = {
                name: Accumulator(self._mitsuba, self.scene.camera, self.scene.film, wavelengths)
                for name in names or [""]
            }
        except SpectralError:
            raise
        except Exception as error:
            raise RenderError(f"Mitsuba cannot load the scene: {error}") from error
        texts = backend.notes
        self._notes = tuple(Note("Renderer", text) for text in texts) + self._loaded.notes + self._loaded_notes
        self._notes += plan.notes

    @property
    def loaded(self) -> Loaded:
        """The scene as it was loaded, with all its lights."""
        integrator = next(iter(self._integrators.values()))
        return Loaded(self._mitsuba, self._loaded, self._first_hit, integrator, self._wavelengths)

    def _load_integrators(self, *, groups: bool) -> dict[str, Any]:
        """One integrator by light group. All groups share one, except where volumes emit light: the first group has
        that light, the first by name, because the order of the lamps may change between two recordings.
        """
        names = (sorted(self._loaded.switches) if groups else []) or [""]
        if not self.scene.volumes:
            return dict.fromkeys(names, self._integrator())
        lit_by, spectral = self._loaded.scene, self.plan.is_spectral
        whole = sampled_volumes(self.scene, lit_by, spectral=spectral)
        first, *others = names
        made = {first: self._integrator(whole)}
        if others:
            lit = sampled_volumes(self.scene, lit_by, spectral=spectral, own_light=False, like=whole)
            made |= dict.fromkeys(others, self._integrator(lit))
        return made

    def _integrator(self, sampled: SampledVolumes | None = None) -> Any:
        """The integrator for light between surfaces, in media and in sampled volumes."""
        plan, limits = self.plan, self.scene.settings.light_paths
        white = float(white_light().values.mean()) if plan.is_spectral else 1.0
        found = take_inventory(self.scene)
        clear = plan.is_on("transparency") and bool(found.transparent)
        # without light tables lamps are objects, which shadow rays pass
        clear |= not self._loaded.lights and found.bodies_shade
        film = self.scene.film
        glass = film.transparent and film.transparent_glass
        settings = PathSettings(plan.bounces, clear, limits, white, glass)
        wanted = self.scene.settings.passes
        if wanted is not None and (wanted.light or wanted.light_groups) and not self.scene.volumes:
            lights, media = self._loaded.parts.context.lights, self._loaded.rules.media
            groups = Groups.of(wanted.light_groups, self.scene, lights, media)
            tables = Tables(self._mitsuba, self._loaded.rules)
            return light_pass_class(self.variant)(settings, tables, self._lights(), groups)
        return scene_path(self._mitsuba, settings, self._loaded.rules, self._lights(), sampled)

    @property
    def tells_light_apart(self) -> bool:
        """True if shares of the light are accumulated while the picture is traced."""
        return all(hasattr(integrator, "book_into") for integrator in self._integrators.values())

    @property
    def light_sums(self) -> Accumulator:
        """Sums from which the shares of the light are read."""
        return next(iter(self._sums.values()))

    @property
    def mitsuba(self) -> Any:
        """The module with the job's variant."""
        return self._mitsuba

    @property
    def unit(self) -> float:
        """The renderer's units per unit of the scene."""
        return self._unit

    def _lights(self) -> Any:
        """The light tables, or Mitsuba's emitters."""
        return self._loaded.lights or self._loaded.chosen or MitsubaLights(self._mitsuba, self._loaded.scene)

    def chosen_pixels(self) -> ChosenPixels:
        """Tracer for chosen pixels, with all lights; their colors are those that a display shows."""
        integrator = next(iter(self._integrators.values()))
        view = (self.scene.camera, self.scene.displayed_film)
        return ChosenPixels(self._mitsuba, view, self._wavelengths, self._first_hit, integrator)

    def guides(self) -> Guides | None:
        """Albedo and normals for a denoiser; None if volumes or media are in front of the surfaces."""
        if self.scene.volumes or self.plan.is_on("media"):
            return None
        try:
            guide_pass = GuidePass(self._mitsuba, self.scene.camera, self.scene.film, spectral=self.plan.is_spectral)
            return guide_pass.trace(self._first_hit)
        except Exception as error:
            raise RenderError(f"Mitsuba stopped while tracing albedo and normals: {error}") from error

    def traced_scene(self) -> TracedScene:
        """The loaded scene, for the plan's pilot."""
        return TracedScene(
            self._mitsuba, self._loaded.scene, self._loaded.rules, self._lights(), self._first_hit, self._unit
        )

    @property
    def notes(self) -> tuple[Note, ...]:
        """Notes on features that are approximated, and on samples that were not finite."""
        lost = sum(sums.lost for sums in self._sums.values())
        if not lost:
            return self._notes
        found = counted(lost, "sample was no finite number and counts", "samples were not finite numbers and count")
        text = f"{found} as black; look for extreme lights or materials"
        return (*self._notes, Note("Renderer", text))

    @property
    def samples(self) -> int:
        """Samples per pixel so far."""
        return min(sums.samples for sums in self._sums.values())

    def trace(self, samples: int, should_stop: Callable[[], bool] | None = None) -> bool:
        """Add ``samples`` per pixel; False if ``should_stop`` returned True before all were traced."""
        try:
            for group, sums in self._sums.items():
                if self._loaded.switches:
                    self._loaded.light_only(group)
                for _ in sums.add(self._first_hit, self._integrators[group], samples):
                    if should_stop is not None and should_stop():
                        return False
        except Exception as error:
            raise RenderError(f"Mitsuba stopped while rendering: {error}") from error
        return True

    def picture(self) -> NDArray[np.float32]:
        """(height, width, 4) linear sRGB and coverage so far, row 0 at the bottom: the sum of all groups."""
        first, *others = self.group_pictures().values()
        total = first.copy()
        for other in others:
            total[..., :3] += other[..., :3]
        return total

    def band_picture(self) -> NDArray[np.float32]:
        """(height, width, n_bands) so far, the sum of all groups."""
        return np.asarray(sum(self.group_band_pictures().values()))

    def group_pictures(self) -> dict[str, NDArray[np.float32]]:
        """Picture so far of each light group; coverage is the same in all."""
        return {name: sums.picture() for name, sums in self._sums.items()}

    def group_band_pictures(self) -> dict[str, NDArray[np.float32]]:
        """Spectral channels so far of each light group."""
        return {name: sums.band_picture() for name, sums in self._sums.items()}
