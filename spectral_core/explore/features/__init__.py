# SPDX-License-Identifier: GPL-3.0-or-later
"""Features of outcomes: measures of pictures, safe expressions over columns, distances between rows."""
