# SPDX-License-Identifier: GPL-3.0-or-later
"""Render a .blend file as F12 does, without a window: PNG through the file's view transform, or EXR; or write it as a
scene for Mitsuba.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

from spectral_core.cli.shared.outputs import numbered
from spectral_core.cli.shared.report import print_json
from spectral_core.errors import InvalidInputError, RenderCancelled, RenderError, counted
from spectral_core.files.kept import written_or_kept
from spectral_core.files.whole import whole_file
from spectral_core.files.whole_picture import require_written

from . import _bands, _blend, _passes
from .plan import translated_scene

FORMATS = {".png": "PNG", ".exr": "OPEN_EXR", ".jpg": "JPEG", ".jpeg": "JPEG", ".tif": "TIFF", ".tiff": "TIFF"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    _blend.add_scene_arguments(parser)
    _blend.add_accuracy_arguments(parser)
    parser.add_argument(
        "--out", type=Path, metavar="FILE",
        help="picture to write, .png, .jpg, .tif or .exr (linear); default SCENE.png; with --frame or "
        "--animation, marks as in FILE_####.png are the number; an animation adds it to names without marks",
    )  # fmt: skip
    parser.add_argument(
        "--bands", type=int, metavar="N",
        help="for an .exr: also N spectral channels from 400 to 700 nm, in the layout of Fichet et al. 2021; a file "
        "for each view layer and each eye",
    )  # fmt: skip
    parser.add_argument(
        "--denoise", action=argparse.BooleanOptionalAction, default=None,
        help="denoise the finished picture by Open Image Denoise, or not, instead of the file's choice; "
        "needs the Python package pyoidn",
    )  # fmt: skip
    parser.add_argument(
        "--multilayer", action="store_true",
        help="for an .exr: write every pass that the file's view layers tick, each as a separate layer",
    )  # fmt: skip
    parser.add_argument(
        "--passes", nargs="+", metavar="NAME", default=[],
        help="for an .exr: passes to make beside those that are ticked, by Cycles' names ('Depth', 'Diffuse Direct', "
        "'CryptoObject' …); makes it multilayer",
    )  # fmt: skip
    parser.add_argument(
        "--write-mitsuba", type=Path, metavar="DIR",
        help="instead of a picture: a folder with scene.xml that Mitsuba 3 loads without this package, its meshes, "
        "images and spectra, and export.json, which names the parts of the scene that Mitsuba has no counterpart for",
    )  # fmt: skip
    frames = parser.add_mutually_exclusive_group()
    frames.add_argument("--frame", type=int, metavar="N", help="frame to render; default the file's current one")
    frames.add_argument("--animation", action="store_true", help="render every frame of the file's range")


NAMED = {"count of spectral bands": "--bands"}
OF_PICTURES = ("out", "bands", "multilayer", "passes", "animation", "denoise", "target_error", "time_budget")


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    if arguments.write_mitsuba is None:
        return {}
    return dict.fromkeys(OF_PICTURES, "--write-mitsuba writes a scene and no picture")


def run(arguments: argparse.Namespace) -> int:
    """Render; exit status 0 if every frame was finished."""
    if arguments.write_mitsuba is not None:
        return _write_mitsuba(arguments, arguments.write_mitsuba)
    start = time.perf_counter()
    out = arguments.out or Path(_blend.scene_file(arguments).with_suffix(".png").name)
    if out.suffix.lower() not in FORMATS:
        ending = f"ends in {out.suffix!r}" if out.suffix else "has no ending"
        given = f"{out} is a folder" if out.is_dir() else f"{out.name} {ending}"
        raise InvalidInputError(f"--out: {given}; expected a picture's name that ends in {', '.join(FORMATS)}")
    if arguments.bands is not None and out.suffix.lower() != ".exr":
        raise InvalidInputError(f"--bands: spectral bands fit into an .exr only; {out.name} is none")
    if (arguments.multilayer or arguments.passes) and out.suffix.lower() != ".exr":
        raise InvalidInputError(f"passes fit into an .exr only; {out.name} is none")
    if (arguments.multilayer or arguments.passes) and arguments.bands is not None:
        raise InvalidInputError("spectral bands and passes are files of different layouts; request one of them")
    measured = _bands.options(arguments.bands)  # before the file is opened, which may take minutes
    with _blend.chatter_to_stderr():
        ticks = _passes.ticks(arguments)
        scene = _blend.open_scene(arguments)
        without = _without_strips(scene)
        _passes.tick(scene, ticks)
        if arguments.bands is not None:
            scene.render.use_compositing = False  # its nodes may render other scenes, which no file would hold
        frames = _frames(arguments, scene)
        written = [_render_frame(arguments, measured, scene, frame, out) for frame in frames]
    notes = [*_blend.missing_files(), *without, *(note for entry in written for note in entry.pop("notes"))]
    report: dict[str, Any] = {
        "files": [file for entry in written for file in entry["files"]],
        "frames": written,
        "colors": _colors(scene, out, arguments.bands),
        "notes": list(dict.fromkeys(notes)),
        "seconds": round(time.perf_counter() - start, 3),
    }
    for entry in written:
        print(
            f"{', '.join(entry['files'])}: {counted(entry['samples'], 'sample')} in {entry['seconds']:.1f} s, ", end=""
        )
        print(f"{entry['transport']} ({entry['variant']})")
        if entry["passes"]:
            print(f"passes: {', '.join(entry['passes'])}")
        if entry["denoised"]:
            print(f"denoised by {entry['denoised']}")
        if entry["outcome"] is not None:
            said, found = entry["prediction"], entry["outcome"]
            least = "at least " if found["rare"] is not None else ""
            print(
                f"predicted: {least}ΔE {said['delta_e']:.2g} in {said['seconds']:.1f} s, "
                f"{counted(said['samples'], 'sample', form='.0f')}"
            )
            error = f"{least}ΔE {found['delta_e']:.2g} ± {2 * found['spread']:.1g}"
            print(f"reached:   {error} in {found['seconds']:.1f} s, {counted(found['samples'], 'sample', form='.0f')}")
    print(f"colors: {report['colors']}")
    for note in report["notes"]:
        print(f"note: {note}")
    if arguments.json:
        print_json(report)
    return 0


def _write_mitsuba(arguments: argparse.Namespace, folder: Path) -> int:
    """Write the scene for Mitsuba instead of a picture."""
    from spectral_core.render.mitsuba_export import write_mitsuba

    with _blend.chatter_to_stderr():
        scene = _blend.open_scene(arguments)
        if arguments.frame is not None:
            scene.frame_set(arguments.frame)
        made = write_mitsuba(translated_scene(arguments), folder)
    notes = [*_blend.missing_files(), *(f"{note.subject}: {note.message}" for note in made.notes)]
    print(f"{made.scene}: {counted(len(made.files), 'file')}; load it by mitsuba.load_file")
    for note in notes:
        print(f"note: {note}")
    if arguments.json:
        print_json({"scene": str(made.scene), "files": list(made.files), "notes": notes})
    return 0


def _frames(arguments: argparse.Namespace, scene: Any) -> list[int]:
    if arguments.animation:
        return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    return [scene.frame_current if arguments.frame is None else arguments.frame]


def _render_frame(
    arguments: argparse.Namespace, measured: dict[str, Any], scene: Any, frame: int, out: Path
) -> dict[str, Any]:
    """Render a frame and write it; raises RenderError with the engine's message if it failed.

    ``measured``: the bands that the renderer measures beside the picture.
    """
    import bpy

    from .. import jobs

    path = _file_of(arguments, out, frame).resolve()
    is_split = scene.render.use_multiview and scene.render.image_settings.views_format == "INDIVIDUAL"
    ends = [view.file_suffix for view in scene.render.views if is_split or arguments.bands is not None]
    _blend.require_outputs([path], [path.with_stem(path.stem + end) for end in ends])
    is_current = not arguments.animation and arguments.frame is None
    scene.frame_set(frame, subframe=scene.frame_subframe if is_current else 0.0)
    jobs.records.clear()
    pictures = _bands.Pictures(keeps=arguments.bands is not None)
    wanted = jobs.RenderRequest(
        measured,
        lambda given: _blend.with_variant(given, arguments.variant),
        pictures.add,
    )
    with jobs.request(wanted), tempfile.TemporaryDirectory() as folder:
        # Blender replaces braces and hashes in a path: it writes to a path without them
        plain = Path(folder) / f"frame{path.suffix.lower()}"
        _choose_format(scene.render, plain, layers=bool(arguments.multilayer or arguments.passes))
        try:
            bpy.ops.render.render(write_still=True)
        except RuntimeError as error:
            remedy = _blend.unsaved_remedy(scene.render) if "cannot save" in str(error) else ""
            raise RenderError(f"frame {frame}: {_blend.blender_message(error)}{remedy}") from error
        result = _finished(jobs.records, frame)
        files = written_or_kept(
            path,
            lambda place: _copied(plain, place) if arguments.bands is None else _bands.write(place, pictures, scene),
        )
    return {
        "frame": frame,
        "file": files[0],
        "files": files,
        "samples": result.samples,
        "seconds": round(result.seconds, 3),
        "transport": result.plan["transport"].value,
        "variant": result.variant,
        "denoised": result.denoised,
        "passes": list(pictures.passes) if arguments.multilayer or arguments.passes else [],  # those in the file
        "prediction": None if result.prediction is None else dataclasses.asdict(result.prediction),
        "outcome": None if result.outcome is None else dataclasses.asdict(result.outcome),
        "notes": [f"{note.subject}: {note.message}" for record in jobs.records for note in record.notes],
    }


def _copied(plain: Path, path: Path) -> list[str]:
    """Copy what Blender wrote instead of ``plain`` to ``path``, all files or none; returns the copies.

    There are several for a stereo render: Blender adds the suffix of each view to the name.
    """
    made = {
        each: path.with_name(path.stem + each.stem.removeprefix(plain.stem) + path.suffix)
        for each in sorted(plain.parent.glob(f"{plain.stem}*{plain.suffix}"))
    }
    if not made:
        raise RenderError(f"Blender wrote no picture for {path}; its messages above say why")
    for each in made:
        require_written(each)
    with contextlib.ExitStack() as whole:
        for each, copy in made.items():
            shutil.copyfile(each, whole.enter_context(whole_file(copy)))
    return list(map(str, made.values()))


def _without_strips(scene: Any) -> list[str]:
    """Switch the sequencer off, which F12 would show in place of the scene; returns a note if it has visible strips."""
    if not scene.render.use_sequencer or scene.sequence_editor is None:
        return []
    scene.render.use_sequencer = False
    editor = scene.sequence_editor
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences  # before 4.4
    if all(each.type == "SOUND" or each.mute for each in strips):
        return []
    return ["Sequencer: the scene itself is rendered, without the strips of its sequencer, which F12 shows instead"]


def _choose_format(render: Any, path: Path, *, layers: bool) -> None:
    """Set Blender's output to a file; an EXR holds 32-bit floats, and passes as ``layers``."""
    from .. import compat

    output, kind = render.image_settings, "OPEN_EXR_MULTILAYER" if layers else FORMATS[path.suffix]
    space = output.linear_colorspace_settings.name if "EXR" in output.file_format and "EXR" in kind else None
    compat.set_image_format(output, kind, **({"color_depth": "32"} if "EXR" in kind else {}))
    if space is not None:  # Blender sets it back with the format
        output.linear_colorspace_settings.name = space
    render.filepath, render.use_file_extension = str(path), False


def _finished(records: list[Any], frame: int) -> Any:
    """The result of the last view layer, if all of them were finished."""
    if not records:
        raise RenderError(f"frame {frame}: Blender did not start the render; its messages above say why")
    for record in records:
        if record.status == "failed":
            raise RenderError(f"frame {frame}: {record.message}")
        if record.status == "cancelled":
            raise RenderCancelled(f"frame {frame} was stopped after {counted(record.samples, 'sample')}")
    return records[-1].result


def _colors(scene: Any, out: Path, bands: int | None) -> str:
    """Text on the encoding of the colors, which the file's output may override."""
    from .. import compat

    if bands is not None:
        return f"linear sRGB, and radiance per nm in {bands} bands; straight from the renderer, without compositing"
    output = scene.render.image_settings
    overrides = output.color_management == "OVERRIDE"
    if out.suffix.lower() == ".exr":
        import bpy

        own = output.linear_colorspace_settings.name
        if overrides:
            return f"linear, {own}, by the output's own color space"
        return f"scene-linear, {compat.working_space(bpy.data)}"
    owner, whose = (output, "output's own") if overrides else (scene, "file's")
    look = "" if owner.view_settings.look == "None" else f", look {owner.view_settings.look}"
    device, view = owner.display_settings.display_device, owner.view_settings.view_transform
    return f"{device} through the {whose} view transform {view}{look}"


def _file_of(arguments: argparse.Namespace, out: Path, frame: int) -> Path:
    """The file of a frame; marks are no number in the name of the .blend file, nor where no frame is named."""
    if arguments.out is not None and (arguments.animation or (arguments.frame is not None and "#" in out.stem)):
        return numbered(out, frame)
    return out.with_name(f"{out.stem}_{frame:04d}{out.suffix}") if arguments.animation else out
