# SPDX-License-Identifier: GPL-3.0-or-later
"""Relighting: stored transport becomes a picture under other lights without tracing a ray."""
