# SPDX-License-Identifier: GPL-3.0-or-later
"""Models of the daylight sky that a scene's atmosphere is computed with."""
