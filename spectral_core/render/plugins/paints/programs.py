# SPDX-License-Identifier: GPL-3.0-or-later
"""Operations on Dr.Jit arrays for shading programs, and the data of a hit point that they read."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.plugins.closures.facets.upright import toward_viewer
from spectral_core.render.plugins.mesh_tables import barycentric
from spectral_core.render.plugins.paints.pixels import pixel_width, step_along
from spectral_core.render.plugins.paints.probes import Probes
from spectral_core.render.plugins.paints.ray_marks import SINGULAR, read_mark
from spectral_core.render.plugins.paints.remainder import exact_remainder
from spectral_core.render.plugins.paints.tables import SceneTables, attribute_name, data_number
from spectral_core.render.plugins.vertex_normals import normal_at
from spectral_core.scene.rays import Rays
from spectral_core.scene.shading.geometry import shifted_by, step_of


class DrJit:
    """Operations of shading programs on Dr.Jit arrays, at one hit point.

    ``contents``: the program's images, ramps and curves (``SceneTables.contents_of``).
    """

    def __init__(self, tables: SceneTables, si: Any, active: Any, contents: dict[int, Any] | None = None) -> None:
        self.tables, self.si, self.active, self._contents = tables, si, active, contents or {}
        self.mi, self.dr = tables.mi, tables.dr
        dr = self.dr
        self.sin, self.cos, self.tan, self.atan, self.exp, self.log = dr.sin, dr.cos, dr.tan, dr.atan, dr.exp, dr.log
        self.sinh, self.cosh, self.tanh = dr.sinh, dr.cosh, dr.tanh
        self.floor, self.ceil, self.trunc, self.absolute = dr.floor, dr.ceil, dr.trunc, dr.abs
        self.atan2, self.isfinite = dr.atan2, dr.isfinite
        self.minimum, self.maximum = dr.minimum, dr.maximum
        self.asin, self.acos = dr.safe_asin, dr.safe_acos  # of numbers clipped to [-1, 1]
        self._read: dict[tuple[str, int], Any] = {}

    def number(self, value: Any) -> Any:
        """A value of the backend's type."""
        return self.mi.Float(value)

    def where(self, condition: Any, yes: Any, no: Any) -> Any:
        """Choice per lane."""
        if isinstance(condition, (bool, np.bool_)):
            return yes if condition else no
        if isinstance(yes, (int, float)) and isinstance(no, (int, float)):
            yes = self.mi.Float(yes)
        return self.dr.select(condition, yes, no)

    def sqrt(self, value: Any) -> Any:
        """Square root, 0 for negative numbers."""
        return self.dr.safe_sqrt(value)

    def power(self, base: Any, exponent: Any) -> Any:
        """Power of a base over 0."""
        return self.dr.power(base, exponent)

    def fused(self, a: Any, b: Any, c: Any) -> Any:
        """a · b + c with one rounding."""
        return self.dr.fma(a, b, c)

    def fmod(self, a: Any, b: Any) -> Any:
        """Remainder of a / b with the sign of ``a``."""
        return exact_remainder(self.mi, self.dr, a, b)

    def integer(self, value: Any) -> Any:
        """Whole numbers as 32-bit patterns that wrap around."""
        return self.mi.UInt32(self.mi.Int32(value))

    def bits(self, value: Any) -> Any:
        """Bit pattern of numbers."""
        return self.dr.reinterpret_array(self.mi.UInt32, self.mi.Float(value))

    def real(self, value: Any) -> Any:
        """A whole number as a number."""
        return self.mi.Float(value)

    def loop(self, state: tuple[Any, ...], goes_on: Any, body: Any) -> Any:
        """Repeat ``body`` while ``goes_on`` holds for a lane, as one loop in the kernel."""
        return self.dr.while_loop(tuple(state), goes_on, body)

    def entry(self, table: Any, index: Any, column: int) -> Any:
        """Entry of a table at whole-numbered rows."""
        values, last = self._contents[data_number(table)]
        row = self.mi.UInt32(self.dr.clip(index, 0.0, last))
        return self.dr.gather(self.mi.Float, values, row * table.shape[1] + column, self.active)

    def last_row(self, table: Any) -> Any:
        """Number of the last row of a table."""
        return self._contents[data_number(table)][1]

    def texel(self, image: Any, column: Any, row: Any) -> tuple[Any, Any, Any, Any]:
        """Stored color and alpha at whole-numbered places inside the image."""
        mi, dr = self.mi, self.dr
        stored, width, _, is_bytes = self._contents[data_number(image)]
        place = mi.UInt32(row) * mi.UInt32(width) + mi.UInt32(column)
        if is_bytes:
            word = dr.gather(mi.UInt32, stored, place, self.active)
            return tuple(mi.Float((word >> shift) & 255) * (1 / 255) for shift in (0, 8, 16, 24))
        return tuple(dr.gather(mi.Float, stored, place * 4 + k, self.active) for k in range(4))

    def size(self, image: Any) -> tuple[Any, Any]:
        """Width and height of an image."""
        return self._contents[data_number(image)][1:3]

    def open_share(self, normal: Any, distance: Any, samples: int, inside: bool, own: bool) -> Any:
        """Ambient Occlusion: share of rays from the hit that meet nothing within a distance.

        Before the scene is loaded, while the power of emissive surfaces is estimated, every point counts as open.
        """
        if not self.tables.is_live:
            return self.mi.Float(1.0)
        found = Probes(self.tables, self.si, self.active)
        return found.open_share(normal, distance, samples, inside=inside, own=own)

    def rounded(self, normal: Any, radius: Any, samples: int) -> Any:
        """Bevel: mean normal around the hit; as in Cycles, of what eyes and mirrors see alone."""
        if not self.tables.is_live:
            return normal
        sharp = (self.mi.UInt32(self.si.dn_dv.x) & (int(Rays.CAMERA) | SINGULAR)) != 0
        found = Probes(self.tables, self.si, self.active)
        return self._tuple(found.rounded(normal, radius, samples, wanted=sharp))

    def edge_distance(self, in_pixels: bool) -> Any:
        """Distance in the world, or in pixels, to the nearest edge of the triangle that was hit."""
        mi, dr, si = self.mi, self.dr, self.si
        if not self.tables.is_live:
            return mi.Float(dr.inf)
        corners, is_triangle = self.tables.meshes.corners(si, self.active)
        nearest = mi.Float(dr.inf)
        for k in range(3):
            along = dr.normalize(corners[k] - corners[k - 1])
            nearest = dr.minimum(nearest, dr.norm(dr.cross(along, si.p - corners[k])))
        pixel = pixel_width(self.tables, si) if in_pixels else 1.0
        return dr.select(is_triangle, nearest / pixel, dr.inf)

    # the hit point

    def input(self, name: str, shift: int) -> Any:
        """A quantity of the hit point, or of a point at a small step along the surface."""
        if (name, shift) not in self._read:
            self._read[name, shift] = self._input(name, shift)
        return self._read[name, shift]

    def _input(self, name: str, shift: int) -> Any:
        if name in ("step_x", "step_y"):
            return self._tuple(self._step(shifted_by(1 if name == "step_x" else 2, step_of(shift)[1])))
        if name == "position":
            return self._tuple(self._position(shift))
        if name in ("uv", "window", "parametric", "normal_there"):
            return getattr(self, f"_{name}")(shift)
        if name == "generated" or name.startswith("attribute"):
            vector = self._attribute(name, shift)
            return vector[0] if name.startswith(("attribute_alpha", "attribute_factor")) else vector
        if name.startswith("object_attribute:"):
            column = self.tables.attributes.get(name)
            return (self.mi.Float(0.0),) * 3 if column is None else tuple(self._row(column + k) for k in range(3))
        if name.startswith("object_"):
            return self._object(name)
        if name.startswith("ray:"):
            return read_mark(self.mi, self.dr, self.si, name[4:])
        return getattr(self, f"_{name}")()

    @staticmethod
    def _tuple(vector: Any) -> tuple[Any, Any, Any]:
        return vector.x, vector.y, vector.z

    def _position(self, shift: int) -> Any:
        return self.si.p + self._step(shift) if shift else self.si.p

    def _step(self, shift: int) -> Any:
        return step_along(self.tables, self.si, *step_of(shift))

    def _uv(self, shift: int) -> Any:
        mi, dr, si = self.mi, self.dr, self.si
        if shift == 0:
            return si.uv.x, si.uv.y, mi.Float(0.0)
        step = self._step(shift)  # its coordinates in the plane of the UV map's two tangents
        e, f, g = dr.dot(si.dp_du, si.dp_du), dr.dot(si.dp_du, si.dp_dv), dr.dot(si.dp_dv, si.dp_dv)
        a, b = dr.dot(si.dp_du, step), dr.dot(si.dp_dv, step)
        determinant = e * g - f * f
        scale = dr.select(dr.abs(determinant) > 1e-30, dr.rcp(determinant), 0.0)
        return si.uv.x + (g * a - f * b) * scale, si.uv.y + (e * b - f * a) * scale, mi.Float(0.0)

    def _attribute(self, name: str, shift: int) -> Any:
        """A value of the mesh; Mitsuba reads it while the scene is not loaded yet."""
        mi, tables = self.mi, self.tables
        place = self._position(shift)
        if tables.has_instances:  # the position in the triangle is from the mesh's space
            is_instance = self._number_of(self.si.instance) != 0
            place = self.dr.select(
                is_instance, mi.Point3f(*self.transform(self._tuple(place), "POINT", "OBJECT", False)), place
            )
        if tables.is_live:
            found = tables.meshes.attribute(name, self.si, place, self.active)
        else:
            moved = mi.SurfaceInteraction3f(self.si)
            moved.p = place
            found = self.si.shape.eval_attribute_3(attribute_name(name), moved, self.active)
        return found.x, found.y, found.z

    def _sided(self, normal: Any) -> Any:
        """A normal on the viewer's side."""
        toward = self.si.to_world(self.si.wi)
        return self._tuple(self.dr.select(self.dr.dot(self.si.n, toward) < 0.0, -normal, normal))

    def _normal(self) -> Any:
        return self._sided(self.si.sh_frame.n)

    def _normal_there(self, shift: int) -> Any:
        if shift == 0 or not self.tables.is_live:
            return self._normal()
        return self._sided(normal_at(self.tables.meshes, self.si, self._position(shift), self.active))

    def _true_normal(self) -> Any:
        return self._sided(self.si.n)

    def _incoming(self) -> Any:
        return self._tuple(toward_viewer(self.mi, self.dr, self.si))

    def _backfacing(self) -> Any:
        return self.dr.select(self.dr.dot(self.si.n, self.si.to_world(self.si.wi)) < 0.0, self.mi.Float(1.0), 0.0)

    def _parametric(self, shift: int) -> Any:
        """Shares of the triangle's first and second corner, as the Geometry node shows them."""
        mi, dr, si = self.mi, self.dr, self.si
        if not self.tables.is_live:
            return si.uv.x, si.uv.y, mi.Float(0.0)
        corners, is_triangle = self.tables.meshes.corners(si, self.active)
        first, second, third = barycentric(dr, corners, mi.Point3f(self._position(shift)))
        first = dr.select(self.tables.is_reversed(si, self.active), third, first)
        return dr.select(is_triangle, first, 0.0), dr.select(is_triangle, second, 0.0), mi.Float(0.0)

    def _edge_u(self) -> Any:
        """In the world, from the triangle's first corner to its second; 0 where no triangle is hit."""
        return self._edge(1)

    def _edge_v(self) -> Any:
        """From the triangle's first corner to its third."""
        return self._edge(2)

    def _edge(self, corner: int) -> Any:
        if not self.tables.is_live:
            return self._tuple(self.si.dp_du)
        corners, is_triangle = self.tables.meshes.corners(self.si, self.active)
        return self._tuple(self.dr.select(is_triangle, corners[corner] - corners[0], 0.0))

    def _window(self, shift: int) -> Any:
        mi = self.mi
        x, y, z = self.transform(self._tuple(self._position(shift)), "POINT", "CAMERA", False)
        width, height, shift_x, shift_y, perspective = self.tables.camera_window()
        depth = self.dr.select(perspective > 0.5, self.dr.maximum(z, 1e-9), 1.0)
        return x / (depth * width) + 0.5 - shift_x, y / (depth * height) + 0.5 - shift_y, mi.Float(0.0)

    def _number_of(self, pointer: Any) -> Any:
        return self.dr.reinterpret_array(self.mi.UInt32, pointer)

    def _row(self, column: int) -> Any:
        mi, dr = self.mi, self.dr
        if ("row", 0) not in self._read:
            instance = self._number_of(self.si.instance)
            number = dr.select(instance != 0, instance, self._number_of(self.si.shape))
            self._read["row", 0] = self.tables.row_of(number)
        return dr.gather(mi.Float, self.tables.buffer(), self._read["row", 0] + column, self.active)

    def _object(self, name: str) -> Any:
        columns = {"object_alpha": 27, "object_index": 28, "object_random": 29}
        if name in columns:
            return self._row(columns[name])
        return tuple(self._row(k) for k in ((15, 19, 23) if name == "object_location" else (24, 25, 26)))

    def transform(self, vector: Any, kind: str, space: str, inverse: bool) -> Any:
        """From the world to ``OBJECT`` or ``CAMERA`` space, or back."""
        rows = self._camera_rows(inverse) if space == "CAMERA" else self._object_rows(inverse)
        if kind == "NORMAL":  # in the other direction by the transposed matrix
            other = self._camera_rows(not inverse) if space == "CAMERA" else self._object_rows(not inverse)
            return tuple(sum(other[j][i] * vector[j] for j in range(3)) for i in range(3))
        moved = tuple(sum(rows[i][j] * vector[j] for j in range(3)) for i in range(3))
        return tuple(m + rows[i][3] for i, m in enumerate(moved)) if kind == "POINT" else moved

    def _object_rows(self, inverse: bool) -> list[list[Any]]:
        start = 12 if inverse else 0
        return [[self._row(start + 4 * i + j) for j in range(4)] for i in range(3)]

    def _camera_rows(self, inverse: bool) -> list[list[Any]]:
        return self.tables.camera_matrix(inverse)
