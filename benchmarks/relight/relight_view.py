# SPDX-License-Identifier: GPL-3.0-or-later
"""The view transform of the dial's page, a table, against Blender's own: random colors, and light of one wavelength."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options

LEAST_STOP, LARGEST_STOP = -8, 3
"""Range of the random colors: their channels are 2 to these powers."""


VIEWS = (("AgX", "None"), ("AgX", "AgX - High Contrast"), ("Standard", "None"), ("Filmic", "None"))
"""Views, each with a look; the first has the nodes of Blender's own table."""


def run(options: Options) -> dict[str, Any]:
    """Levels of 255 by which each view differs: in the mean, in 99 % of the channels, and at most."""
    import bpy

    import blender_addon

    blender_addon.register_once()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    count = 32 if options.quick else 512
    random = 2.0 ** np.random.default_rng(11).uniform(LEAST_STOP, LARGEST_STOP, (count, count, 3))
    figures: dict[str, Any] = {}
    for view, look in VIEWS:
        scene.view_settings.view_transform, scene.view_settings.look = view, look
        of_view = figures[view if look == "None" else look] = {}
        for name, linear in (
            ("colors in sRGB", random),
            ("light of one wavelength", _lines(1 if options.quick else 8)),
        ):
            of_view[name] = found = _away(scene, linear)
            print(
                f"{view if look == 'None' else look}, {name}: {found['mean']:.2f} levels of 255 in the mean, "
                f"{found['p99']:.1f} in 99 %, {found['most']:.1f}"
            )
    inside, outside = figures["AgX"]["colors in sRGB"], figures["AgX"]["light of one wavelength"]
    plain = [figures[view]["colors in sRGB"]["most"] for view in ("Standard", "Filmic")]
    figures["holds"] = {
        "AgX: colors in sRGB differ by at most 0.02 levels in the mean": inside["mean"] <= 0.02,
        "AgX: light of one wavelength differs by at most 0.2 levels in the mean": outside["mean"] <= 0.2,
        "Standard and Filmic: colors in sRGB differ by less than one level": max(plain) < 1.0,
    }
    return figures


def _away(scene: Any, linear: NDArray[np.float64]) -> dict[str, float]:
    """Differences of what the page shows from Blender's picture; a view without a table is plain sRGB."""
    from blender_addon.translate.display.transform import shown_pixels, view_transform_of
    from spectral_core.spectra.color import display_rgb_from_linear

    table = view_transform_of(scene)
    shown = np.clip(display_rgb_from_linear(linear), 0.0, 1.0) if table is None else table.shown(linear)
    away = 255 * np.abs(shown - shown_pixels(scene, linear))
    return {"mean": float(away.mean()), "p99": float(np.percentile(away, 99)), "most": float(away.max())}


def _lines(per_stop: int) -> NDArray[np.float64]:
    """Linear sRGB of light of one wavelength, (levels, wavelengths, 3): from 440 to 650 nm, its luminance in steps."""
    import colour

    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    lines = np.array([observer[nm] / observer[nm][1] for nm in range(440, 651, 2)])
    colors = np.asarray(colour.XYZ_to_RGB(lines, "sRGB", apply_cctf_encoding=False))
    levels = 2.0 ** (np.arange(-6 * per_stop, 2 * per_stop) / per_stop)
    return colors[None] * levels[:, None, None]
