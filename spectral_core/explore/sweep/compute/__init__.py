# SPDX-License-Identifier: GPL-3.0-or-later
"""Ready compute nodes: a Python function, a command line, a scene, a palette problem, a volume."""
