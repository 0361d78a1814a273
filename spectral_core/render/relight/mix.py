# SPDX-License-Identifier: GPL-3.0-or-later
"""From stored transport to a picture: a matrix product over pixels, and a live mix that recomputes only changes."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_kind
from spectral_core.errors import InvalidInputError
from spectral_core.render.light_groups import group_text
from spectral_core.render.mitsuba_scene.paint import unit_luminance
from spectral_core.render.relight.storage import relative_to_flat
from spectral_core.render.relight.transport import Transport
from spectral_core.scene.look import shown
from spectral_core.spectra.spectrum import Spectrum

Pixels = NDArray[np.float32]
QUICK_SECONDS = 0.004
"""A light whose picture takes longer is shown at half the size while it is dragged."""
BRIGHTEST = 1e30
"""Largest factor on a recording: its product with a pixel fits into single precision."""


def relight(
    transport: Transport, *, lights: Mapping[str, Spectrum] | None = None, mix: Mapping[str, float] | None = None
) -> Pixels:
    """Picture (height, width, 4), linear sRGB and coverage, row 0 at the bottom, as renders show it (``as_rendered``).

    ``lights``: new spectra by group, normalized to the luminance of white; the others keep theirs. ``mix``: intensity
    by group relative to the render, at least 0, 1 by default. Raises UnknownNameError for a group that the transport
    does not contain, InvalidInputError for a negative intensity or for a spectrum with a ``dial`` transport.
    """
    live = LiveMix(transport)
    for group, light in (lights or {}).items():
        live.set_light(group, light)
    return as_rendered(transport, live.picture(amounts_of(transport, mix)))


def as_rendered(transport: Transport, pixels: Pixels) -> Pixels:
    """Pixels (height, width, 3 or 4) of a mix with the exposure and adaptation of the scene's look, as renders have
    them; the same array without any.
    """
    return pixels if transport.look is None else shown(transport.look, pixels)


def amounts_of(transport: Transport, mix: Mapping[str, float] | None) -> NDArray[np.float64]:
    """Intensity (groups,) of each light group relative to the render; 1 for those that ``mix`` does not contain."""
    amounts = np.ones(len(transport.groups))
    if mix is not None:
        require_kind("the mix", mix, Mapping, "intensity by name of a light group")
    for group, amount in (mix or {}).items():
        amounts[transport.index_of(group)] = frozen_array(f"the intensity of {group!r}", amount, ())
    return amounts


class LiveMix:
    """A sequence of pictures of one transport, each of which computes what changed since the last.

    Each group's picture is kept, and a dial only adds them. While one light is dragged, the sum of the other groups is
    kept, and the picture is this sum plus one product. A quick picture computes both at half the size, once ``halve``
    was called for the light.
    """

    def __init__(self, transport: Transport) -> None:
        require_kind("the transport", transport, Transport, "relight.transport_file.read_transport(PATH)")
        self.transport = transport
        height, width = transport.coverage.shape
        count = len(transport.groups)
        # Pixels as Blender stores them, with an alpha of 0: a light is one product that writes them, and a mix is their
        # sum. Planes of red, green and blue would have to be interleaved for each picture.
        self._groups = np.zeros((count, height * width, 4), np.float32)
        self._matrices: list[NDArray[np.float64] | None] = [None] * count
        self._waiting: set[int] = set()
        """Groups whose picture is that of an earlier light."""
        self._new: set[int] = set()
        """Those that no mix has shown yet."""
        self._written: set[int] = set()
        """Groups with a picture."""
        self._out = np.empty((height, width, 4), np.float32)
        self._rest = np.empty_like(self._out)
        self._rest_of: tuple[int, bytes] | None = None
        """The group that ``_rest`` is without, and the weights of the others."""
        self._half: dict[int, Pixels] = {}
        """Channels (channels, height, width) of groups at half the size."""
        self._half_rest: Pixels | None = None
        """``_rest`` at half the size."""
        self._small = np.empty((0, 0, 4), np.float32)
        """The last picture of half the size."""
        self.is_coarse = False
        """True if the last picture has half the size."""
        self.worth_halving: int | None = None
        """Group whose light was dragged last, if its product took longer than QUICK_SECONDS at full size."""

    def set_light(self, group: str, light: Spectrum) -> None:
        """Give a group a new spectrum. Raises InvalidInputError on a ``dial`` transport."""
        require_kind(f"the light of {group!r}", light, Spectrum, "spectra.catalogue.illuminant(NAME)")
        # with Y = 1 for the brightness of the recording
        found = self.transport.storage.rgb_from_channels(relative_to_flat(unit_luminance(light)))
        self._set(self.transport.index_of(group), found)

    def _set(self, index: int, rgb_from_channels: NDArray[np.float64]) -> None:
        self._matrices[index] = rgb_from_channels
        self._waiting.add(index)
        self._new.add(index)

    def _complete(self, amounts: NDArray[np.float64]) -> None:
        """Lit groups without a new spectrum keep the spectrum of the scene."""
        storage = self.transport.storage
        for index, group in enumerate(self.transport.groups):
            if self._matrices[index] is not None or amounts[index] == 0:
                continue
            matrix = storage.rgb_as_recorded(self.transport.lights[index])
            if matrix is None:
                raise InvalidInputError(
                    f"the lights of group {group_text(group)} had different spectra in the scene, which "
                    f"{storage.kind!r} storage does not keep; name one spectrum for the group, record one group per "
                    "light, or Mixtures, which keep any lights"
                )
            self._set(index, matrix)

    def halved(self, index: int) -> Pixels:
        """Channels (channels, height / 2, width / 2) of a group, for ``halve``; takes time, and changes nothing."""
        return halved(self.transport.channels[index])

    def halve(self, index: int, channels: Pixels) -> None:
        """Let quick pictures show a group by these channels while its light is dragged."""
        self._half[index] = channels
        self.worth_halving = None

    def picture(self, weights: ArrayLike, *, quick: bool = False, signed: bool = False) -> Pixels:
        """(height, width, 4) of the groups mixed with ``weights`` (groups,). The next call overwrites it.

        ``quick``: while one light is dragged, at half the size, rounded up, if ``halve`` was called; ``is_coarse``
        reports it.
        ``signed``: weights below 0 remove light, as a lamp of negative power does; otherwise they are an error.
        """
        amounts = frozen_array("weights of the light groups", weights, (len(self.transport.groups),))
        if np.any(amounts < 0) and not signed:
            least = int(np.argmin(amounts))
            raise InvalidInputError(
                f"the intensity of the light group {group_text(self.transport.groups[least])} is {amounts[least]:g}; a "
                "light cannot absorb light, so take 0 or more"
            )
        self._complete(amounts)
        largest = float(np.max(np.abs(amounts), initial=0.0))
        brightest = largest * self.transport.exposure
        if brightest > BRIGHTEST:
            raise InvalidInputError(
                f"a light intensity of {largest:g} times the exposure of {self.transport.exposure:g} is more "
                f"than {BRIGHTEST:g}; take smaller intensities"
            )
        scaled = (amounts * self.transport.exposure).astype(np.float32)
        lit = [index for index in sorted(self._waiting) if amounts[index] != 0]
        # the first picture is the sum, so another reading of the recording gives the same picture to the last bit
        dragged = lit[0] if len(lit) == 1 and self._new == {lit[0]} and lit[0] in self._written else None
        for index in lit:
            if index != dragged:
                self._write(index)
        self._new.clear()
        self.is_coarse = False
        if dragged is None:
            self._sum(scaled, self._out)
            return self._out
        others = scaled.copy()
        others[dragged] = 0.0
        if self._rest_of != (dragged, others.tobytes()):
            self._sum(others, self._rest)
            self._rest_of, self._half_rest = (dragged, others.tobytes()), None
        if quick and dragged in self._half:
            return self._coarse(dragged, float(scaled[dragged]))
        start = time.perf_counter()
        np.copyto(self._out, self._rest)
        self._add_light(dragged, float(scaled[dragged]), self._out.reshape(-1, 4))
        is_slow = time.perf_counter() - start > QUICK_SECONDS
        self.worth_halving = dragged if is_slow and dragged not in self._half else None
        return self._out

    def _coarse(self, index: int, amount: float) -> Pixels:
        """The picture of a dragged light at half the size."""
        if self._half_rest is None:
            self._half_rest = np.ascontiguousarray(np.moveaxis(halved(np.moveaxis(self._rest, 2, 0)), 0, 2))
            self._small = np.empty_like(self._half_rest)
        np.copyto(self._small, self._half_rest)
        self._add_product(index, amount, self._half[index], self._small.reshape(-1, 4))
        self.is_coarse = True
        return self._small

    def _write(self, index: int) -> None:
        """Bring a group's own picture up to date."""
        self._groups[index] = 0.0
        self._add_light(index, 1.0, self._groups[index])
        self._waiting.discard(index)
        self._written.add(index)
        if self._rest_of is not None and self._rest_of[0] != index:
            self._rest_of = None

    def _add_light(self, index: int, amount: float, out: Pixels) -> None:
        """Add a group under its light to ``out`` (pixels, 4)."""
        self._add_product(index, amount, self.transport.channels[index], out)

    def _add_product(self, index: int, amount: float, channels: Pixels, out: Pixels) -> None:
        """Add ``channels`` (channels, height, width) of a group under its light to ``out`` (pixels, 4)."""
        rgb_from_channels = self._matrices[index]
        assert rgb_from_channels is not None
        matrix = np.zeros((4, len(channels)), np.float32, order="F")
        matrix[:3] = amount * rgb_from_channels
        _multiply_add(matrix, channels.reshape(len(channels), -1), out)

    def _sum(self, weights: Pixels, out: Pixels) -> None:
        """``out`` (height, width, 4) = the groups' pictures with ``weights``, and the coverage."""
        _add(weights, self._groups, out)
        out[..., 3] = self.transport.coverage


def halved(pixels: Pixels) -> Pixels:
    """Means of 2 × 2 pixels of ``pixels`` (..., height, width); a last odd row or column has means of what it has."""
    down = pixels[..., ::2, :].copy()
    down[..., : pixels.shape[-2] // 2, :] += pixels[..., 1::2, :]
    down[..., : pixels.shape[-2] // 2, :] *= np.float32(0.5)
    across = down[..., ::2].copy()
    across[..., : pixels.shape[-1] // 2] += down[..., 1::2]
    across[..., : pixels.shape[-1] // 2] *= np.float32(0.5)
    return across


# Both products are SciPy's, which brings an OpenBLAS of its own: the NumPy of a Blender may have the reference BLAS,
# which takes several times as long for a picture. BLAS works column by column: the transposes are views, and nothing is
# copied.


def _multiply_add(matrix: Pixels, channels: Pixels, out: Pixels) -> None:
    """Add the transpose of ``matrix`` (4, n) · ``channels`` (n, pixels) to ``out`` (pixels, 4)."""
    from scipy.linalg.blas import sgemm

    found = sgemm(1.0, matrix, channels.T, trans_b=1, beta=1.0, c=out.T, overwrite_c=1)
    if not np.may_share_memory(found, out):
        out[:] = found.T


def _add(weights: Pixels, groups: Pixels, out: Pixels) -> None:
    """``out`` (height, width, 4) = the sum of ``groups`` (groups, pixels, 4) with ``weights`` (groups,)."""
    from scipy.linalg.blas import sgemv

    out.fill(0.0)  # not by a factor of 0, which leaves a NaN of the last picture
    flat = out.reshape(-1)
    if not len(groups):
        return
    found = sgemv(1.0, groups.reshape(len(groups), -1).T, weights, beta=1.0, y=flat, overwrite_y=1)
    if not np.may_share_memory(found, flat):
        flat[:] = found
