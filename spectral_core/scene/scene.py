# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole scene, the notes of its translation, and its hash."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from spectral_core.checks import require_declared, require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.scene.camera import MOST_EXPOSURE, Camera, Film
from spectral_core.scene.geometry import Instance, Mesh, VolumeObject
from spectral_core.scene.lights import Light, World
from spectral_core.scene.motion import Moment, displaced, merged
from spectral_core.scene.paint import Paint, Scalar
from spectral_core.scene.passes import Passes
from spectral_core.scene.rays import UNLIMITED_PATHS, LightPaths
from spectral_core.scene.surface import Diffuse, ScatteringMedium, Surface
from spectral_core.spectra.spectrum import Spectrum


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """A named surface with an optional medium inside. No surface: only the medium is visible.

    ``index``: number for the pass Material Index. ``outputs``: values for AOVs, by name.
    ``shown_as``: its name in a cryptomatte, if it differs.
    """

    name: str
    surface: Surface | None = field(default_factory=Diffuse)
    medium: ScatteringMedium | None = None
    index: int = 0
    outputs: tuple[tuple[str, Paint | Scalar], ...] = ()
    shown_as: str = ""

    def __post_init__(self) -> None:
        """Raise InvalidInputError for a color, a spectrum or an image in place of a surface."""
        if self.surface is not None and not isinstance(self.surface, get_args(Surface)):
            raise InvalidInputError(
                f"the surface of material {self.name!r} is {str(self.surface)[:60]}, of type "
                f"{type(self.surface).__name__}; expected a closure, such as Diffuse(Color((0.8, 0.2, 0.2)))"
            )
        require_declared(self)


@dataclass(frozen=True, slots=True)
class Note:
    """A message for the user on the scene, once per subject: ``subject`` is a name that the user knows."""

    subject: str
    message: str


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """The artist's decisions; ``None`` leaves a decision to the plan.

    ``transport``: ``"rgb"`` or ``"spectral"``. ``max_bounces``: surface bounces after the first hit. ``overrides``: the
    artist's plan decisions by name. ``white``: spectrum by which emitted colors are multiplied, of any scale; None is
    D65. ``light_paths``: the scene's limits; ``scene_bounces``: its limit on all bounces, None without a limit.
    ``target_error`` (mean ΔE2000 of the picture's noise) or ``time_budget_s``: goal of sampling in place of a number of
    samples.
    ``denoise``: True to denoise the finished picture. ``passes``: passes beside the picture, None for none.
    ``display_exposure``: factor with which a display brightens the picture, as Blender's view does; color errors are
    those of the picture that is seen, whose pixels do not have this factor.
    """

    transport: Literal["rgb", "spectral"] | None = None
    max_bounces: int | None = None
    variant: str | None = None
    tolerance_delta_e: float = 0.25
    overrides: tuple[tuple[str, str], ...] = ()
    white: Spectrum | None = None
    light_paths: LightPaths = UNLIMITED_PATHS
    scene_bounces: int | None = None
    target_error: float | None = None
    time_budget_s: float | None = None
    denoise: bool = False
    passes: Passes | None = None
    display_exposure: float = field(default=1.0, metadata={"hashed": False})

    def __post_init__(self) -> None:
        require_declared(self)
        require_range("display_exposure", self.display_exposure, 1e-20, 1e20)
        require_range("tolerance_delta_e", self.tolerance_delta_e, 0.0, 1e9)
        if self.max_bounces is not None:
            require_whole("max_bounces", self.max_bounces, 0, 1 << 20)

    def in_spectra(self, *, white: Spectrum | None = None) -> RenderSettings:
        """These settings with spectral transport, whatever they state, and with another ``white`` if one is given."""
        rest = tuple((name, value) for name, value in self.overrides if name != "transport")
        return dataclasses.replace(
            self, transport="spectral", overrides=rest, white=self.white if white is None else white
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Scene:
    """All data that a picture depends on.

    Names are unique per type; instances refer to meshes and materials by name. ``moments``: equal shares of the time
    that the shutter is open; empty for an instantaneous shutter.
    """

    camera: Camera
    film: Film
    meshes: tuple[Mesh, ...] = ()
    materials: tuple[Material, ...] = ()
    instances: tuple[Instance, ...] = ()
    lights: tuple[Light, ...] = ()
    world: World = field(default_factory=World)
    volumes: tuple[VolumeObject, ...] = ()
    settings: RenderSettings = field(default_factory=RenderSettings)
    notes: tuple[Note, ...] = ()
    moments: tuple[Moment, ...] = ()

    @property
    def displayed_film(self) -> Film:
        """The film with the exposure of the picture that is seen, by which color errors are computed."""
        exposure = min(self.film.exposure * self.settings.display_exposure, MOST_EXPOSURE)
        return self.film if exposure == self.film.exposure else dataclasses.replace(self.film, exposure=exposure)

    @property
    def undisplayed(self) -> float:
        """Factor from the colors of ``displayed_film`` to those of the picture."""
        displayed = self.displayed_film.exposure
        return self.film.exposure / displayed if displayed > 0 else 1.0

    def at(self, moment: Moment) -> Scene:
        """The scene at one of its moments."""
        instances, meshes = merged(self.instances, moment.instances), merged(self.meshes, moment.meshes)
        volumes = displaced(self.volumes, moment.volumes)
        return dataclasses.replace(
            self, camera=moment.camera, instances=instances, meshes=meshes, volumes=volumes, moments=()
        )

    def __post_init__(self) -> None:
        require_kind("camera of the scene", self.camera, Camera)
        require_kind("film of the scene", self.film, Film)
        require_declared(self)
        for name, (kinds, expected) in _ITEMS.items():
            _require_items(name, getattr(self, name), kinds, expected)
        if any(not isinstance(item, Instance) for item in self.instances[:1]):  # a check of each of 200,000 takes time
            _require_items("instances", self.instances, (Instance,), "an Instance")
        for kind in ("meshes", "materials", "lights", "volumes"):
            names = [item.name for item in getattr(self, kind)]
            doubled = sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else []
            if doubled:
                raise InvalidInputError(f"the scene has two {kind} named {doubled[0]!r}; give each its own name")
        meshes, materials = {m.name for m in self.meshes}, {m.name for m in self.materials}
        for instance in self.instances:
            if instance.mesh not in meshes:
                raise InvalidInputError(
                    f"instance {instance.name!r} shows mesh {instance.mesh!r}, which is not in the scene"
                )
            missing = [name for name in instance.materials if name not in materials]
            if missing:
                raise InvalidInputError(
                    f"instance {instance.name!r} has material {missing[0]!r}, which is not in the scene"
                )


_ITEMS: dict[str, tuple[tuple[type, ...], str]] = {
    "meshes": ((Mesh,), "a Mesh"), "materials": ((Material,), "a Material"),
    "lights": (get_args(Light), "a light, such as PointLight"), "volumes": ((VolumeObject,), "a VolumeObject"),
}  # fmt: skip


def _require_items(name: str, items: Iterable[object], kinds: tuple[type, ...], expected: str) -> None:
    for item in items:
        if not isinstance(item, kinds):
            raise InvalidInputError(
                f"{name} of the scene hold {str(item)[:40]!r}, of type {type(item).__name__}; expected {expected}"
            )


def require_scene(scene: object) -> None:
    """Raise InvalidInputError for anything but a scene, such as the path of a .blend file."""
    require_kind("the scene", scene, Scene, "spectral_core.scene; `spectral-scene render` reads .blend files")


def scene_hash(item: Any) -> str:
    """SHA-256 (hex) over every number, text and array of frozen scene data: equal data, equal hash."""
    digest = hashlib.sha256()
    _feed(digest, item)
    return digest.hexdigest()


def _feed(digest: Any, item: Any) -> None:
    if isinstance(item, np.ndarray):
        digest.update(f"a{item.dtype.str}{item.shape}".encode())
        digest.update(np.ascontiguousarray(item).tobytes())
    elif dataclasses.is_dataclass(item):
        digest.update(f"d{type(item).__name__}".encode())
        for entry in dataclasses.fields(item):
            if entry.metadata.get("hashed", True):  # the rest does not change what a picture shows
                _feed(digest, getattr(item, entry.name))
    elif isinstance(item, dict):
        _feed(digest, sorted(item.items()))
    elif isinstance(item, (tuple, list)):
        digest.update(f"l{len(item)}".encode())
        for entry in item:
            _feed(digest, entry)
    elif item is None or isinstance(item, (str, bytes, bool, int, float, np.generic)):
        digest.update(f"v{type(item).__name__}{item!r};".encode())
    else:
        raise InvalidInputError(f"{type(item).__name__} has no place in scene data, so it cannot be hashed")
