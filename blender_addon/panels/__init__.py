# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist sees. Panels show stored properties and never solve, read files or change data."""
