# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as F12 translates it, which the viewport may not show: a render that stops after its translation."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any, NoReturn

import bpy
from bpy.types import Context

from spectral_core.errors import InvalidInputError, RenderCancelled

from ... import jobs

if TYPE_CHECKING:
    from spectral_core.scene import Scene as SpectralScene

NO_RENDER = "Blender did not start the render; is there a camera?"
RENDERS = "Blender renders at present; wait for the end of that render, or stop it, and press the button again"


class AsRendered:
    """Translation of a scene by a render: at once, or in Blender's render job, so that the interface goes on.

    Between its start and ``take`` the scene's engine is SPECTRAL. Raises InvalidInputError if no render can start.
    """

    def __init__(self, context: Context, *, at_once: bool) -> None:
        self._scenes: list[SpectralScene] = []
        self._failed = len(jobs.failures())
        self._until_taken = ExitStack()
        self._until_taken.callback(_set_engine, context.scene.render, context.scene.render.engine)
        self._until_taken.enter_context(jobs.request(jobs.RenderRequest(translated=self._catch)))
        context.scene.render.engine = "SPECTRAL"
        try:
            if at_once:
                bpy.ops.render.render(scene=context.scene.name)
            else:
                _start_job(context.scene.name)
        except RuntimeError as error:
            self._until_taken.close()
            raise InvalidInputError(str(error).strip().removeprefix("Error: ")) from error
        except InvalidInputError:
            self._until_taken.close()
            raise

    def _catch(self, scene: SpectralScene) -> NoReturn:
        self._scenes.append(scene)
        raise RenderCancelled("only the scene was requested")

    @property
    def is_running(self) -> bool:
        """True until the job has ended."""
        return bool(bpy.app.is_job_running("RENDER"))

    def leave(self) -> None:
        """End without a scene."""
        self._until_taken.close()

    def take(self) -> SpectralScene:
        """The scene; call it once. Raises InvalidInputError if the render failed before its translation."""
        self.leave()
        if self._scenes:
            return self._scenes[0]
        failed = jobs.failures()[self._failed :]
        raise InvalidInputError(failed[-1].message if failed else NO_RENDER)


def _set_engine(render: Any, engine: str) -> None:
    with suppress(ReferenceError):  # the scene was deleted
        render.engine = engine


def _start_job(name: str) -> None:
    """Start Blender's render job without a window for its picture, which stays empty."""
    view = bpy.context.preferences.view
    chosen, view.render_display_type = view.render_display_type, "NONE"
    try:
        if "RUNNING_MODAL" not in bpy.ops.render.render("INVOKE_DEFAULT", scene=name):
            raise InvalidInputError(RENDERS)
    finally:
        view.render_display_type = chosen
