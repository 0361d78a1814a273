# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that stays loaded and changes while it is looked at: what a viewport shows."""
