# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras: lenses, sensors, shifts, depth of field, clipping, panoramas, odd transforms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _lens(**values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        for name, value in values.items():
            setattr(stage.camera.data, name, value)

    return build


def _open(**values: Any) -> Callable[[Stage], None]:
    """Depth of field, out of focus on the ball."""

    def build(stage: Stage) -> None:
        dof = stage.camera.data.dof
        dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 3.0, 0.05
        for name, value in values.items():
            setattr(dof, name, value)

    return build


feature("camera/wide", _lens(lens=25))
feature("camera/tele", _lens(lens=120))
feature("camera/sensor", _lens(sensor_width=24))
feature("camera/fit horizontal", _lens(sensor_fit="HORIZONTAL"))
feature("camera/fit vertical", _lens(sensor_fit="VERTICAL", sensor_height=20))
feature("camera/shift", _lens(shift_x=0.1, shift_y=-0.07))
feature("camera/orthographic", _lens(type="ORTHO", ortho_scale=4.0))
feature("camera/orthographic shift", _lens(type="ORTHO", ortho_scale=4.0, shift_x=0.1))
feature("camera/clip start", _lens(clip_start=5.3))
feature("camera/clip end", _lens(clip_end=6.5))
feature("camera/depth of field", _open(), 2)
feature("camera/focus object", lambda s: (_open()(s), setattr(s.camera.data.dof, "focus_object", s.ball)), 2)
feature("camera/aperture blades", _open(aperture_blades=5, aperture_rotation=0.3), 2)
feature("camera/aperture ratio", _open(aperture_ratio=2.0), 2)
feature("camera/depth of field orthographic", lambda s: (_lens(type="ORTHO", ortho_scale=4.0)(s), _open()(s)), 2)
for _kind in ("EQUIRECTANGULAR", "FISHEYE_EQUIDISTANT", "FISHEYE_EQUISOLID", "MIRRORBALL", "FISHEYE_LENS_POLYNOMIAL",
              "EQUIANGULAR_CUBEMAP_FACE", "CENTRAL_CYLINDRICAL"):  # fmt: skip
    feature(f"camera/panorama {_kind.lower()}", _lens(type="PANO", panorama_type=_kind))
feature("camera/custom", _lens(type="CUSTOM"))
feature("camera/rolled", lambda s: setattr(s.camera, "rotation_euler", (1.35, 0.4, 0.0)))
feature("camera/scaled", lambda s: setattr(s.camera, "scale", (2.0, 0.5, 3.0)))
feature("camera/mirrored", lambda s: setattr(s.camera, "scale", (-1.0, 1.0, 1.0)))
feature("camera/in the ball", lambda s: setattr(s.camera, "location", (0, -0.5, 1.0)))
feature("camera/under the floor", lambda s: setattr(s.camera, "location", (0, -6.0, -0.5)))
feature("camera/lamp as camera", lambda s: setattr(s.scene, "camera", s.lamp))
feature("camera/markers do not matter", lambda s: s.scene.timeline_markers.new("A", frame=1))


def _stereo(stage: Stage) -> None:
    stage.scene.render.use_multiview = True
    stage.scene.render.views_format = "STEREO_3D"
    stage.scene.render.image_settings.views_format = "STEREO_3D"


feature("camera/stereo", _stereo)
