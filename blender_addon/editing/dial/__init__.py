# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial in use: the recording in memory, and the lights of its groups."""
