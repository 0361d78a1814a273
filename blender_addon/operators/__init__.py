# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist can do. Every operator's ``execute`` does the whole work before it returns, also without a window."""
