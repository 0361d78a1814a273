# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine ``SPECTRAL``: Blender requests a picture, a separate process renders it."""

from __future__ import annotations

import traceback
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import RenderCancelled, SpectralError, counted
from spectral_core.render import Progress, RenderResult
from spectral_core.scene import Note, Scene, has_holes

from . import jobs
from .drawing.clock import clock
from .properties.render import ENGINE
from .translate.camera import axes_of
from .translate.camera.motion import with_motion
from .translate.passes import cryptomatte_header, fill_passes, pass_notes, passes_of, rendered_passes, slots_of
from .translate.scene import translate_scene
from .translate.viewport.look import exposure_of_display, look_of, notes_of, preview_scene
from .viewport import Viewport, shown_from_rgb, working_from_rgb

SHOWN_NOTES = 5
"""Notes shown in the window; the record and the console contain all of them."""


@dataclass(frozen=True)
class _Place:
    """Target of pixels, with Blender's conversion. ``working_from_rgb``: (3, 3), None if nothing changes."""

    layer: str
    view: str
    working_from_rgb: NDArray[np.float64] | None
    transparent: bool
    header: dict[str, str] = field(default_factory=dict)


class SpectralRenderEngine(bpy.types.RenderEngine):
    """Spectral path tracing. No ``__init__``: its arguments differ between Blender versions."""

    bl_idname = ENGINE
    bl_label = "Spectral"
    bl_use_preview = True
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    viewport: Viewport | None = None
    """The part of the engine that draws a 3D view."""

    has_result = False
    """True if any picture was shown; it stays after a later failure."""

    def view_update(self, context: Any, depsgraph: Any) -> None:
        """Called after edits, on the main thread."""
        self.viewport = self.viewport or Viewport(self)
        self.viewport.update(self, context, depsgraph)

    def view_draw(self, context: Any, depsgraph: Any) -> None:
        """Called whenever a 3D view in Rendered mode is drawn."""
        self.viewport = self.viewport or Viewport(self)
        self.viewport.draw(self, context, depsgraph)

    def render(self, depsgraph: Any) -> None:
        """Called once per view layer, on a thread of Blender's: nothing here may write to the file's data.

        Blender ignores an exception here and reports the render as finished, so every exception becomes an error of the
        render and an entry of ``jobs.records``.
        """
        with jobs.under_way():
            if self.is_preview:
                self._render_preview(depsgraph)
            else:
                self._render_layer(depsgraph)

    def _render_layer(self, depsgraph: Any) -> None:
        """Render a view layer of a frame, and record the outcome."""
        frame, layer = depsgraph.scene_eval.frame_current, depsgraph.view_layer_eval.name
        try:
            result = self._render(depsgraph)
            jobs.record(
                jobs.RenderRecord(frame, layer, result.status, "", result.notes, result.samples, result.seconds, result)
            )
            self._tell(result)
        except RenderCancelled as stopped:
            if jobs.is_ending():
                self._fail(frame, layer, "the extension was disabled during the render")  # ends an animation, too
                return
            self._write_nothing(layer)
            jobs.record(jobs.RenderRecord(frame, layer, "cancelled", str(stopped)))
        except KeyboardInterrupt:
            self._write_nothing(layer)
            jobs.record(jobs.RenderRecord(frame, layer, "cancelled", "stopped from the keyboard"))
        except SpectralError as error:
            self._fail(frame, layer, str(error))
        except Exception as error:
            traceback.print_exc()
            self._fail(frame, layer, f"the render failed unexpectedly ({type(error).__name__}: {error})")

    def update_render_passes(self, scene: Any = None, renderlayer: Any = None) -> None:
        """Blender requests the list of passes: for the compositor's sockets, and to allocate them."""
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        wanted = passes_of(scene, renderlayer)
        for slot in [] if wanted is None else slots_of(wanted):
            self.register_pass(scene, renderlayer, slot.name, len(slot.letters), slot.letters, slot.kind)

    def _render_preview(self, depsgraph: Any) -> None:
        """A picture of a material, light or world for an icon or a panel: few samples, and no notes."""
        layer = depsgraph.view_layer_eval.name
        try:
            scene = preview_scene(translate_scene(depsgraph, compares_faces=False), bpy.data.window_managers)
            place = _Place(layer, "", working_from_rgb(), scene.film.transparent)
            jobs.render_preview(scene, lambda progress: self._write(progress.pixels, place), self._should_stop)
        except SpectralError as error:
            print(f"spectral: no preview: {error}")
            self._write_nothing(layer)
        except Exception:
            traceback.print_exc()
            self._write_nothing(layer)

    def _render(self, depsgraph: Any) -> RenderResult:
        """Render each view (one, except for stereo); returns the last view's result."""
        wanted, scene = jobs.current_request(), None
        notes: list[Note] = []
        for view in self._views(depsgraph.view_layer_eval.name):
            if self._should_stop():
                raise RenderCancelled("stopped before the first sample")
            if view:
                self.active_view_set(view)
            if scene is None or _has_own_cameras(depsgraph.scene_eval):
                scene, color_matrix = self._translated(depsgraph)
            self.update_stats("", "Starting the renderer")
            header = cryptomatte_header(scene, depsgraph)
            place = _Place(depsgraph.view_layer_eval.name, view, color_matrix, has_holes(scene), header)
            result = self._render_view(self._seen_from(scene, depsgraph), place, wanted.options)
            if wanted.rendered is not None:
                wanted.rendered(result, place.layer, view)
            notes += result.notes
            if result.status == "cancelled":
                break
        return replace(result, notes=tuple(dict.fromkeys(notes)))

    def _translated(self, depsgraph: Any) -> tuple[Scene, NDArray[np.float64] | None]:
        """The scene of the active view, with what the running request changes, and the matrix of its colors."""
        self.update_stats("", "Translating the scene")
        camera = self.camera_override  # of the active view
        output = self.path_resolve("render")  # as an attribute it is the method of this name
        scene = translate_scene(depsgraph, camera=camera, is_moving=True, output=output)
        scene = with_motion(scene, depsgraph, camera, self._set_frame)
        passes = rendered_passes(depsgraph, scene)
        scene = replace(
            scene,
            notes=(*scene.notes, *pass_notes(depsgraph.view_layer_eval)),
            settings=replace(scene.settings, passes=passes),
        )
        look = look_of(depsgraph.scene.spectral.viewport.look, depsgraph.scene, depsgraph.view_layer)
        if not look.is_plain:
            scene = look.on(replace(scene, notes=(*scene.notes, *notes_of(look))))
        exposure = exposure_of_display(depsgraph.scene, look)
        scene = replace(scene, settings=replace(scene.settings, display_exposure=exposure))
        translated = jobs.current_request().translated
        return scene if translated is None else translated(scene), shown_from_rgb(look.picture_matrix)

    def _render_view(self, scene: Scene, place: _Place, options: dict[str, Any]) -> RenderResult:
        peak = 0.0

        def show(progress: Progress) -> None:
            nonlocal peak
            self._write(progress.pixels, place)
            self.update_progress(progress.samples / progress.total)
            peak = max(peak, _megabytes(progress))
            self.update_memory_stats(memory_used=_megabytes(progress), memory_peak=peak)  # for the picture's stamp
            self.update_stats("", _state(progress))

        result = jobs.render(scene, on_progress=show, should_stop=self._should_stop, **options)
        self._write(result.pixels, place, result.header | place.header, result.passes)
        return result

    def _set_frame(self, frame: int, subframe: float) -> None:
        """Move the depsgraph of this render; the file's own frame stays."""
        self.frame_set(frame, subframe=subframe)

    def _should_stop(self) -> bool:
        """True if the user has requested a stop, or disables the extension."""
        return jobs.is_ending() or bool(self.test_break())

    def _views(self, layer: str) -> list[str]:
        """Names of the requested views: one without a name, or the eyes of a stereo render."""
        result = self.begin_result(0, 0, 1, 1, layer=layer)
        names = [view.name for view in result.views]
        self.end_result(result, cancel=True)
        return names or [""]

    def _seen_from(self, scene: Scene, depsgraph: Any) -> Scene:
        """The scene for the active eye of a stereo render."""
        if not depsgraph.scene_eval.render.use_multiview or _has_own_cameras(depsgraph.scene_eval):
            return scene
        eye = self.camera_override or depsgraph.scene_eval.camera
        placed = axes_of(np.asarray(self.camera_model_matrix(eye), dtype=np.float64).reshape(4, 4))
        shift = (self.camera_shift_x(eye), scene.camera.shift[1])
        seen = replace(scene, camera=replace(scene.camera, world_from_camera=placed, shift=shift))
        if not scene.moments:
            return seen
        # both eyes move like the camera between them
        eye_from_middle = np.linalg.inv(scene.camera.world_from_camera) @ placed
        moments = [
            replace(
                m, camera=replace(m.camera, world_from_camera=m.camera.world_from_camera @ eye_from_middle, shift=shift)
            )
            for m in scene.moments
        ]
        return replace(seen, moments=tuple(moments))

    def _write(
        self,
        pixels: NDArray[np.float32],
        place: _Place,
        header: dict[str, str] | None = None,
        passes: dict[str, NDArray[np.float32]] | None = None,
    ) -> None:
        """Show the picture so far, in Blender's scene-linear space, alpha associated.

        ``header``: text for files with the finished picture. ``passes``: passes of the picture.
        """
        height, width = pixels.shape[:2]
        result = self.begin_result(0, 0, width, height, layer=place.layer, view=place.view)
        combined = result.layers[0].passes.find_by_name("Combined", place.view) if result.layers else None
        if combined is not None:
            shown = np.array(pixels, dtype=np.float32)
            if place.working_from_rgb is not None:
                shown[..., :3] = pixels[..., :3] @ place.working_from_rgb.T.astype(np.float32)
            if not place.transparent:
                shown[..., 3] = 1.0
            combined.rect.foreach_set(shown.ravel())
        if passes and result.layers:
            fill_passes(result.layers[0].passes, passes, place.view, place.working_from_rgb)
        for name, text in (header or {}).items():
            result.stamp_data_add_field(name, text)
        self.end_result(result)
        for name, text in (header or {}).items():  # only the header of the whole result reaches the file
            self.get_result().stamp_data_add_field(name, text)
        self.has_result = True

    def _tell(self, result: RenderResult) -> None:
        """Notes to the user on approximated features."""
        for note in result.notes:
            print(f"spectral: {note.subject}: {note.message}")
        shown = [f"{note.subject}: {note.message}" for note in result.notes[:SHOWN_NOTES]]
        if len(result.notes) > SHOWN_NOTES:
            shown.append(f"and {counted(len(result.notes) - SHOWN_NOTES, 'more note')} on the console")
        if shown:
            self.report({"WARNING"}, "\n".join(shown))

    def _write_nothing(self, layer: str) -> None:
        """An empty picture: Blender 5.0 crashes when it saves an EXR of a render that never had a result."""
        if self.has_result:
            return
        result = self.begin_result(0, 0, self.resolution_x, self.resolution_y, layer=layer)
        self.end_result(result)

    def _fail(self, frame: int, layer: str, message: str) -> None:
        self._write_nothing(layer)
        jobs.record(jobs.RenderRecord(frame, layer, "failed", message))
        self.error_set(message)  # the text in the image editor
        self.report({"ERROR"}, message)  # makes the operator fail, also in an animation


def _has_own_cameras(scene: Any) -> bool:
    """True if each view has a camera of its own, with its own lens, clip distances and depth of field."""
    return bool(scene.render.use_multiview and scene.render.views_format == "MULTIVIEW")


def _state(progress: Progress) -> str:
    """Line of the image editor on a render in progress."""
    left = "" if progress.left_s is None else f" | {clock(progress.left_s, digits=0)} left"
    memory = f" | {_megabytes(progress):.0f} MB" if progress.memory else ""
    return f"Sample {progress.samples}/{progress.total} | {clock(progress.seconds)}{left}{memory}"


def _megabytes(progress: Progress) -> float:
    """Memory of the render process in 10⁶ bytes."""
    return progress.memory / 1e6


def register() -> None:
    """Register the engine."""
    bpy.utils.register_class(SpectralRenderEngine)


def unregister() -> None:
    """Remove the engine, after its renders."""
    jobs.end_renders()
    bpy.utils.unregister_class(SpectralRenderEngine)
