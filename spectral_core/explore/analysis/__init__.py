# SPDX-License-Identifier: GPL-3.0-or-later
"""Analyses of a table (R5, R6, R7): embeddings, clusters, sensitivity, the next point to render, the Pareto front."""
