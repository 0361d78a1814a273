# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist can do. Every operator has a synchronous ``execute`` that does the whole work, without a window too."""
