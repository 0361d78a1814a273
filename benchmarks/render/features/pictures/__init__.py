# SPDX-License-Identifier: GPL-3.0-or-later
"""Feature scenes of cameras, films and render settings."""
