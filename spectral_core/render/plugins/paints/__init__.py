# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors that are computed where light meets the surface."""
