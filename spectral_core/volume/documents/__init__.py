# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions as files."""
