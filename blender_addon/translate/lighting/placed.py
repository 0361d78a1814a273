# SPDX-License-Identifier: GPL-3.0-or-later
"""The lamps of a scene: each object that Blender lists, or one that was edited."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from spectral_core.scene import Light

from ..viewport.answers import kept_or_asked
from ..viewport.owners import muted_links_of
from ..viewport.walk import facts_of, single
from .lights import lamp_seen_as, translate_light

if TYPE_CHECKING:
    from ..objects import Collected


def place_light(found: Collected, obj: Any, instance: Any) -> None:
    """Add a lamp to the ``found`` objects, unless it emits nothing."""
    light = _light(found, found.unique("light", obj.name_full), obj, instance)
    if light is not None:
        original = obj.original
        found.trace.lights[original.session_uid] = len(found.lights)
        found.trace.lamps[original.data.session_uid] = original.session_uid
        found.lights.append(light)
        found.linking.add(light.name, original)


def relit(found: Collected, obj: Any) -> Light | None:
    """The light of a lamp that was edited."""
    return _light(found, obj.name_full, obj, single(obj))


def _light(found: Collected, name: str, obj: Any, instance: Any) -> Light | None:
    original, make = obj.original, partial(translate_light, found.translation, name, obj, instance)
    if instance.is_instance:
        return make()
    makers = frozenset((original.session_uid, original.data.session_uid))
    seen = tuple(lamp_seen_as(found.translation, instance).values())
    state = (
        name,
        facts_of(obj, obj),
        seen,
        muted_links_of(original.data),
        tuple(map(tuple, instance.matrix_world)),
    )
    return kept_or_asked(found.kept, found.translation, ("light", original.session_uid), makers, state, make)
