# SPDX-License-Identifier: GPL-3.0-or-later
"""Record the contribution of each light group of a .blend file, so that lights can be changed later."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from spectral_core.cli.shared.report import print_json
from spectral_core.errors import InvalidInputError
from spectral_core.files.kept import written_or_kept

from . import _blend
from .plan import translated_scene

STORAGE_NAMES = ("dial", "bands31", "bands61", "bands121", "exact")
"""Names in ``relight.storages``; a literal, so that a command's help imports no renderer."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    _blend.add_scene_arguments(parser)
    parser.add_argument("--out", type=Path, metavar="FILE.exr", help="transport file; default SCENE.transport.exr")
    parser.add_argument(
        "--storage", choices=STORAGE_NAMES, default="dial",
        help="dial: mixtures of the lights; bands: new spectra, approximately; exact: new spectra on a 10 nm grid",
    )  # fmt: skip
    parser.add_argument(
        "--one-per-light", action="store_true", help="a group for each light, not Blender's light groups"
    )
    parser.add_argument("--estimate", action="store_true", help="print memory and error only, render nothing")


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    return {"out": "--estimate writes nothing"} if arguments.estimate else {}


def run(arguments: argparse.Namespace) -> int:
    """State memory and error, then record."""
    from spectral_core.render import RenderProcess
    from spectral_core.render.light_groups import group_text
    from spectral_core.render.relight.groups import light_groups, one_group_per_light
    from spectral_core.render.relight.memory import peak_bytes, stated_peak
    from spectral_core.render.relight.storages import storage_named
    from spectral_core.render.relight.transport import record_transport
    from spectral_core.render.relight.transport_file import write_transport

    out = arguments.out or Path(_blend.scene_file(arguments).with_suffix(".transport.exr").name)
    if out.suffix.lower() != ".exr":
        raise InvalidInputError(f"--out: {out.name} does not end in .exr, which a transport file is")
    start = time.perf_counter()
    with _blend.chatter_to_stderr():
        opened = _blend.open_scene(arguments)
        from ..editing.dial.rendered_parts import look_matrix  # Blender is there only now
        from ..translate.display.transform import view_transform_of
        from ..translate.viewport.look import require_light

        scene = translated_scene(arguments)
        view, look = view_transform_of(opened), look_matrix(opened)
        require_light(scene, opened.spectral.viewport.look)
    storage = storage_named(arguments.storage)
    grouped = one_group_per_light(scene) if arguments.one_per_light else scene
    names = light_groups(grouped)
    stated = stated_peak(storage, *scene.film.size, len(names))
    print(stated)
    missing = _blend.missing_files()
    report: dict[str, Any] = {
        "stated": stated, "bytes": storage.bytes_needed(*scene.film.size, len(names)),
        "peak_bytes": peak_bytes(storage, *scene.film.size, len(names)), "groups": list(names), "notes": missing,
    }  # fmt: skip
    if not arguments.estimate:
        _blend.require_outputs([out])
        with RenderProcess() as renderer:
            transport = record_transport(
                scene, storage, one_per_light=arguments.one_per_light, view=view, look=look, render=renderer.render,
                on_progress=lambda p: print(f"{p.samples}/{p.total} samples", file=sys.stderr),
            )  # fmt: skip
        written_or_kept(out, lambda place: write_transport(place, transport))
        seconds = round(time.perf_counter() - start, 2)
        print(f"{out}: light groups {', '.join(map(group_text, transport.groups))}, {seconds:.1f} s")
        if len(transport.groups) == 1 and not arguments.one_per_light:
            print("note: all light is in one group, so there is nothing to mix; --one-per-light keeps lights apart")
        report["notes"] = [*missing, *(f"{note.subject}: {note.message}" for note in transport.notes)]
        report |= {"file": str(out), "groups": list(transport.groups), "seconds": seconds}
    for note in report["notes"]:
        print(f"note: {note}")
    if arguments.json:
        print_json(report)
    return 0
