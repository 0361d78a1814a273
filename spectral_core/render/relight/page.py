# SPDX-License-Identifier: GPL-3.0-or-later
"""One self-contained web page with the dial over the picture: for showing a client, without a server."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from spectral_core.errors import InvalidInputError
from spectral_core.files.whole import write_text
from spectral_core.render.relight.dial import bulbs_on_polygon
from spectral_core.render.relight.mix import LiveMix
from spectral_core.render.relight.transport import Transport
from spectral_core.spectra.spectrum import Spectrum

MOST_BYTES = 200e6
"""A page larger than this opens slowly or not at all; record a smaller picture for it."""


def write_page(
    path: Path,
    transport: Transport,
    *,
    title: str = "Light dial",
    lights: Mapping[str, Spectrum] | None = None,
    bulbs: ArrayLike | None = None,
) -> None:
    """Write ``path``. ``lights``: spectra by group, as ``relight`` takes them; ``bulbs``: (groups, 2), else a polygon.

    Layers are 16-bit floats: eleven bits, finer than the 8 bits of a screen. Raises InvalidInputError for fewer than 2
    light groups or a page over 200 MB.
    """
    width, height = transport.size
    count = len(transport.groups)
    if count < 2:
        raise InvalidInputError(f"the transport has {count} light group; a dial needs at least 2")
    size = count * width * height * 3 * 2 * 4 / 3
    if size > MOST_BYTES:
        raise InvalidInputError(f"the page would take {size / 1e6:.0f} MB; record the transport at a smaller size")
    live = LiveMix(transport)
    for group, light in (lights or {}).items():
        live.set_light(group, light)
    layers = np.stack([live.picture(np.eye(count)[k])[..., :3].copy() for k in range(count)])
    overflown = int((layers > np.finfo(np.float16).max).sum())
    if overflown:
        raise InvalidInputError(f"{overflown} values are over 65504, more than the page can hold; lower the exposure")
    places = bulbs_on_polygon(count) if bulbs is None else np.asarray(bulbs, dtype=np.float64)
    document = {
        "width": width,
        "height": height,
        "groups": [group or "ungrouped" for group in transport.groups],
        "bulbs": places.tolist(),
        "selector": [0.0, 0.0],
        "half": base64.b64encode(layers.astype(np.float16).tobytes()).decode("ascii"),
    }
    template = resources.files("spectral_core.render.relight").joinpath("page.html").read_text("utf-8")
    text = json.dumps(document).replace("<", "\\u003c")  # a group named "</script>" must not end the script
    write_text(path, template.replace("@TITLE@", html.escape(title)).replace("@TRANSPORT@", text))
