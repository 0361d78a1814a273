# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of other programs (.glb, .gltf, .blend) against Cycles: mean color difference at matched noise, side by side.

Arguments: files and folders, which are searched for such files; ``--most N`` takes N of them, evenly spread. Without
arguments small files are written, one per glTF extension that Blender imports; the repository carries no foreign files.
Those of the docs are free ones: Debian's packages openshot-qt, castle-game-engine-doc, assimp-testmodels and
morse-simulator-data, ``npm pack @webxr-input-profiles/assets`` and ``@pmndrs/assets``, ``pip download genesis-world``.

A file without a camera gets one that sees all of it, a sun and an area lamp beside it, and a gray world. ΔE2000 is
taken between means of blocks of 4×4 pixels on a white of the sRGB display, and averaged over the blocks that show the
file. Two seeds of Cycles state the noise by the same measure. The picture of each file holds Cycles' frame, ours, and
ten times their difference.
"""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks.render.cases.gltf_files import write_files
from benchmarks.render.features.compare import render
from benchmarks.render.render_features import quiet
from spectral_core.errors import UnknownNameError
from spectral_core.spectra.color import delta_e_2000, display_rgb_from_linear, lab_from_linear_rgb

OPTIONS = ("--most N",)
WORDS = "FILE_OR_FOLDER…"
KINDS = (".glb", ".gltf", ".blend")
SIZE, SAMPLES = 192, 96
WANTED = 1.5
BLOCK = 4
Pixels = NDArray[np.float64]


def run(options: Options) -> dict[str, Any]:
    """Print one line per file, and return them."""
    import bpy

    import blender_addon

    blender_addon.register_once()
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    options.out.mkdir(parents=True, exist_ok=True)
    files = _files(options.extra) if options.extra else write_files(options.out / "extensions")
    rows: dict[str, Any] = {}
    for path in files[:2] if options.quick else files:
        name = "/".join(path.parts[-3:])
        try:
            row = _one(path, 16 if options.quick else SAMPLES, options.out)
        except Exception as error:  # one file that fails is a finding, not the end of the run
            row = {"delta_e": float("inf"), "noise": 0.0, "notes": [f"{type(error).__name__}: {error}"[:300]]}
        rows[name] = row
        notes = "; ".join(row["notes"])[:200]
        print(f"ΔE2000 {row['delta_e']:6.2f}  Cycles against itself {row['noise']:5.2f}  {name:60} {notes}", flush=True)
    errors = np.array([row["delta_e"] for row in rows.values()])
    worst = float(errors.max())
    print(f"{len(rows)} files: ΔE2000 {np.median(errors):.2f} in the median, {worst:.2f} at most")
    return {
        "files": len(rows),
        "rows": rows,
        "worst": worst,
        "holds": {f"the mean ΔE2000 to Cycles is below {WANTED:g} in each of {len(rows)} files": worst < WANTED},
    }


def _files(words: list[str]) -> list[Path]:
    """The files that are named, and those within folders that are named, in order of their paths."""
    most = int(words[words.index("--most") + 1]) if "--most" in words else None
    named = [Path(word) for word in words if not word.startswith("--") and not word.isdigit()]
    found = [path for path in named if path.suffix.lower() in KINDS]
    for folder in named:
        found += sorted(path for path in folder.rglob("*") if path.suffix.lower() in KINDS) if folder.is_dir() else []
    step = max(1, len(found) // most) if most else 1
    if not found:
        raise UnknownNameError(
            f"expected files of kind {', '.join(KINDS)}; none is in {', '.join(map(str, named)) or 'nothing'}"
        )
    return found[::step][:most]


def _one(path: Path, samples: int, out: Path) -> dict[str, Any]:
    import bpy

    from blender_addon import jobs

    with quiet():
        _opened(path)
        _staged(samples)
        jobs.records.clear()
        ours = render("SPECTRAL", 1)
        notes = sorted({f"{note.subject}: {note.message}" for record in jobs.records for note in record.notes})
        cycles = [render("CYCLES", seed) for seed in (1, 2)]
    # The share of the frame that differs from the background, because the background alone would hide an error.
    shown = _blocks(cycles[0][..., 3:])[..., 0] > 0.5
    if not shown.any():
        shown[:] = True  # an empty frame, as at the start of some animations
    labs = [lab_from_linear_rgb(_blocks(picture[..., :3])[shown]) for picture in (ours, *cycles)]
    row = {
        "delta_e": float(delta_e_2000(labs[0], labs[1]).mean()),
        "noise": float(delta_e_2000(labs[1], labs[2]).mean()),
        "notes": notes,
        "materials": len(bpy.data.materials),
    }
    frames = [each[..., :3] + 0.2 * (1 - each[..., 3:]) for each in (cycles[0], ours)]
    picture = np.concatenate([*frames, 10 * np.abs(frames[1] - frames[0])], axis=1)
    _write(out / f"{path.parent.name}-{path.stem}.png", picture)
    return row


def _opened(path: Path) -> None:
    import bpy

    if path.suffix.lower() == ".blend":
        bpy.ops.wm.open_mainfile(filepath=str(path))
        return
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    scene = bpy.context.scene
    # Some exporters put a camera into the file that may not see the model.
    for item in [each for each in scene.objects if each.type == "CAMERA"]:
        bpy.data.objects.remove(item)


def _staged(samples: int) -> None:
    """Settings that both renderers share, and a camera, lamps and a world where the file has none."""
    import bpy

    from benchmarks.render.features.stage import match_settings

    scene = bpy.context.scene
    match_settings(scene, samples)
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.film_transparent = True
    with contextlib.suppress(AttributeError):
        scene.render.resolution_percentage = 100
    if scene.camera is None:
        center, radius = _ball_around(scene)
        data = bpy.data.cameras.new("Camera")
        data.lens, data.clip_start, data.clip_end = 60, radius * 1e-2, radius * 100
        direction = np.array([0.6, -1.0, 0.55]) / np.linalg.norm([0.6, -1.0, 0.55])
        scene.camera = _placed("Camera", data, center + 3.2 * radius * direction, center)
        lamp = bpy.data.lights.new("Lamp", "AREA")
        lamp.energy, lamp.size = 110.0 * radius**2, 1.5 * radius
        _placed("Lamp", lamp, center + radius * np.array([-1.8, -1.6, 2.2]), center)
        sun = bpy.data.lights.new("Sun", "SUN")
        sun.energy, sun.angle, sun.color = 2.0, 0.05, (1.0, 0.9, 0.8)
        _placed("Sun", sun, center + radius * np.array([2.0, 0.4, 2.0]), center)
        world = bpy.data.worlds.new("World")
        scene.world = world
        _lit_evenly(world, (0.35, 0.4, 0.5, 1.0))


def _lit_evenly(world: Any, color: tuple[float, float, float, float]) -> None:
    """One color all around, with nodes, as files from elsewhere have them."""
    from blender_addon import compat

    background = next(node for node in compat.use_nodes(world).nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = color


def _placed(name: str, data: Any, location: NDArray[np.float64], target: NDArray[np.float64]) -> Any:
    import bpy
    from mathutils import Vector

    made = bpy.data.objects.new(name, data)
    made.location = location
    made.rotation_euler = Vector(target - location).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(made)
    return made


def _ball_around(scene: Any) -> tuple[NDArray[np.float64], float]:
    """Center and radius of the boxes of everything that a render shows."""
    import bpy

    bpy.context.view_layer.update()
    corners = [
        np.array(item.matrix_world) @ np.append(np.array(corner), 1.0)
        for item in scene.objects
        if item.type in {"MESH", "CURVE", "SURFACE", "META", "FONT"} and not item.hide_render
        for corner in item.bound_box
    ]
    if not corners:
        raise ValueError("nothing in the file has a surface")
    points = np.array(corners)[:, :3]
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-6)


def _blocks(picture: Pixels) -> Pixels:
    height, width = (size // BLOCK * BLOCK for size in picture.shape[:2])
    cut = picture[:height, :width]
    return cut.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1).mean((1, 3))


def _write(path: Path, linear: Pixels) -> None:
    """A PNG of a linear picture whose row 0 is at the bottom."""
    import bpy

    height, width = linear.shape[:2]
    image = bpy.data.images.new("pair", width, height)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = display_rgb_from_linear(np.clip(linear, 0, 1))
    image.pixels.foreach_set(pixels.ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)
