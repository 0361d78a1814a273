# SPDX-License-Identifier: GPL-3.0-or-later
"""How files are touched: written whole or not at all (``whole``), read with limits (``guarded``, ``unpack``)."""
