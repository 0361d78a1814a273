# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.spectral.board``: bindings of faders to numbers of the file, and the connections of the board."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .hooks import Topic, announces, offers

_changed = announces(Topic.BOARD)


class SpectralBoardBinding(bpy.types.PropertyGroup):
    """A fader and its number; ``name`` is the number's full data path."""

    control: StringProperty(
        name="Control", update=_changed, description="kind:channel:address, such as cc:0:81 or osc:0:/fader/1"
    )
    block: PointerProperty(type=bpy.types.ID, description="Data-block of the number, which may be renamed")
    low: FloatProperty(name="Low", default=0.0, update=_changed, description="Value of the number with the fader down")
    high: FloatProperty(name="High", default=1.0, update=_changed, description="Value of the number with the fader up")
    pick_up: BoolProperty(
        name="Pick Up", update=_changed,
        description="The fader does nothing until it has passed the present value, so that the value does not jump",
    )  # fmt: skip


class SpectralBoardOrder(bpy.types.PropertyGroup):
    """Two numbers, the upper at or above the lower, by their full data paths."""

    lower: StringProperty(name="Lower", update=_changed)
    upper: StringProperty(name="Upper", update=_changed)


class SpectralMixingBoard(bpy.types.PropertyGroup):
    """Connection, bindings, and the recorded motion."""

    use_midi: BoolProperty(name="MIDI", default=True, description="Listen to a MIDI device")
    midi_port: StringProperty(
        name="Device", search=offers(Topic.BOARD_DEVICES), description="Name of the MIDI device; empty for the first"
    )
    use_osc: BoolProperty(name="OSC", default=True, description="Listen to tablets and programs on the network")
    osc_host: StringProperty(
        name="Address", default="127.0.0.1", description="127.0.0.1 for this machine alone, 0.0.0.0 for its networks"
    )
    osc_port: IntProperty(name="Port", default=9000, min=0, max=65535, description="UDP port; 0 for any free one")
    feedback_host: StringProperty(name="Send To", description="Address to which positions are sent; empty for none")
    feedback_port: IntProperty(name="Port", default=9001, min=1, max=65535, description="UDP port of that address")
    bindings: CollectionProperty(type=SpectralBoardBinding)
    active: IntProperty(name="Binding", min=0)
    orders: CollectionProperty(type=SpectralBoardOrder)
    status: StringProperty(options={"SKIP_SAVE"})
    simultaneity: StringProperty(description="Correlation of the faders' velocities in the last recording, Eq. 6.2")


CLASSES = (SpectralBoardBinding, SpectralBoardOrder, SpectralMixingBoard)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
