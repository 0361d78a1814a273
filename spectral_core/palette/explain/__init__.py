# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers that need further programs: why cells are missed whose multipliers identify no other cell, and how far a
possible color must be from the edge.
"""
