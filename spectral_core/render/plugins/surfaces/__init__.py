# SPDX-License-Identifier: GPL-3.0-or-later
"""All surfaces of a scene as one: the closures of a hit and their numbers are rows of tables."""
