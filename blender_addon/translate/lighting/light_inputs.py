# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes made for light: falloff with distance, measured luminaires."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, counted
from spectral_core.files.guarded import read_bytes
from spectral_core.scene import Photometry
from spectral_core.spectra.luminaire import every_degree, read_ies

from .. import spectra
from ..questions import ContentOfText, StateOfFile
from ..shading.fields import color_of_spectrum
from ..shading.nodes.textures import place_of
from ..shading.reader import Reader, evaluator
from ..shading.tree import Output, linked

FALLOFF_POWERS = {"Quadratic": 0, "Linear": 1, "Constant": 2}
"""Powers of the distance that a Light Falloff node multiplies the strength by."""
MOST_BYTES = 4 << 20
"""Largest file of a luminaire."""
BROKEN = 100.0
"""Strength of a luminaire without a table, in Cycles."""


@evaluator("LIGHT_FALLOFF")
def _falloff(reader: Reader, output: Output) -> Any:
    strength = reader.read(output, "Strength", 1.0)
    if reader.is_far:
        return strength  # the node has no effect on what is infinitely far, as in Cycles
    length, smooth = reader.point("ray:Ray Length", 1), reader.read(output, "Smooth", 0.0)
    squared = _times(reader, length, length)
    power = FALLOFF_POWERS.get(output.socket.name, 0)
    if power:
        strength = _times(reader, strength, length if power == 1 else squared)
    softened = reader.emit("math", squared, smooth, 0.0, settings=("ADD",))
    share = reader.emit("math", squared, softened, 0.0, settings=("DIVIDE",))
    is_soft = reader.emit("math", smooth, 0.0, 0.0, settings=("GREATER_THAN",))
    return _times(reader, strength, reader.emit("mix_number", is_soft, 1.0, share))


def _times(reader: Reader, first: Any, second: Any) -> Any:
    return reader.emit("math", first, second, 0.0, settings=("MULTIPLY",))


@evaluator("TEX_IES")
def _luminaire(reader: Reader, output: Output) -> Any:
    strength, table = reader.read(output, "Strength", 1.0), luminaire_of(reader, output.node)
    if table is None:
        return _times(reader, strength, BROKEN)
    if linked(output.input("Vector")) is None:
        direction = reader.emit("transformed", reader.point("incoming"), settings=("NORMAL", "WORLD", "OBJECT"))
    else:
        direction = place_of(reader, output, "incoming")
    degrees = every_degree(table.vertical_rad, table.horizontal_rad, table.strength)
    rows = np.broadcast_to(degrees, (361, 181)).astype(np.float32).reshape(-1, 1)
    return _times(reader, strength, reader.emit("luminaire", direction, data=rows))


def luminaire_of(reader: Reader, node: Any) -> Photometry | None:
    """The table of an IES node, read from its text or file; None, with a note, if it cannot be read."""
    import bpy

    if node.mode == "INTERNAL":
        if node.ies is not None:
            reader.translation.ask(ContentOfText(node.ies.session_uid))
        text = node.ies.as_string() if node.ies is not None else ""
    else:
        path = bpy.path.abspath(node.filepath, library=node.id_data.library)
        reader.translation.ask(StateOfFile(path))
        try:
            text = read_bytes(path, MOST_BYTES).decode("latin-1")
        except FileFormatError as error:
            reader.note(f"the file of {node.name!r} cannot be read ({error}); it is even and {BROKEN:g} strong")
            return None
    try:
        table = Photometry(*read_ies(text))
    except InvalidInputError as error:
        reader.note(f"{node.name!r}: {error}; it is even and {BROKEN:g} strong")
        return None
    negative = table.strength < 0
    if negative.any():
        reader.note(
            f"{node.name!r} has {counted(negative.sum(), 'negative candela')} of {negative.size}; there it is dark"
        )
    return table


def color_of_own_spectrum(reader: Reader, source: Output) -> NDArray[np.float64] | None:
    """Color (3,) of the spectrum that an emission carries, with a note, where lights are computed as colors. None if it
    carries none.
    """
    spectrum = spectra.spectrum_of(reader.translation, source.node)
    if spectrum is None:
        return None
    reader.note("its nodes mix a spectrum with other light, or let it vary; the color of the spectrum was used")
    return np.asarray(spectra.strength_of(reader.translation, source.node) * color_of_spectrum(spectrum))
