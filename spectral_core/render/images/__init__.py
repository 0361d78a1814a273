# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures in files and as environments: read by Mitsuba, and written with spectra."""
