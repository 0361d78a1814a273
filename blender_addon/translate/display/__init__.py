# SPDX-License-Identifier: GPL-3.0-or-later
"""From linear light to display colors: the settings of a scene's view, and its transform."""
