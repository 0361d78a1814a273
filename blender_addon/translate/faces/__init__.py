# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that lie on each other, for which Cycles' picture depends on chance."""
