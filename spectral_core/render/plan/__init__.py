# SPDX-License-Identifier: GPL-3.0-or-later
"""The effects that a scene needs, with reasons."""
