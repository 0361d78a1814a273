# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the benchmarks of volumes."""
