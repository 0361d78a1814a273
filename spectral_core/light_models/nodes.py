# SPDX-License-Identifier: GPL-3.0-or-later
"""Node model: a surface is its reflectance at m wavelengths, a light the 3×m matrix that computes colors from them.

Products of reflectances are exact at the nodes, so errors do not grow with reflections; a lamp's lines cost nothing,
since a light is integrated once, at 1 nm, into its matrix. The only approximation is the reflectance between the
nodes, as a linear interpolation learned from natural surfaces, or from the K surfaces of a scene: any K reflectances
span K dimensions, so m >= K scene nodes reproduce them, and every additive mixture of them, exactly.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_kind, require_whole
from spectral_core.errors import InvalidInputError, counted
from spectral_core.light_models.interface import LightModel, values_on_grid
from spectral_core.spectra import catalogue
from spectral_core.spectra.observer import Observer, xyz_from_spectrum
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

Array = NDArray[np.float64]

NATURAL_NODES_NM: dict[int, tuple[float, ...]] = {
    6: (430, 460, 530, 560, 600, 630),
    7: (440, 480, 520, 550, 580, 600, 630),
    8: (430, 460, 490, 530, 550, 580, 610, 640),
    9: (430, 460, 490, 510, 540, 570, 600, 620, 650),
}
"""Node wavelengths by m, optimized on natural reflectances under lamps of all types."""


class NodeModel(LightModel):
    """Reflectance at ``nodes_nm`` (m,), and ``values_from_nodes`` (n, m), its interpolation to the grid."""

    def __init__(
        self,
        grid: SpectralGrid,
        nodes_nm: ArrayLike,
        values_from_nodes: ArrayLike,
        viewer: Observer | None = None,
    ) -> None:
        self.nodes_nm: Array = frozen_array("nodes_nm", nodes_nm, (None,))
        _require_nodes(self.nodes_nm, grid)
        self.values_from_nodes: Array = frozen_array(
            "values_from_nodes", values_from_nodes, (grid.size, self.nodes_nm.size)
        )
        super().__init__(grid, grid.values_from_knots(self.nodes_nm), viewer)

    @classmethod
    def natural(
        cls,
        nodes: int | ArrayLike = 8,
        grid: SpectralGrid | None = None,
        *,
        training: ArrayLike | None = None,
        viewer: Observer | None = None,
    ) -> Self:
        """Nodes for natural surfaces.

        ``nodes``: how many (6 to 9), or their wavelengths in nm. ``grid``: 380 to 780 nm by 5 by default. ``training``:
        reflectances (r, n) on the grid to learn the interpolation from; the shipped statistics of 99 natural and
        manufactured materials by default.
        """
        grid = SpectralGrid.uniform(380, 780, 5) if grid is None else grid
        if isinstance(nodes, int | np.integer):
            wavelengths = _natural_nodes(int(nodes))
        else:
            wavelengths = np.atleast_1d(frozen_array("nodes", nodes))
        _require_nodes(wavelengths, grid)
        known = _natural_training(grid) if training is None else np.atleast_2d(values_on_grid(training, grid))
        at_nodes = known @ grid.values_from_knots(wavelengths).T
        return cls(grid, wavelengths, np.linalg.lstsq(at_nodes, known, rcond=None)[0].T, viewer)

    @classmethod
    def scene(
        cls,
        reflectances: ArrayLike | Sequence[Spectrum],
        grid: SpectralGrid,
        *,
        size: int | None = None,
        viewer: Observer | None = None,
    ) -> Self:
        """Nodes that reproduce K given reflectances (K, n) exactly under every light, if ``size`` >= their rank.

        ``reflectances``: values on the grid, or spectra, of which the samples at the grid's knots are meant.
        ``size``: number of nodes, max(K, 8) by default but no more than the grid holds. What is left free is fitted to
        the products of two of them and to natural surfaces, for reflections between objects and later additions.
        """
        scene = frozen_array("reflectances", np.atleast_2d(values_on_grid(reflectances, grid)), (None, grid.size))
        count = min(max(scene.shape[0], 8), grid.size) if size is None else size
        if not 1 <= require_whole("size", count, -1 << 31, 1 << 31) <= grid.size:
            raise InvalidInputError(f"{counted(count, 'node')} on {grid}; expected 1 to {grid.size}")
        further = np.concatenate([_pairwise_products(scene), _natural_training(grid)])
        moments = _second_moments(scene, further)
        visibility = np.linalg.norm(xyz_from_spectrum(grid, viewer), axis=0)
        candidates = [_greedy_nodes(moments, visibility, count)]
        # No optimized set may have this size, and the grid may not reach its nodes.
        with contextlib.suppress(InvalidInputError):
            candidates.append(_nearest_knots(_natural_nodes(count), grid))
        fits = [(_exact_then_best(scene, further, picked), picked) for picked in candidates]

        def badness(fit: tuple[Array, Array]) -> float:
            off_scene = np.abs(scene - scene[:, fit[1]] @ fit[0].T).max()
            off_rest = (further - further[:, fit[1]] @ fit[0].T) * visibility
            return float(np.linalg.norm(off_rest) + 1e9 * max(0.0, off_scene - 1e-10))

        values_from_nodes, picked = min(fits, key=badness)
        return cls(grid, grid.wavelengths_nm[picked], values_from_nodes, viewer)

    @property
    def multiplications_per_reflection(self) -> int:
        """m."""
        return self.size

    def xyz_from_coefficients(self, light: Spectrum) -> Array:
        """The light's integral over each node's interpolation function, (3, m)."""
        return self.matrix_of_light(light) @ self.values_from_nodes

    def reflect(self, first: ArrayLike, second: ArrayLike) -> Array:
        """Node by node: exact there."""
        return self.numbers_of(first) * self.numbers_of(second)


def _require_nodes(nodes_nm: Array, grid: SpectralGrid) -> None:
    require_kind("the grid", grid, SpectralGrid)
    low, high = grid.wavelengths_nm[0], grid.wavelengths_nm[-1]
    if nodes_nm.size == 0 or np.any(np.diff(nodes_nm) <= 0) or nodes_nm[0] < low or nodes_nm[-1] > high:
        raise InvalidInputError(
            f"node wavelengths {nodes_nm.tolist()} nm; expected at least one, rising, between {low:g} and {high:g} nm"
        )


def _natural_nodes(count: int) -> Array:
    if count not in NATURAL_NODES_NM:
        raise InvalidInputError(
            f"{count} natural nodes; searched sets are {', '.join(map(str, NATURAL_NODES_NM))}, or give the wavelengths"
        )
    return np.array(NATURAL_NODES_NM[count], dtype=np.float64)


def _natural_training(grid: SpectralGrid) -> Array:
    """Reflectances (r, n) with the second moments of natural ones; least squares depends on these moments alone."""
    wavelengths, components = catalogue.natural_reflectance_components()
    # Beyond the measured range a reflectance keeps its last value instead of dropping to zero.
    return np.array([np.interp(grid.wavelengths_nm, wavelengths, row) for row in components])


def _pairwise_products(scene: Array) -> Array:
    first, second = np.triu_indices(scene.shape[0])
    if first.size > 2000:  # enough to know the span; all pairs of hundreds of surfaces would only cost time
        chosen = np.linspace(0, first.size - 1, 2000).astype(int)
        first, second = first[chosen], second[chosen]
    return scene[first] * scene[second]


def _second_moments(scene: Array, further: Array) -> Array:
    """(n, n) moments of the spectra that nodes should serve, the scene's and the others' each counting the same."""
    of_scene, of_further = (part.T @ part / max(float(np.sum(part**2)), 1e-300) for part in (scene, further))
    return of_scene + of_further


def _greedy_nodes(moments: Array, visibility: Array, count: int) -> Array:
    """Ascending indices of ``count`` samples, each the sample that lowers the visible remainder of ``moments`` most.

    ``visibility``: (n,) weight of an error at each sample. Regressing spectra with second moments C on sample j leaves
    C - C_j C_jᵀ / C_jj.
    """
    rest = moments.copy()
    chosen: list[int] = []
    floor = 1e-13 * float(np.trace(moments)) + 1e-300
    for _ in range(count):
        gains = (visibility[:, None] ** 2 * rest**2).sum(axis=0) / np.maximum(np.diag(rest), floor)
        gains[chosen] = -1.0
        best = int(np.argmax(gains))
        chosen.append(best)
        rest = rest - np.outer(rest[:, best], rest[best]) / max(float(rest[best, best]), floor)
    return np.sort(np.array(chosen, dtype=int))


def _nearest_knots(nodes_nm: Array, grid: SpectralGrid) -> Array:
    """Indices of the knots nearest to wavelengths. Raises InvalidInputError if two fall onto one."""
    _require_nodes(nodes_nm, grid)
    nearest = np.abs(grid.wavelengths_nm - nodes_nm[:, None]).argmin(axis=1)
    if np.unique(nearest).size < nearest.size:
        raise InvalidInputError(f"{grid} is too coarse for the nodes {nodes_nm.tolist()} nm")
    return nearest


def _exact_then_best(scene: Array, further: Array, picked: Sequence[int] | Array) -> Array:
    """Interpolation W (n, m) with W·scene[picked] = scene, and of those the best for ``further`` in least squares."""
    at_nodes = scene[:, picked]
    left, singular, right = np.linalg.svd(at_nodes)
    rank = int(np.sum(singular > singular[0] * 1e-12)) if singular.size and singular[0] > 0 else 0
    exact = (scene.T @ left[:, :rank] / singular[:rank]) @ right[:rank]
    free = right[rank:]
    if free.shape[0]:
        coordinates, *_ = np.linalg.lstsq(
            further[:, picked] @ free.T, further - further[:, picked] @ exact.T, rcond=1e-10
        )
        exact = exact + coordinates.T @ free
    return exact
