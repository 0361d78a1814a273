# SPDX-License-Identifier: GPL-3.0-or-later
"""The board while it runs: links to devices, a timer that changes numbers, motors, a recording of the motion."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import bpy
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import InvalidInputError, SpectralError

from ...properties import hooks
from ...properties.hooks import Topic
from ..deferred import RENDER_SECONDS, open_scene
from . import followed
from .followed import follow_names, is_unused

if TYPE_CHECKING:
    from spectral_core.explore.board import Board, Change

TICK_SECONDS = 1 / 60


@dataclass
class Session:
    """A started board. ``links``: MIDI and OSC; ``events``: (seconds, target, position) of every move so far."""

    scene: int
    """``session_uid``, which does not change when the scene is renamed."""
    board: Any
    links: list[Any] = field(default_factory=list)
    events: list[tuple[float, str, float]] = field(default_factory=list)
    started: float = field(default_factory=time.monotonic)
    told: str = ""
    """What the panel reports about the devices."""

    @property
    def osc_port(self) -> int | None:
        """Port of the OSC server, None without one."""
        return next((link.port for link in self.links if hasattr(link, "port")), None)


_session: Session | None = None


def session() -> Session | None:
    """The running board, None without one."""
    return _session


def read(target: str) -> float | None:
    """Present value of a target; None if it was deleted, which the rows of its binding and orders report."""
    from .paths import block_at, number_at

    try:
        return None if is_unused(block_at(target)[0]) else number_at(target).read()
    except InvalidInputError:
        return None


def start(scene: Scene) -> tuple[Session, list[str]]:
    """Open the connected devices and start. Return the running board, and a sentence per device that failed.

    It is no error if no device is connected.
    """
    from spectral_core.explore.board import Board

    stop()
    global _session
    links: list[Any] = []
    missing = []
    settings = scene.spectral.board
    board = Board(read, lambda control: any(link.has_motor(control) for link in links))
    for wanted, opened in ((settings.use_midi, _midi), (settings.use_osc, _osc)):
        if wanted:
            try:
                links.append(opened(settings, board))
            except (SpectralError, OSError) as error:
                missing.append(str(error))
    _session = Session(scene.session_uid, board, links)
    rebind(scene)
    if not bpy.app.background:
        bpy.app.timers.register(tick, first_interval=TICK_SECONDS)
    return _session, missing


def _midi(settings: PropertyGroup, board: Board) -> Any:
    from spectral_core.explore.board.midi import MidiLink

    return MidiLink(board.receive, name=settings.midi_port or None)


def _osc(settings: PropertyGroup, board: Board) -> Any:
    from spectral_core.explore.board.osc import OscLink

    feedback = (settings.feedback_host, settings.feedback_port) if settings.feedback_host else None
    return OscLink(board.receive, host=settings.osc_host, port=settings.osc_port, feedback=feedback)


def rebind(scene: Scene) -> None:
    """Update the running board to the bindings of the scene."""
    from spectral_core.explore.board import Binding, Control

    if _session is None or not isinstance(scene, bpy.types.Scene) or scene.session_uid != _session.scene:
        return
    settings, board = scene.spectral.board, _session.board
    follow_names(settings)
    wanted = []
    try:
        for entry in settings.bindings:
            if entry.control:
                control = Control.parse(entry.control)
                wanted.append(Binding(control, entry.name, entry.low, entry.high, entry.pick_up))
        for old in board.bindings:
            if old not in wanted:
                board.unbind(old.control)
        for new in wanted:
            if new not in board.bindings:
                board.bind(new)
        board.set_orders((order.lower, order.upper) for order in settings.orders if order.lower and order.upper)
        settings.status = ""
    except SpectralError as error:
        settings.status = str(error)


def tick() -> float | None:
    """Apply the moves since the last call. Blender calls this by a timer; a script may call it too."""
    if _session is None:
        return None
    scene = open_scene(_session.scene)
    if scene is None:
        stop()
        return None
    if bpy.app.is_job_running("RENDER"):
        return RENDER_SECONDS
    for link in _session.links:
        if hasattr(link, "pump"):
            link.pump()
    if follow_names(scene.spectral.board):
        rebind(scene)
    learning = _session.board.learning
    changes = _session.board.poll(range_of)
    if learning is not None and _session.board.learning is None:
        if _session.board.not_learned:
            scene.spectral.board.status = _session.board.not_learned
        else:
            _store_learned(scene, learning)
    for change in changes:
        _write(scene, change)
    for control, position in _session.board.motors(time.monotonic()):
        if False in [link.send(control, position) for link in _session.links]:
            _session.board.send_again(control)
    _tell(scene, _session)
    return TICK_SECONDS


def _tell(scene: Scene, session: Session) -> None:
    """Report in the panel what devices cannot do now, until they can."""
    board = scene.spectral.board
    gone = [link.missing for link in session.links if getattr(link, "missing", None)]
    texts = [f"{device} is unplugged; it is used again once it is connected" for device in gone]
    texts += [link.unsent for link in session.links if getattr(link, "unsent", "")]
    texts += [
        f"{control} sends {position:g}; a fader sends 0 to 1, so set its range there"
        for control, position in session.board.beyond.items()
    ]
    text = "; ".join(texts)
    if (text or board.status == session.told) and board.status != text:
        board.status = text
    session.told = text


def range_of(target: str) -> tuple[float, float]:
    """Range of a target that is being learned."""
    from .paths import number_at

    return number_at(target).range()


def _store_learned(scene: Scene, target: str) -> None:
    assert _session is not None
    learned = next(binding for binding in reversed(_session.board.bindings) if binding.target == target)
    settings, moved = scene.spectral.board, ""
    for number in reversed(range(len(settings.bindings))):
        earlier = settings.bindings[number].name
        if settings.bindings[number].control == str(learned.control) and earlier != target:
            settings.bindings.remove(number)
            moved = f"{learned.control} was bound to {earlier}, and is bound to {target} now"
    entry = settings.bindings.get(target) or settings.bindings.add()
    entry.name, entry.low, entry.high = target, learned.low, learned.high
    entry.block = None  # found again by its path
    entry.control = str(learned.control)
    settings.status = moved or settings.status


def _write(scene: Scene, change: Change) -> None:
    from .paths import number_at

    assert _session is not None
    try:
        number_at(change.target).write(change.value)
    except InvalidInputError as error:
        scene.spectral.board.status = str(error)
        return
    binding = next((each for each in _session.board.bindings if each.target == change.target), None)
    if binding is not None:
        _session.events.append((change.time, change.target, binding.position(change.value)))


def recording() -> Any:
    """Motion since the board was started. Raises InvalidInputError if nothing has moved."""
    from spectral_core.explore.board.recording import MOVING_SECONDS, Recording

    if _session is None or not _session.events:
        raise InvalidInputError("no fader has moved since the board was started")
    targets = tuple(dict.fromkeys(target for _, target, _ in _session.events))
    first = _session.events[0][0] - MOVING_SECONDS  # the path begins before its first update
    rows = [(seconds - first, targets.index(target), position) for seconds, target, position in _session.events]
    # where a fader was before its first update is not known: the number may jump to it
    begin = [next(at for _, target, at in _session.events if target == each) for each in targets]
    return Recording.from_events(rows, targets, begin)


def stop() -> None:
    """Close every device."""
    global _session
    if _session is not None:
        for link in _session.links:
            link.close()
    _session = None
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)


@bpy.app.handlers.persistent
def _before_load(*_: object) -> None:
    stop()


@bpy.app.handlers.persistent
def _after_undo(*_: object) -> None:
    """Bindings that an undo or redo has brought back or removed, which announces nothing."""
    scene = None if _session is None else open_scene(_session.scene)
    if scene is not None:
        rebind(scene)


def _devices(_board: bpy.types.PropertyGroup) -> list[str]:
    """Names of the connected MIDI devices."""
    from spectral_core.explore.board.midi import port_names

    try:
        return port_names()
    except SpectralError:
        return []  # without mido; Start reports it


def register() -> None:
    """Start listening to the bindings and to undo, and close devices when another file is opened."""
    hooks.listen(Topic.BOARD, lambda properties: rebind(properties.id_data))
    hooks.listen(Topic.BOARD_DEVICES, _devices)
    followed.register()
    bpy.app.handlers.load_pre.append(_before_load)
    for handlers in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        handlers.append(_after_undo)


def unregister() -> None:
    """Close the devices."""
    hooks.ignore(Topic.BOARD, Topic.BOARD_DEVICES)
    followed.unregister()
    bpy.app.handlers.load_pre.remove(_before_load)
    for handlers in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        handlers.remove(_after_undo)
    stop()
