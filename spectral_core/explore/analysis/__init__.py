# SPDX-License-Identifier: GPL-3.0-or-later
"""Analyses of a table: embeddings, clusters, sensitivity, the next point to render, the Pareto front."""
