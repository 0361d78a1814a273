# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's commands. Every operator's ``execute`` does the whole work before it returns, also without a window."""
