# SPDX-License-Identifier: GPL-3.0-or-later
"""The medium below a surface: extinction and albedo per channel, from the visible color and the radius (Cycles)."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.subsurface import NO_RADIUS

LEAST_ALBEDO = 0.2
"""Least albedo of a walk; for darker media the result is dimmed."""
MOST_ALBEDO = 0.999999
SCALE = 0.25 / 3.14159265358979
"""Mean free path over Blender's radius, so that the walk resembles Blender's older models."""
PEAKS_NM = (610.0, 550.0, 465.0)
"""Wavelengths of the radii of red, green and blue; in between, the radii are interpolated."""
BISECTIONS = 12
"""Halvings by which the skin's albedo is found, as many as in Cycles."""

# Fit of the single-scattering albedo to the visible color of a half space into which light is refracted, for a phase
# function of Henyey and Greenstein: polynomials in its anisotropy, lowest power first (Cycles' fit, after Wrenninge,
# Villemin and Hery 2017, "Path traced subsurface scattering using anisotropic phase functions").
DARK_SCALE = (1.8260523782, -1.28451056436, -1.79904629312, 9.19393289202,
              -22.8215585862, 32.0234874259, -23.6264803333, 7.21067002658)  # fmt: skip
DARK_SLOPE = (4.98511194385, 0.127355959438, (0.0, 31.1491581433, -201.847017512, 841.576016723, -2018.09288505,
              2731.71560286, -1935.41424244, 559.009054474))  # fmt: skip
DARK_POWER = (1.09686102424, -0.394704063468, 1.05258115941, -8.83963712726,
              28.8643230661, -46.8802913581, 38.5402837518, -12.7181042538)  # fmt: skip
BRIGHT_SCALE = (0.496310210422, 0.360146581622, -2.15139309747, 17.8896899217,
                -55.2984010333, 82.065982243, -58.5106008578, 15.8478295021)  # fmt: skip
BRIGHT_SLOPE = (4.23190299701, 0.00310603949088, (0.0, 76.7316253952, -594.356773233, 2448.8834203, -5576.68528998,
                7116.60171912, -4763.54467887, 1303.5318055))  # fmt: skip
BRIGHT_POWER = (2.40602999408, -2.51814844609, 9.18494908356, -79.2191708682,
                259.082868209, -403.613804597, 302.85712436, -87.4370473567)  # fmt: skip


def per_wavelength(mi: Any, dr: Any, rgb: Any, wavelengths: Any) -> Any:
    """Three radii as one per channel of the transport."""
    if not mi.is_spectral:
        return mi.Color3f(rgb)
    red, green, blue = PEAKS_NM
    to_red = dr.clip((wavelengths - green) / (red - green), 0.0, 1.0)
    to_blue = dr.clip((green - wavelengths) / (green - blue), 0.0, 1.0)
    return rgb.y + (rgb.x - rgb.y) * to_red + (rgb.z - rgb.y) * to_blue


def medium_of(dr: Any, entry: Any, seen: Any, radius: Any) -> tuple[Any, Any, Any]:
    """Extinction and albedo per channel, and the factor of media darker than ``LEAST_ALBEDO``."""
    albedo = dr.clip(scattering_albedo(dr, seen, entry.anisotropy), 0.0, MOST_ALBEDO)
    free_path = radius * dr.select(entry.is_skin, skin_scale(dr, seen, entry.ior), SCALE)
    extinction = dr.rcp(dr.maximum(free_path, NO_RADIUS) * (1.0 - entry.anisotropy))
    # Walks in dark media end almost at once, and their color would be noise: a brighter walk is dimmed instead.
    return extinction, dr.maximum(albedo, LEAST_ALBEDO), dr.minimum(albedo / LEAST_ALBEDO, 1.0)


def scattering_albedo(dr: Any, seen: Any, g: Any) -> Any:
    """Single-scattering albedo of a medium that shows the color ``seen``; ``g``: its anisotropy, 0 to 0.9."""

    def polynomial(coefficients: Any) -> Any:
        result = 0.0 * g
        for coefficient in reversed(coefficients):
            result = result * g + coefficient
        return result

    def part(scale: Any, slope: Any, power: Any) -> Any:
        steep = slope[0] + slope[1] * dr.exp(polynomial(slope[2]))
        return polynomial(scale) * dr.maximum(dr.atan(steep * seen), 1e-12) ** polynomial(power)

    bright = dr.safe_sqrt(dr.safe_sqrt(seen))
    dark = part(DARK_SCALE, DARK_SLOPE, DARK_POWER)
    return dark + bright * (part(BRIGHT_SCALE, BRIGHT_SLOPE, BRIGHT_POWER) - dark)


def skin_scale(dr: Any, seen: Any, ior: Any) -> Any:
    """Mean free path over Blender's radius of Random Walk (Skin): √(3 (1 - α')) with the reduced albedo α' that a
    dipole of the color ``seen`` has (Jensen et al. 2001, "A practical model for subsurface light transport", Eq. 15).
    """
    inverse = dr.rcp(ior)
    diffuse_fresnel = inverse * (-1.440 * inverse + 0.710) + 0.668 + 0.0636 * ior
    extrapolated = 4.0 / 3.0 * (1.0 + diffuse_fresnel) / (1.0 - diffuse_fresnel)
    low, high = 0.0 * seen, 0.0 * seen + 1.0
    middle = low
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        root = dr.safe_sqrt(3.0 * (1.0 - middle))
        shown = 0.5 * middle * (1.0 + dr.exp(-extrapolated * root)) * dr.exp(-root)
        low, high = dr.select(shown < seen, middle, low), dr.select(shown < seen, high, middle)
    middle = dr.select(seen < 1e-4, 0.0, dr.select(seen >= 0.995, MOST_ALBEDO, middle))
    return dr.safe_sqrt(3.0 * (1.0 - middle))
