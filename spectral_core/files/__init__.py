# SPDX-License-Identifier: GPL-3.0-or-later
"""Access to files: written whole or not at all (``whole``), read with limits (``guarded``, ``unpack``)."""
