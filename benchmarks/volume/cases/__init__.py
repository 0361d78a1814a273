# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields and transfer functions that the benchmarks of volumes render."""
