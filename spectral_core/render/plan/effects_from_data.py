# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects that a scene's data decide: the scene's features for each, and a bound on the error without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lens.aperture import width_of_lens
from spectral_core.render.plan import bounds
from spectral_core.render.plan.decision import MOST_BOUNCES, MOST_ERROR, USUAL_BOUNCES, How
from spectral_core.render.plan.errors.fluorescence import error_without_dyes
from spectral_core.render.plan.errors.spectral import distinct_lights, rgb_transport_error
from spectral_core.render.plan.errors.thin_film import error_without_films
from spectral_core.render.plan.errors.volumes import error_of_media, error_of_volumes
from spectral_core.render.plan.inventory import Inventory, is_sharp, names, shown_materials
from spectral_core.render.plan.levels import KEEP, Effect, Level
from spectral_core.render.plan.light.reflections import USUAL_DIRECT, diffuse_levels, direct_radiance
from spectral_core.render.plan.light.sizes import largest_light
from spectral_core.scene import Material, PointLight, RayPortal, Scene, SpotLight, leaves
from spectral_core.scene.geometry import placed_boxes

SPECTRAL_SHARE = 0.3
"""Share of the time that spectra take beyond three channels, at equal noise (``plan-effects`` prints it)."""
DISPERSION_SHARE = 0.5
FLUORESCENCE_SHARE = 0.1
FILM_SHARE = 0.1
MEDIA_SHARE = 0.5
TRANSPARENCY_SHARE = 0.12
SMALL_SHARE = 0.02
"""Share of the time of an effect that costs very little."""
ON_OFF = ("on", "off")
THIN = 0.05
"""ΔE2000 of media through which light goes nearly straight."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A scene, its inventory, and points (n, 3) that span the region that its camera sees."""

    scene: Scene
    inventory: Inventory
    points: NDArray[np.float64]
    lights_vary: bool = False  # True if the plan serves lights of any place and strength
    is_exact: bool = False  # True if, besides, no error is tolerated, as in 3D views

    @property
    def materials(self) -> list[Material]:
        """Materials that some ray may hit."""
        shown = shown_materials(self.scene)
        return [material for material in self.scene.materials if material.name in shown]

    @property
    def scatters(self) -> bool:
        """True if light is scattered or emitted in a medium; media whose error is ``THIN`` at most do not count."""
        if "World" in self.inventory.scattering:
            return True
        media = [material for material in self.materials if material.name in self.inventory.scattering]
        return error_of_media(self.scene, self.materials, media, lights_vary=self.lights_vary, most=THIN) > THIN


def absent(
    name: str, reason: str, share: float = 0.0, value: str = "off", choices: tuple[str, ...] = ("off",)
) -> Effect:
    """An effect without any feature in the scene; ``share``: its share of the time in the plan with all effects."""
    return Effect(name, (Level("on"), Level(value, 0.0, share)), reason, choices=choices)


def _transport(found: Found) -> Effect:
    inventory, choices = found.inventory, ("rgb", "spectral")

    def levels(error: float) -> tuple[Level, Level]:
        return Level("spectral"), Level("rgb", error, SPECTRAL_SHARE)

    if inventory.dispersive and _disperses_anyway(found):
        reason = f"colors part in the dispersive {names(inventory.dispersive)}"
        return Effect("transport", levels(KEEP), reason, "no rainbows", "bounded", choices)
    if not inventory.spectra:
        reason = "no light or material has a spectrum; three channels are exact"
        return Effect("transport", levels(0.0), reason, choices=choices)
    loses = "colors that only spectra can distinguish become equal"
    if found.is_exact:  # the error, which does not matter here, takes most of the time of an edit's plan
        return Effect("transport", levels(KEEP), "there are spectra", loses, "not known", choices)
    # three channels show no dispersion, whose own error is never larger: it leaves first
    error = rgb_transport_error(found.scene)
    error = KEEP if error == KEEP else min(error + _error_without_dispersion(found), MOST_ERROR)
    text = "an unknown error" if error == KEEP else f"an error of ΔE {error:.2g}"
    reason = f"there are spectra in {names(inventory.spectra)}; surfaces under all lights have {text} in three channels"
    return Effect("transport", levels(error), reason, loses, "bounded", choices)


def _disperses_anyway(found: Found) -> bool:
    """True if dispersion stays at any tolerance, or by the artist's choice."""
    chosen = dict(found.scene.settings.overrides).get("dispersion")
    return chosen == "on" or _error_without_dispersion(found) >= MOST_ERROR


def _error_without_dispersion(found: Found) -> float:
    """A fringe of c pixels at an edge from black to white: the filter's largest slope, 1.1 per pixel."""
    if not found.inventory.dispersive:
        return 0.0
    if found.is_exact:  # a view is seen from anywhere, not by the camera of the scene
        return MOST_ERROR
    return min(MOST_ERROR, 110.0 * bounds.spread_of_dispersion(found.scene, found.materials, found.points))


def _dispersion(found: Found) -> Effect:
    inventory = found.inventory
    if not inventory.dispersive:
        return absent("dispersion", "every index of refraction is one number", DISPERSION_SHARE)
    reason, error = f"the index of refraction varies with wavelength in {names(inventory.dispersive)}", KEEP
    if not found.is_exact:
        spread = bounds.spread_of_dispersion(found.scene, found.materials, found.points)
        reason, error = f"{reason}: {spread:.2g} pixels", _error_without_dispersion(found)
    loses = "no dispersion; everything refracts as at 589 nm"
    return Effect("dispersion", (Level("on"), Level("off", error, DISPERSION_SHARE)), reason, loses, "bounded", ON_OFF)


def _fluorescence(found: Found) -> Effect:
    inventory = found.inventory
    if not inventory.fluorescent:
        return absent("fluorescence", "no material holds a fluorescent dye", FLUORESCENCE_SHARE)
    error = error_without_dyes(found.scene, found.materials, distinct_lights(found.scene))
    reason = f"dyes of {names(inventory.fluorescent)} emit light at other wavelengths than they absorb"
    levels = (Level("on"), Level("off", error, FLUORESCENCE_SHARE))
    return Effect("fluorescence", levels, reason, "fluorescent materials emit no light", "bounded", ON_OFF)


def _thin_film(found: Found) -> Effect:
    films = found.inventory.films
    if not films:
        return absent("thin_film", "no surface has a thin film", FILM_SHARE)
    error = error_without_films(found.materials)
    reason = f"light interferes in the thin film of {names(films)}"
    levels = (Level("on"), Level("off", error, FILM_SHARE))
    return Effect("thin_film", levels, reason, "no colors of thin films", "bounded", ON_OFF)


def _media(found: Found) -> Effect:
    if not found.inventory.media:
        return absent("media", "no material has a volume", MEDIA_SHARE)
    carriers = [material for material in found.materials if material.medium is not None]
    depths = [bounds.optical_depth(found.scene, material) for material in carriers]
    error = error_of_media(found.scene, found.materials, carriers, lights_vary=found.lights_vary)
    if found.scene.world.medium is not None:  # the world's medium is unbounded
        depths.append(float("inf"))
        error = 100.0
    depth = max(depths)
    happens = "light scatters inside" if found.inventory.scattering else "light is absorbed inside"
    reason = f"{happens} {names(found.inventory.media)}, whose optical depth is at most {depth:.2g}"
    levels = (Level("on"), Level("off", min(error, 100.0), MEDIA_SHARE))
    return Effect("media", levels, reason, "fog, smoke and milk vanish", "bounded", ON_OFF)


def _volumes(found: Found) -> Effect:
    volumes = found.scene.volumes
    if not volumes:
        return absent("volumes", "the scene has no sampled volume", MEDIA_SHARE)
    reason = f"the scene shows {names(tuple(volume.name for volume in volumes))}"
    media, vary = bool(found.inventory.media), found.lights_vary
    error = error_of_volumes(found.scene, found.materials, among_media=media, lights_vary=vary)
    levels = (Level("on"), Level("off", min(error, MOST_ERROR) if error < KEEP else KEEP, MEDIA_SHARE))
    how: How = "not known" if error == KEEP else "bounded"
    return Effect("volumes", levels, reason, "the sampled volumes vanish", how, ON_OFF)


def _transparency(found: Found) -> Effect:
    inventory = found.inventory
    levels = (Level("on"), Level("off", KEEP, TRANSPARENCY_SHARE))
    if inventory.transparent:
        reason = f"light passes straight through {names(inventory.transparent)}"
        loses = "shadows of transparent surfaces are black"
        return Effect("transparency", levels, reason, loses, "not known", ON_OFF)
    if found.scene.volumes and inventory.bodies_shade:  # elsewhere lamps are no objects of the scene
        reason = f"lights with a size ({names(inventory.light_bodies)}) must not shade the other lights"
        loses = "lights shade each other as if they were objects"
        return Effect("transparency", levels, reason, loses, "not known", ON_OFF)
    reason = "nothing is transparent, so shadow rays stop at the first hit"
    return absent("transparency", reason, TRANSPARENCY_SHARE, choices=ON_OFF)


def _environment(found: Found) -> Effect:
    parts = found.scene.world.parts
    if not parts:
        return absent("environment", "the world is black", value="none", choices=("none",))
    is_image = any(world.is_image for world in parts)
    kind = "image" if is_image else "constant"
    reason = "an image surrounds the scene" if is_image else "the world has one color everywhere"
    radiance = max(abs(world.strength) * largest_light(world.color) for world in parts) * found.scene.film.exposure
    error = KEEP if found.lights_vary else bounds.error_of_light(radiance)  # a recording may make it brighter
    levels = (Level(kind), Level("none", error, SMALL_SHARE))
    return Effect("environment", levels, reason, "the world's light is missing", "bounded", (kind, "none"))


def _emissive_meshes(found: Found) -> Effect:
    if not found.inventory.emissive:
        return absent("emissive_meshes", "no surface emits light")
    levels = (Level("on"), Level("off", KEEP, SMALL_SHARE))
    reason = f"emissive surfaces: {names(found.inventory.emissive)}"
    return Effect("emissive_meshes", levels, reason, "these surfaces are dark and emit nothing", "not known", ON_OFF)


def _lamp_bodies(found: Found) -> Effect:
    balls = [light for light in found.scene.lights if isinstance(light, (PointLight, SpotLight)) and light.radius > 0]
    if not balls:
        return absent("lamp_bodies", "no point or spot lamp has a size")
    shown = tuple(light.name for light in balls)
    levels = (Level("on"), Level("off", KEEP, TRANSPARENCY_SHARE))
    loses = "shadows are hard, and mirrors do not show the lamps"
    seen = found.inventory.glossy or found.inventory.refractive or any(light.camera_visible for light in balls)
    if seen or found.inventory.media or found.scene.volumes or found.is_exact:  # a view is seen from anywhere
        reason = f"the size of {names(shown)} has a visible effect"
        return Effect("lamp_bodies", levels, reason, loses, "not known", ON_OFF)
    boxes = placed_boxes(found.scene.meshes, found.scene.instances)
    blur = bounds.blur_of_lamps(found.scene, balls, found.points, boxes)
    levels = (Level("on"), Level("off", bounds.error_of_blur(blur) if np.isfinite(blur) else 100.0, TRANSPARENCY_SHARE))
    reason = f"half-shadows of {names(shown)} are at most {min(blur, 9999):.2g} pixels wide"
    return Effect("lamp_bodies", levels, reason, loses, "bounded", ON_OFF)


def _textures(found: Found) -> Effect:
    images = found.inventory.images
    if not images:
        return Effect("textures", (Level("off"),), "no material uses an image", overridable=False)
    reason = f"images color {names(images)}"
    return Effect("textures", (Level("on"),), reason, how="not known", overridable=False)


def _depth_of_field(found: Found) -> Effect:
    scene = found.scene
    if scene.camera.aperture_radius <= 0:
        return absent("depth_of_field", "the camera's aperture is closed", SMALL_SHARE)
    further = any(is_sharp(leaf) or isinstance(leaf, RayPortal) for each in found.materials
                  for leaf in leaves(each.surface))  # fmt: skip
    blur = bounds.blur_of_lens(scene, found.points, further=further)
    width = width_of_lens(scene.camera)
    reason = f"the lens is open {width:.3g} units wide; nothing blurs by more than {blur:.2g} pixels"
    levels = (Level("on"), Level("off", bounds.error_of_blur(blur), SMALL_SHARE))
    return Effect("depth_of_field", levels, reason, "everything is in focus", "bounded", ON_OFF)


def _caustics(found: Found) -> tuple[Effect, ...]:
    inventory = found.inventory
    made = []
    kinds = ("reflective", inventory.glossy, "mirrors"), ("refractive", inventory.refractive, "glass")
    for kind, carriers, what in kinds:
        name = f"{kind}_caustics"
        if not carriers:
            made.append(absent(name, f"the scene has no {what}", choices=ON_OFF))
            continue
        levels = (Level("on"), Level("off", KEEP, 0.1))
        reason = f"{names(carriers)} may cast light on diffuse surfaces"
        made.append(Effect(name, levels, reason, f"no light patterns from {what}", "not known", ON_OFF))
    return tuple(made)


def _bounces(found: Found) -> Effect:
    inventory = found.inventory
    if not inventory.surfaces:
        return Effect("bounces", (Level("0"),), "there is no surface to bounce from")
    # what is not known stays, as far as the scene's own limit
    full = (Level(str(min(max(found.scene.settings.scene_bounces or 0, USUAL_BOUNCES), MOST_BOUNCES))),)
    if found.scatters:
        return Effect("bounces", full, "light scatters many times inside a medium", "dark media", "not known")
    if inventory.strands:
        reason = f"light passes many strands of {names(inventory.strands)}"
        return Effect("bounces", full, reason, "dark hair", "not known")
    if inventory.refractive:
        reason = f"light enters and leaves {names(inventory.refractive)}, some of it after inner reflections"
        return Effect("bounces", full, reason, "black spots in glass", "not known")
    if inventory.glossy:
        reason = f"other surfaces are reflected in {names(inventory.glossy)}"
        return Effect("bounces", full, reason, "dark reflections of reflections", "not known")
    largest = inventory.largest_reflectance
    direct = USUAL_DIRECT if found.lights_vary else direct_radiance(found.scene, found.materials, largest)
    levels = diffuse_levels(direct, largest)
    reason = f"surfaces are diffuse and reflect at most {100 * largest:.0f} %"
    return Effect("bounces", levels, reason, "dark corners", "bounded")


_RULES: tuple[Callable[[Found], Effect], ...] = (
    _transport, _dispersion, _fluorescence, _thin_film, _media, _volumes, _transparency, _environment, _emissive_meshes,
    _lamp_bodies, _textures, _depth_of_field,
)  # fmt: skip


def effects_of(found: Found) -> dict[str, Effect]:
    """Every effect, in the order of display."""
    effects = [rule(found) for rule in _RULES]
    effects += _caustics(found)
    effects.append(_bounces(found))
    return {effect.name: effect for effect in effects}
