# SPDX-License-Identifier: GPL-3.0-or-later
"""What accuracy costs: error against time, measured at small scale, predicted for the picture, and kept."""
