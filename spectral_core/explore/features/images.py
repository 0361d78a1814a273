# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of a picture, and of a picture against a reference. Pictures are linear sRGB (height, width, 3)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, MissingDependencyError
from spectral_core.spectra.color import (
    XYZ_FROM_RGB,
    delta_e_2000,
    display_rgb_from_linear,
    lab_from_linear_rgb,
)

Picture = NDArray[Any]
_LAPLACIAN = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]])


def image_features(picture: Picture, prefix: str = "") -> dict[str, float]:
    """Mean linear color, CIELAB of that mean, contrast, brightest luminance and noise of one picture.

    ``contrast``: standard deviation of luminance over its mean. ``noise``: standard deviation of the luminance noise
    by the method of Immerkær 1996, which takes a picture's finest texture for noise too.
    """
    rgb = _checked(picture)
    mean = rgb.reshape(-1, 3).mean(axis=0)
    lightness, a, b = (float(value) for value in lab_from_linear_rgb(mean))
    luminance = rgb @ XYZ_FROM_RGB[1]
    average = float(luminance.mean())
    features = {
        "mean_red": float(mean[0]),
        "mean_green": float(mean[1]),
        "mean_blue": float(mean[2]),
        "lab_lightness": lightness,
        "lab_a": a,
        "lab_b": b,
        "contrast": float(luminance.std() / average) if average > 0 else 0.0,
        "luminance_p99": float(np.quantile(luminance, 0.99)),
        "noise": noise_level(luminance),
    }
    return {prefix + name: value for name, value in features.items()}


def noise_level(luminance: NDArray[Any]) -> float:
    """Standard deviation of noise in a picture (height, width), from its second differences (Immerkær 1996)."""
    height, width = luminance.shape
    if min(height, width) < 3:
        return 0.0
    response = sum(
        _LAPLACIAN[i, j] * luminance[i : height - 2 + i, j : width - 2 + j] for i in range(3) for j in range(3)
    )
    return float(math.sqrt(math.pi / 2) / 6 * np.abs(response).mean())


def difference_features(picture: Picture, reference: Picture, prefix: str = "") -> dict[str, float]:
    """Differences of a picture from a reference of the same size.

    ``rmse`` over linear RGB; ``snr_db``: power of the reference over that of the difference; ``delta_e_mean`` and
    ``delta_e_p95``: CIEDE2000 per pixel; ``flip``: mean of FLIP (Andersson et al. 2020) by its authors' library, where
    that is installed.
    """
    one, other = _checked(picture), _checked(reference)
    if one.shape != other.shape:
        raise InvalidInputError(
            f"the pictures have shapes {one.shape} and {other.shape}; a comparison needs equal ones"
        )
    error = float(np.mean((one - other) ** 2))
    power = float(np.mean(other**2))
    difference = delta_e_map(one, other)
    features = {
        "rmse": math.sqrt(error),
        "snr_db": _decibels(power, error),
        "delta_e_mean": float(difference.mean()),
        "delta_e_p95": float(np.quantile(difference, 0.95)),
    }
    if has_flip():
        features["flip"] = flip(one, other)
    return {prefix + name: value for name, value in features.items()}


def _decibels(power: float, error: float) -> float:
    """Ratio in dB: infinite without an error, minus infinity of a black reference."""
    if error == 0:
        return math.inf
    return 10 * math.log10(power / error) if power > 0 else -math.inf


def delta_e_map(picture: Picture, reference: Picture) -> NDArray[np.float64]:
    """CIEDE2000 of each pixel, (height, width), colors clipped to the gamut of a display."""
    shown = [np.clip(_checked(each), 0.0, 1.0) for each in (picture, reference)]
    return delta_e_2000(lab_from_linear_rgb(shown[0]), lab_from_linear_rgb(shown[1]))


def has_flip() -> bool:
    """True if FLIP's library is installed."""
    from importlib.util import find_spec

    return find_spec("flip_evaluator") is not None


def flip(picture: Picture, reference: Picture) -> float:
    """Mean LDR-FLIP at 67 pixels per degree, by the library of its authors. MissingDependencyError without it."""
    try:
        import flip_evaluator
    except ImportError as error:
        raise MissingDependencyError.package("flip-evaluator", "FLIP", "explore") from error
    shown = [
        np.ascontiguousarray(np.clip(display_rgb_from_linear(each), 0.0, 1.0), np.float32)
        for each in (reference, picture)
    ]
    _, mean, _ = flip_evaluator.evaluate(*shown, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True)
    return float(mean)


def _checked(picture: Picture) -> NDArray[np.float64]:
    array = np.asarray(picture, np.float64)
    if array.ndim != 3 or array.shape[2] < 3 or not array.size:
        raise InvalidInputError(f"a picture has shape {array.shape}; expected (height, width, 3)")
    if not np.isfinite(array).all():
        raise InvalidInputError("the picture holds values that are not finite")
    return array[..., :3]
