# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact integrals, an oracle of the march, and other programs."""
