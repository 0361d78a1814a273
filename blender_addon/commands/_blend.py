# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by commands on a .blend file: Blender without a window, the open file, and arguments that change it."""

from __future__ import annotations

import argparse
import ctypes
import os
import re
import signal
import sys
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from spectral_core.cli.shared.outputs import require_apart
from spectral_core.cli.shared.outputs import require_outputs as _require_outputs
from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError
from spectral_core.files.guarded import no_file
from spectral_core.scene import Scene

GOALS = {"samples": "SAMPLES", "target_error": "ERROR", "time_budget": "TIME"}
"""Options that end the sampling, and the file's setting for it, which may be another one."""


def add_scene_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments that replace settings of the file."""
    parser.add_argument("scene", type=Path, metavar="SCENE.blend", help="the file to read; it is not changed")
    parser.add_argument("--samples", type=int, metavar="N", help="light paths per pixel, instead of the file's")
    parser.add_argument("--seed", type=int, metavar="N", help="start of the random numbers, instead of the file's")
    parser.add_argument("--percentage", type=int, metavar="P", help="size of the picture in percent of the file's")
    parser.add_argument(
        "--transport", choices=["auto", "rgb", "spectral"], help="type of transport, instead of the file's choice"
    )
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="EFFECT=VALUE",
        help="a value to use in place of the plan's own, such as bounces=4; `spectral-scene plan` lists the effects",
    )  # fmt: skip
    parser.add_argument("--variant", choices=["llvm", "cuda"], help="renderer; default: the best available")


def add_accuracy_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments that request an error or a time instead of samples."""
    asked = parser.add_mutually_exclusive_group()
    asked.add_argument(
        "--target-error", type=float, metavar="E", help="sample until the mean color error (ΔE2000) is E, e.g. 1.0"
    )
    asked.add_argument("--time-budget", type=float, metavar="S", help="sample for S seconds, noisy parts more")


def scene_file(arguments: argparse.Namespace) -> Path:
    """The .blend file of the command line. Raises InvalidInputError if there is none."""
    path = Path(arguments.scene).resolve()
    if not path.is_file():
        raise InvalidInputError(no_file(path, "name the .blend file to render"))
    return path


def open_scene(arguments: argparse.Namespace) -> Any:
    """Open the file and set the engine and the arguments; returns ``bpy.context.scene``.

    Raises MissingDependencyError without Blender's Python module, FileFormatError if the file is no .blend file.
    """
    path = scene_file(arguments)
    bpy = _bpy()
    from ..editing.animation import still
    from ..properties.render import ENGINE

    _require_values(arguments)
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    except RuntimeError as error:
        raise FileFormatError(f"{path.name} cannot be opened: {str(error).strip().removeprefix('Error: ')}") from error
    scene = bpy.context.scene
    scene.render.engine = ENGINE
    settings = scene.spectral.render
    for name, value in _given(arguments).items():
        still(scene, settings.path_from_id(name))
        setattr(settings, name, value)
    if arguments.percentage is not None:  # Blender animates no size
        scene.render.resolution_percentage = arguments.percentage
    for effect, value in _overrides(arguments.overrides).items():
        entry = settings.overrides.get(effect) or settings.overrides.add()
        entry.name, entry.value = effect, value
    if scene.camera is None:
        raise InvalidInputError(f"the scene {scene.name!r} of {path.name} has no camera; add one to it and save it")
    return scene


def require_blender() -> None:
    """Load Blender's Python module with the extension enabled. Raises MissingDependencyError if it is absent."""
    _bpy()


def _given(arguments: argparse.Namespace) -> dict[str, Any]:
    """The render settings of this extension that are given."""
    numbers, transport, denoise = _numbers(arguments), arguments.transport, getattr(arguments, "denoise", None)
    goals = [GOALS[name] for name in numbers if name in GOALS]
    given: dict[str, Any] = numbers | ({"goal": goals[-1]} if goals else {})
    given |= {} if denoise is None else {"denoise": denoise}
    return given | ({} if transport is None else {"transport": transport.upper()})


def _numbers(arguments: argparse.Namespace) -> dict[str, float]:
    """The numbers of the file's render settings that are given."""
    known = {name: getattr(arguments, name, None) for name in ("samples", "seed", "target_error", "time_budget")}
    return {name: value for name, value in known.items() if value is not None}


def _require_values(arguments: argparse.Namespace) -> None:
    """Raise InvalidInputError for values that no file takes, before one is opened, which may take minutes.

    Blender would move a number beyond a property's limits without a message.
    """
    import bpy

    from ..properties.render import SpectralRender

    numbers = _numbers(arguments)
    for name in numbers:
        if name in GOALS and name != "samples" and "samples" in numbers:
            option = name.replace("_", "-")
            raise InvalidInputError(f"--samples has no effect with --{option}, which ends the sampling; give one")
    limits = {name: (value, SpectralRender.bl_rna.properties[name]) for name, value in numbers.items()}
    if arguments.percentage is not None:
        size = bpy.types.RenderSettings.bl_rna.properties["resolution_percentage"]
        limits["percentage"] = arguments.percentage, size
    for name, (value, known) in limits.items():
        if not known.hard_min <= value <= known.hard_max:
            given = f"--{name.replace('_', '-')} is {value:.12g}"
            raise InvalidInputError(f"{given}; expected a number from {known.hard_min:.6g} to {known.hard_max:.10g}")
    frame, known = getattr(arguments, "frame", None), bpy.types.Scene.bl_rna.properties["frame_current"]
    if frame is not None and not known.hard_min <= frame <= known.hard_max:
        raise InvalidInputError(f"--frame is {frame}; Blender stops at {known.hard_min} and {known.hard_max}")
    if overrides := _overrides(arguments.overrides):
        from spectral_core.render.plan.effects import require_possible

        require_possible(overrides)


def _overrides(texts: Sequence[str]) -> dict[str, str]:
    """Value of each effect that ``--set`` gives."""
    given: dict[str, str] = {}
    for text in texts:
        effect, separator, value = text.partition("=")
        if not separator or not effect or not value:
            raise InvalidInputError(f"--set {text!r} is not of the form EFFECT=VALUE, for example --set bounces=4")
        if given.setdefault(effect, value) != value:
            raise InvalidInputError(f"--set gives {effect} the values {given[effect]} and {value}; give one of them")
    return given


def _bpy() -> Any:
    """Blender's Python module with the extension enabled; its console output goes to standard error."""
    try:
        with _without_interrupts():
            import bpy
    except ImportError as error:
        raise MissingDependencyError.package("bpy", "reading .blend files outside Blender", "blender") from error
    require_readable_colors(bpy.utils.system_resource("DATAFILES"))
    import blender_addon

    blender_addon.register_once()
    return bpy


def require_readable_colors(folder: str) -> None:
    """Raise InvalidInputError if Blender cannot read its color management from this folder.

    OpenColorIO takes ``$NAME`` and ``%NAME%`` in its paths as variables. Blender then goes on without views: files that
    should be sRGB have the linear numbers.
    """
    if "$" in folder or folder.count("%") > 1:
        raise InvalidInputError(
            f"Blender cannot read its color management in {folder}, so that all pictures would be too dark: it takes "
            "'$' and '%…%' in a path as variables. Move Blender or this environment to a folder without them"
        )


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Let Ctrl-C wait until the block ends: a start of Blender that is interrupted crashes."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _frame: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before or signal.SIG_DFL)
    if pressed:
        raise KeyboardInterrupt


def missing_files() -> list[str]:
    """Notes on libraries of the open file: the picture lacks what was not found."""
    from ..editing.libraries import library_notes

    return library_notes()


def require_outputs(outputs: Iterable[Path], of_views: Iterable[Path] = ()) -> None:
    """Require before the work that files can be written, and that none is an image or another file of the scene.

    ``of_views``: the files of a stereo render, which are only required not to be the scene's. ``spectral-scene render
    wood.blend`` would replace a texture wood.png. Raises InvalidInputError and FileWriteError.
    """
    import bpy

    from ..translate.shading.texture import file_of, spectral_texture_nodes

    named = [Path(path) for path in bpy.utils.blend_paths(absolute=True)]
    for image in bpy.data.images:
        if image.filepath and image.source in ("SEQUENCE", "TILED"):  # one name stands for many files
            path = Path(bpy.path.abspath(image.filepath, library=image.library))
            ends = [re.escape(end) for end in re.split(r"<UDIM>|<UVTILE>|\d+(?=\D*$)", path.name)]
            names = re.compile(r"\w+".join(ends))
            named += [each for each in path.parent.glob("*") if names.fullmatch(each.name)]
    named += [file_of(node) for node in spectral_texture_nodes() if node.filepath]
    require_apart(of_views, named)
    _require_outputs(outputs, named)


def with_variant(scene: Scene, variant: str | None) -> Scene:
    """The scene, to be traced by the variant that the command line names."""
    return scene if variant is None else replace(scene, settings=replace(scene.settings, variant=variant))


def blender_message(error: RuntimeError) -> str:
    """Message of an operator's error, without the word Error and without repetition."""
    lines = [line.strip().removeprefix("Error: ") for line in str(error).splitlines() if line.strip()]
    return "; ".join(dict.fromkeys(lines))


def unsaved_remedy(render: Any) -> str:
    """What to do where Blender writes no multilayer file: it states only that it cannot save."""
    is_square = render.pixel_aspect_x == render.pixel_aspect_y
    if is_square or render.image_settings.file_format != "OPEN_EXR_MULTILAYER":
        return ""
    return (
        f"; its pixels are {render.pixel_aspect_x:g} by {render.pixel_aspect_y:g}, and Blender 5.0 writes multilayer "
        "EXR of square pixels only; set Aspect X and Y to 1, or write a picture without passes"
    )


@contextmanager
def chatter_to_stderr() -> Iterator[None]:
    """Redirect Blender's output to standard error, so that standard output holds the command's own lines."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        ctypes.CDLL(None if os.name == "posix" else "msvcrt").fflush(None)
        os.dup2(kept, 1)
        os.close(kept)
