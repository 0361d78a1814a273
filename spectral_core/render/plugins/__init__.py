# SPDX-License-Identifier: GPL-3.0-or-later
"""What Mitsuba lacks to speak Blender: mixed paints, lights with Blender's falloffs, sums of BSDFs, and more.

A plugin's class derives from a class of the active variant, so each module here defines its classes inside
``register(mitsuba)``, which runs once per variant.
"""

from __future__ import annotations

_registered: set[str] = set()


def register(variant: str) -> None:
    """Register every plugin for ``variant``, which must be the active one; a second call does nothing."""
    if variant in _registered:
        return
    import drjit
    import mitsuba

    from spectral_core.render.plugins.closures import bent, glass, holdout, matt, rough, sharp, sheen, subsurface
    from spectral_core.render.plugins.lamps import emitters, environment
    from spectral_core.render.plugins.paints import spectral_image, textures

    paints, lamps = (textures, spectral_image), (emitters, environment)
    closures = (sharp, matt, rough, glass, bent, subsurface, holdout, sheen)
    for module in (*paints, *lamps, *closures):
        module.register(mitsuba, drjit)
    _registered.add(variant)
