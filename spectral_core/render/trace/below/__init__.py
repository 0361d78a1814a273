# SPDX-License-Identifier: GPL-3.0-or-later
"""Light below the surface: how it enters, scatters there, and leaves."""
