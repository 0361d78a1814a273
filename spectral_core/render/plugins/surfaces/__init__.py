# SPDX-License-Identifier: GPL-3.0-or-later
"""All surfaces of a scene as one: which closures a hit finds, and their numbers, are rows of tables."""
