# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that stays loaded while it is edited and shown in a viewport."""
