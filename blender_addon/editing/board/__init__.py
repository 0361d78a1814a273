# SPDX-License-Identifier: GPL-3.0-or-later
"""The mixing board while it runs: devices, the numbers that faders move, and a recording of the motion."""
