# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights as rows of numbers: those of the light tables, and those of the weights of Mitsuba's emitters."""
