# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that are saved in the .blend: spectra on materials, lights, worlds and nodes; render settings; the palette."""
