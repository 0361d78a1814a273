# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes inside Mitsuba scenes: the integrator plugin and the light that reaches a volume."""
