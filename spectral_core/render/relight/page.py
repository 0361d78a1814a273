# SPDX-License-Identifier: GPL-3.0-or-later
"""A self-contained web page with the dial over the picture, which needs no server."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from spectral_core.errors import InvalidInputError, counted
from spectral_core.files.whole import write_text
from spectral_core.render.relight.dial import bulbs_on_polygon
from spectral_core.render.relight.mix import LiveMix, amounts_of, as_rendered
from spectral_core.render.relight.transport import Transport
from spectral_core.spectra.color import display_rgb_from_linear, linear_rgb_from_xyz
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import Spectrum

MOST_BYTES = 200e6
"""Largest size of a page; larger ones open slowly or not at all, so record a smaller picture for it."""


def write_page(
    path: str | Path,
    transport: Transport,
    *,
    title: str = "Light dial",
    lights: Mapping[str, Spectrum] | None = None,
    mix: Mapping[str, float] | None = None,
    bulbs: ArrayLike | None = None,
) -> None:
    """Write one HTML file. At the center of the dial it shows the scene as recorded, through its view transform.

    Layers are 16-bit floats: eleven bits, finer than the 8 bits of a screen.

    Parameters
    ----------
    path
        The .html file.
    transport
        The recording, with 2 to 64 light groups.
    title
        Heading and name of the page.
    lights, mix
        Spectra and intensities by group, as ``relight`` takes them; the dial starts from these.
    bulbs
        Positions (groups, 2) of the bulbs; a regular polygon if None.

    Raises
    ------
    InvalidInputError
        For fewer than 2 or more than 64 light groups, or a page over 200 MB.
    """
    width, height = transport.size
    count = len(transport.groups)
    if count < 2:
        raise InvalidInputError(f"the transport has {count} light group; a dial needs at least 2")
    places = bulbs_on_polygon(count) if bulbs is None else np.asarray(bulbs, dtype=np.float64)
    size = count * width * height * 3 * 2 * 4 / 3
    if size > MOST_BYTES:
        raise InvalidInputError(f"the page would take {size / 1e6:.0f} MB; record the transport at a smaller size")
    live = LiveMix(transport)
    for group, light in (lights or {}).items():
        live.set_light(group, light)
    amounts = amounts_of(transport, mix)
    layers = np.stack([as_rendered(transport, live.picture(row))[..., :3].copy() for row in np.diag(amounts)])
    if transport.view is not None:
        layers = transport.view.coordinates(layers)  # of a mixture, as its light, they are the sum
    overflown = int((~(np.abs(layers) <= np.finfo(np.float16).max)).sum())
    if overflown:
        raise InvalidInputError(
            f"{counted(overflown, 'value is', 'values are')} over 65504, below -65504 or no numbers, more than "
            "the page can hold; lower the exposure, or record again"
        )
    lamps = [(lights or {}).get(group, own) for group, own in zip(transport.groups, transport.lights, strict=True)]
    document = {
        "width": width,
        "height": height,
        "groups": [group or "ungrouped" for group in transport.groups],
        "colors": [_bulb_color(lamp) for lamp in lamps],
        "bulbs": places.tolist(),
        "selector": [0.0, 0.0],
        "view": None if transport.view is None else transport.view.document(),
        "half": base64.b64encode(layers.astype(np.float16).tobytes()).decode("ascii"),
    }
    template = resources.files("spectral_core.render.relight").joinpath("page.html").read_text("utf-8")
    text = json.dumps(document).replace("<", "\\u003c")  # a group named "</script>" must not end the script
    filled = {"@TITLE@": html.escape(title), "@TRANSPORT@": text}
    # in one pass: a title that equals a placeholder stays unchanged
    write_text(path, re.sub("@TITLE@|@TRANSPORT@", lambda found: filled[found[0]], template))


def _bulb_color(lamp: Spectrum | None) -> list[float]:
    """Display color of a lamp at the largest brightness of its hue; white if a group's lights differ."""
    if lamp is None:
        return [1.0, 1.0, 1.0]
    linear = np.maximum(linear_rgb_from_xyz(xyz_of(lamp)), 0.0)
    shown = display_rgb_from_linear(linear / max(float(linear.max()), 1e-30)) if linear.any() else np.ones(3)
    return [round(float(value), 4) for value in shown]
