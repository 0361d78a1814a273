# SPDX-License-Identifier: GPL-3.0-or-later
"""Elements of Mitsuba's XML format."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

Element = ElementTree.Element
VERSION = "3.0.0"


def plugin(tag: str, kind: str, *children: Element, name: str = "", identifier: str = "") -> Element:
    """An object of a plugin, such as ``<bsdf type="diffuse">``, with its parameters."""
    named = {"name": name} if name else {}
    made = Element(tag, {"type": kind, **({"id": identifier} if identifier else {}), **named})
    made.extend(children)
    return made


def scene(children: Iterable[Element]) -> Element:
    """The root of a file."""
    made = Element("scene", {"version": VERSION})
    made.extend(children)
    return made


def number(name: str, value: float) -> Element:
    """A number; every digit of a 32-bit float is kept."""
    return Element("float", {"name": name, "value": _digits(value)})


def integer(name: str, value: int) -> Element:
    """A whole number."""
    return Element("integer", {"name": name, "value": str(int(value))})


def boolean(name: str, value: bool) -> Element:
    """``true`` or ``false``."""
    return Element("boolean", {"name": name, "value": "true" if value else "false"})


def string(name: str, value: str) -> Element:
    """A text, or the path of a file relative to the XML file."""
    return Element("string", {"name": name, "value": value})


def rgb(name: str, value: NDArray[np.float64]) -> Element:
    """Linear sRGB (3,); spectral variants upsample it."""
    return Element("rgb", {"name": name, "value": ", ".join(map(_digits, value))})


def spectrum(name: str, path: str) -> Element:
    """A sampled spectrum in a file; RGB variants convert it."""
    return Element("spectrum", {"name": name, "filename": path})


def point(name: str, value: NDArray[np.float64]) -> Element:
    """A position (3,)."""
    return Element("point", {"name": name, "value": ", ".join(map(_digits, value))})


def vector(name: str, value: NDArray[np.float64]) -> Element:
    """A direction (3,)."""
    return Element("vector", {"name": name, "value": ", ".join(map(_digits, value))})


def transform(name: str, matrix: NDArray[np.float64]) -> Element:
    """A matrix (4, 4), or (3, 3) for coordinates of textures."""
    made = Element("transform", {"name": name})
    values = " ".join(map(_digits, np.asarray(matrix, dtype=np.float64).ravel()))
    made.append(Element("matrix", {"value": values}))
    return made


def reference(identifier: str, name: str = "") -> Element:
    """A reference to an object that is defined above."""
    return Element("ref", {"id": identifier, **({"name": name} if name else {})})


def text_of(root: Element) -> str:
    """The file's text, indented."""
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _digits(value: Any) -> str:
    return f"{float(value):.9g}"
