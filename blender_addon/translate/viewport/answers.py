# SPDX-License-Identifier: GPL-3.0-or-later
"""The answers with which kept parts were made: a part is dropped when one of its questions has another answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from ..context import Translation
from .kept import Kept, kept_or_made

Value = TypeVar("Value")


def kept_or_asked(
    kept: Kept | None,
    translation: Translation,
    key: tuple[str, Any],
    makers: frozenset[int],
    state: Any,
    make: Callable[[], Value],
) -> Value:
    """``kept_or_made`` of a part that may ask questions (``Translation.ask``)."""
    if kept is None:
        return make()

    def asking() -> Value:
        with translation.listening() as heard:
            value = make()
        kept.answers.pop(key, None)
        if heard.answers:
            kept.answers[key] = heard.answers
        return value

    return kept_or_made(kept, translation, key, makers, state, asking)


def forget_outdated(kept: Kept, translation: Translation) -> None:
    """Drop the parts of which a question has another answer now. Call it once before a translation."""
    held = kept.answers
    for key, answers in list(held.items()):
        if key not in kept.parts:
            del held[key]
        elif any(translation.answer(question) != answer for question, answer in answers.items()):
            del held[key], kept.parts[key]
            kept.walk = kept.begun = None
