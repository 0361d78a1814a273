# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes beside the picture: data of the first hit, shares of the light, cryptomattes."""
