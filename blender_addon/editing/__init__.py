# SPDX-License-Identifier: GPL-3.0-or-later
"""Live models between the stored properties and the core: palette, dial, mixing board, volumes and spectra."""
