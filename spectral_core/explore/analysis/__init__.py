# SPDX-License-Identifier: GPL-3.0-or-later
"""Analyses of a table (R5, R6, R7): embeddings, clusters, sensitivity, the point to render next, the Pareto front."""
