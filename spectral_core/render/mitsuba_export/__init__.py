# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene as files that Mitsuba 3 loads without this package: XML, with meshes, images, spectra and grids beside it.

Mitsuba has no counterpart for some parts of a scene. Each of them has a note, and the nearest plugin in its place.
"""

from spectral_core.render.mitsuba_export.folder import MitsubaExport, write_mitsuba

__all__ = ["MitsubaExport", "write_mitsuba"]
