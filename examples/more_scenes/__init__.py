# SPDX-License-Identifier: GPL-3.0-or-later
"""Three small finished scenes: a car paint, a mark on a bank note, a stage."""
