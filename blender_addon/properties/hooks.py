# SPDX-License-Identifier: GPL-3.0-or-later
"""Callbacks of properties: declarations announce a change or request names, and ``editing`` responds while it listens.

Declarations therefore do not depend on spectra, solvers and devices.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum, auto
from typing import Any


class Topic(Enum):
    """Topics of announcements and requests of properties."""

    PALETTE = auto()
    PALETTE_LIVE = auto()
    PALETTE_PICTURE = auto()
    PALETTE_CELL_MODE = auto()
    PALETTE_NAME = auto()
    SPECTRUM_SOURCE = auto()
    SPECTRUM_CHOICE = auto()
    SPECTRUM_NAMES = auto()
    SPECTRUM_ENTRIES = auto()
    LAMP_NAMES = auto()
    SPECTRAL_TEXTURE = auto()
    DIAL = auto()
    BOARD = auto()
    BOARD_DEVICES = auto()
    VIEWPORT = auto()
    PREVIEW_LAMP = auto()


_listeners: dict[Topic, Callable[[Any], Any]] = {}
_silenced: dict[Topic, int] = {}


def listen(topic: Topic, listener: Callable[[Any], Any]) -> None:
    """Register ``listener`` for ``topic``; its argument is the property group that was changed or that requests
    names.
    """
    _listeners[topic] = listener


def ignore(*topics: Topic) -> None:
    """Remove the listeners of these topics."""
    for topic in topics:
        _listeners.pop(topic, None)


def announce(topic: Topic, properties: Any) -> None:
    """Notify the listener that ``properties`` have changed, unless the topic is silenced."""
    if not _silenced.get(topic) and topic in _listeners:
        _listeners[topic](properties)


@contextmanager
def silenced(topic: Topic) -> Iterator[None]:
    """Silence a topic: for code that sets many properties and responds once at its end."""
    _silenced[topic] = _silenced.get(topic, 0) + 1
    try:
        yield
    finally:
        _silenced[topic] -= 1


def announces(topic: Topic) -> Callable[[Any, Any], None]:
    """Update callback of a property."""

    def changed(properties: Any, _context: Any) -> None:
        announce(topic, properties)

    return changed


def offers(topic: Topic) -> Callable[[Any, Any, str], list[str]]:
    """Search callback of a text: the listener's names that contain the typed text."""

    def search(properties: Any, _context: Any, typed: str) -> list[str]:
        names = _listeners[topic](properties) if topic in _listeners else []
        return [name for name in names if typed.lower() in name.lower()]

    return search
