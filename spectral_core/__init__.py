# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral Scene Design: design colors under lights, render them spectrally, sample volumes and settings well.

The packages are imported by name (``from spectral_core import palette``); this module imports nothing large.
"""

from importlib import metadata as _metadata

try:
    __version__ = _metadata.version("spectral-scene")
except _metadata.PackageNotFoundError:  # a source tree that is not installed
    __version__ = "0+unknown"
