# SPDX-License-Identifier: GPL-3.0-or-later
"""The search trees of a loaded scene, updated one by one.

Mitsuba 3.9 builds the trees of all meshes anew after any change, whatever has moved, in a time that grows with the
number of triangles. Its scene is one of Embree, the library that it brings along, and Embree can move one instance, or
exchange the tree of one mesh, in a small part of the time. Where Mitsuba's scene cannot be found for certain (another
version, another system), there are no such trees, and Mitsuba does its own work.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene.geometry import Part
from spectral_core.render.plugins.numbers import own_copy

TRIANGLES, INDICES, VERTICES, THREE_NUMBERS, THREE_FLOATS, MATRIX = 0, 0, 1, 0x5003, 0x9003, 0x9244
"""Embree 3's numbers of a type of geometry, of its buffers and their formats, and of a matrix by columns."""
_P, _U, _S = ctypes.c_void_p, ctypes.c_uint, ctypes.c_size_t
_SCENE, _MESH, _DEVICE = "PNS_10RTCSceneTyE", "PNS_13RTCGeometryTyE", "PNS_11RTCDeviceTyE"
FUNCTIONS: dict[str, tuple[str, Any, list[Any]]] = {
    "rtcGetSceneDevice": (_SCENE, _P, [_P]),
    "rtcReleaseDevice": (_DEVICE, None, [_P]),
    "rtcGetDeviceError": (_DEVICE, ctypes.c_int, [_P]),
    "rtcGetSceneBounds": (f"{_SCENE}PNS_9RTCBoundsE", None, [_P, _P]),
    "rtcNewScene": (_DEVICE, _P, [_P]),
    "rtcReleaseScene": (_SCENE, None, [_P]),
    "rtcCommitScene": (_SCENE, None, [_P]),
    "rtcGetGeometry": (f"{_SCENE}j", _P, [_P, _U]),
    "rtcNewGeometry": (f"{_DEVICE}NS_15RTCGeometryTypeE", _P, [_P, _U]),
    "rtcReleaseGeometry": (_MESH, None, [_P]),
    "rtcCommitGeometry": (_MESH, None, [_P]),
    "rtcAttachGeometry": (f"{_SCENE}{_MESH}", _U, [_P, _P]),
    "rtcSetNewGeometryBuffer": (f"{_MESH}NS_13RTCBufferTypeEjNS_9RTCFormatEmm", _P, [_P, _U, _U, _U, _S, _S]),
    "rtcSetGeometryTransform": (f"{_MESH}jNS_9RTCFormatEPKv", None, [_P, _U, _U, _P]),
    "rtcSetGeometryInstancedScene": (f"{_MESH}{_SCENE}", None, [_P, _P]),
}
"""Of each function its arguments as its name in Mitsuba's library states them, its result and its arguments."""
RAYS = {1: "", 4: "PKi", 8: "PKi", 16: "PKi"}
"""Numbers of rays that one call traces, and the first argument then."""


@dataclass(frozen=True)
class _Libraries:
    """``embree``: its functions; ``hits``, ``shadows``: addresses of those that trace rays. ``data``, ``release``:
    functions of Dr.Jit's core.
    """

    embree: dict[str, Any]
    hits: frozenset[int | None]
    shadows: frozenset[int | None]
    data: Callable[..., int]
    release: Callable[..., None]

    def address(self, variable: int) -> int | None:
        """Where the data of a variable of Dr.Jit are."""
        found = ctypes.c_void_p()
        self.release(self.data(variable & 0xFFFFFFFF, ctypes.byref(found)))
        return found.value


class Trees:
    """The trees of one scene of Mitsuba. Nothing may be traced between the first change and ``finish``."""

    def __init__(self, embree: dict[str, Any], top: int, scene: Any, spare: Any) -> None:
        self._embree, self._top, self._scene, self._spare = embree, top, scene, spare
        self._middle, self._radius = np.zeros(3), float("inf")
        self.tell_size()
        self._places = {shape.ptr: place for place, shape in enumerate(scene.shapes())}
        self._device = embree["rtcGetSceneDevice"](top)
        embree["rtcReleaseDevice"](self._device)  # the scene keeps it

    @staticmethod
    def of(scene: Any, spare: Any) -> Trees | None:
        """The trees of Mitsuba's scene; None if they are not found for certain. ``spare``: a triangle of no scene."""
        import drjit as dr

        libraries = _libraries()
        if libraries is None:
            return None
        found: list[int] = []
        with dr.scoped_set_flag(dr.JitFlag.EnableObjectTraversal):
            scene._traverse_1_cb_ro(lambda index, *_: found.append(index))
        if len(found) < 3:
            return None
        top, hit, shadow = map(libraries.address, found[:3])
        # both functions prove that the three are the scene's handles, and those of this very library
        is_certain = hit in libraries.hits and shadow in libraries.shadows
        return Trees(libraries.embree, top, scene, spare) if top and is_certain else None

    def place(self, shape: Any, matrix: Any) -> None:
        """Move an instance to ``matrix`` (4, 4), world from object."""
        columns = np.ascontiguousarray(np.asarray(matrix, dtype=np.float32).T)
        instance = self._geometry(shape)
        self._embree["rtcSetGeometryTransform"](instance, 0, MATRIX, columns.ctypes.data)
        self._embree["rtcCommitGeometry"](instance)

    def follow(self, shape: Any, positions: Any) -> None:
        """Give a single mesh of the scene, such as an area lamp, its new ``positions`` (n, 3)."""
        mesh = self._geometry(shape)
        self._write(mesh, VERTICES, THREE_FLOATS, np.asarray(positions, dtype=np.float32))
        self._embree["rtcCommitGeometry"](mesh)

    def reshape(self, shapes: Sequence[Any], parts: Sequence[Part]) -> None:
        """Give the instances (``shapes``) of one group of meshes a tree of its new ``parts``, in the group's order."""
        embree = self._embree
        group = embree["rtcNewScene"](self._device)
        for part in parts:
            mesh = embree["rtcNewGeometry"](self._device, TRIANGLES)
            self._write(mesh, VERTICES, THREE_FLOATS, part.positions.astype(np.float32))
            self._write(mesh, INDICES, THREE_NUMBERS, part.triangles.astype(np.uint32))
            embree["rtcCommitGeometry"](mesh)
            embree["rtcAttachGeometry"](group, mesh)
            embree["rtcReleaseGeometry"](mesh)
        embree["rtcCommitScene"](group)
        for shape in shapes:
            instance = self._geometry(shape)
            embree["rtcSetGeometryInstancedScene"](instance, group)
            embree["rtcCommitGeometry"](instance)
        embree["rtcReleaseScene"](group)  # the instances keep it

    def finish(self) -> bool:
        """Build the tree of the instances; False after an error, after which Mitsuba must build all trees."""
        self._embree["rtcCommitScene"](self._top)
        self._follow_size()
        return bool(self._embree["rtcGetDeviceError"](self._device) == 0)

    def tell_size(self) -> None:
        """Make a box of twice the scene's size known to the emitters that send shadow rays that far: the scene may then
        grow. Call it after Mitsuba has made the scene itself known.
        """
        import mitsuba as mi

        emitters, (low, high) = far_emitters(self._scene), self._bounds()
        if not emitters or not np.isfinite((low, high)).all():  # without any object there is no box
            return
        size = 2 * (high - low)
        self._middle, self._radius = (low + high) / 2, float(np.linalg.norm(size)) / 2
        corners = (self._middle - size / 2, self._middle, self._middle + size / 2)
        parameters = mi.traverse(self._spare)
        given = {"vertex_positions": np.array(corners, np.float32), "faces": np.array([0, 1, 2], np.uint32)}
        for name, values in given.items():
            parameters[name] = own_copy(type(parameters[name]), values)
        parameters.update()
        room = mi.load_dict({"type": "scene", "room": self._spare}, parallel=False, optimize=False)
        for emitter in emitters:
            emitter.set_scene(room)

    def _follow_size(self) -> None:
        low, high = self._bounds()
        farthest = np.maximum(np.abs(low - self._middle), np.abs(high - self._middle))
        if np.linalg.norm(farthest) > self._radius:
            self.tell_size()

    def _bounds(self) -> tuple[Any, Any]:
        """Lowest and highest corner of all that the trees hold."""
        room = np.zeros(12, np.float32)
        bounds = room[(-room.ctypes.data % 16) // 4 :][:8]  # on a boundary of 16 bytes
        self._embree["rtcGetSceneBounds"](self._top, bounds.ctypes.data)
        low, high = bounds.reshape(2, 4)[:, :3].astype(np.float64)
        return low, high

    def _geometry(self, shape: Any) -> Any:
        return self._embree["rtcGetGeometry"](self._top, self._places[shape.ptr])

    def _write(self, mesh: Any, buffer: int, kind: int, rows: Any) -> None:
        """Copy rows of three numbers into a buffer of Embree's own, which has the room that it reads beyond the end."""
        flat = np.ascontiguousarray(rows)
        room = self._embree["rtcSetNewGeometryBuffer"](mesh, buffer, 0, kind, 12, len(flat))
        ctypes.memmove(room, flat.ctypes.data, flat.nbytes)


def far_emitters(scene: Any) -> list[Any]:
    """The emitters that send shadow rays as far as the scene is large: the environment, and suns of one direction.

    Mitsuba's scene makes its later size known to the environment alone.
    """
    import mitsuba as mi

    suns = [each for each in scene.emitters() if mi.has_flag(each.flags(), mi.EmitterFlags.DeltaDirection)]
    world = scene.environment()
    return suns if world is None else [*suns, world]


@cache
def _libraries() -> _Libraries | None:
    """The libraries that Mitsuba has loaded; None if they are not what this module knows."""
    import drjit
    import mitsuba

    end = ".dylib" if sys.platform == "darwin" else ".so"  # on Windows the functions have other names
    paths = (Path(str(mitsuba.__file__)).with_name(f"libembree3{end}"),
             Path(str(drjit.__file__)).with_name(f"libdrjit-core{end}"))  # fmt: skip
    if mitsuba.__version__.split(".")[:2] != ["3", "9"] or not all(path.is_file() for path in paths):
        return None
    try:
        library, core = (ctypes.CDLL(str(path)) for path in paths)
        embree: dict[str, Any] = {}
        for name, (words, result, arguments) in FUNCTIONS.items():
            embree[name] = library[_long_name(name, words)]
            embree[name].restype, embree[name].argtypes = result, arguments
        data, release = core["_Z12jit_var_datajPPv"], core["_Z20jit_var_dec_ref_implj"]
        data.restype, data.argtypes, release.restype, release.argtypes = _U, [_U, _P], None, [_U]
        hits, shadows = _tracing(library, "rtcIntersect", "RTCRayHit"), _tracing(library, "rtcOccluded", "RTCRay")
    except (OSError, AttributeError):
        return None
    return _Libraries(embree, hits, shadows, data, release)


def _tracing(library: Any, name: str, rays: str) -> frozenset[int | None]:
    """Addresses of the functions that trace ``rays`` (a type), for each number of them."""
    found = []
    for count, first in RAYS.items():
        kind = rays if count == 1 else f"{rays}{count}"
        words = f"{first}{_SCENE}PNS_19RTCIntersectContextEPNS_{len(kind)}{kind}E"
        found.append(ctypes.cast(library[_long_name(f"{name}{count}", words)], _P).value)
    return frozenset(found)


def _long_name(name: str, arguments: str) -> str:
    """Name of a function of Mitsuba's Embree in its library (Itanium C++ ABI)."""
    return f"_ZN7mitsuba{len(name)}{name}E{arguments}"
