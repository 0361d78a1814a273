# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial while it is turned: the recorded light in memory, and the lights that it represents."""
