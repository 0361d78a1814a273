# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of omitting one type of effect, from a scene's data: spectra, films, dyes, media."""
