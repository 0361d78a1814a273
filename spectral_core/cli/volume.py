# SPDX-License-Identifier: GPL-3.0-or-later
"""Render a volume file through a transfer function: a picture, its samples and its error.

VOLUME is any file that the library reads (NRRD, NIfTI, VTK, OpenVDB, MetaImage, TIFF, NumPy, raw), a folder of TIFF
slices, a numbered pattern such as flow_####.vti for a sequence, or sample:NAME[:SIZE] for built-in sample data
(sample:engine, sample:gaussians, sample:shells, ...). The one quality setting is the picture's
signal-to-noise ratio in dB: --quality by word, --target-snr by number; the error is estimated before the render, and
measured after it with --report. Further lights make further pictures from the same march, without a ray.

  spectral-scene volume head.nrrd --transfer examples/transfer/solid.toml --report
  spectral-scene volume sample:engine --transfer examples/transfer/painted.toml --light D65 --light HP1 --out engine.png
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from spectral_core.cli.shared.parser import without_companion
from spectral_core.cli.shared.report import print_json
from spectral_core.cli.shared.volume_frames import framed, frames_of, transfer_of
from spectral_core.files.names import file_words

if TYPE_CHECKING:
    from spectral_core.spectra.spectrum import Illuminant
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.plan import Plan
    from spectral_core.volume.transfer import TransferFunction

NAMED = {
    "width of a view": "the width in --size", "height of a view": "the height in --size", "azimuth_deg": "--azimuth",
    "elevation_deg": "--elevation", "zoom": "--zoom", "fov_deg": "--fov (0 for orthographic)",
}  # fmt: skip
QUALITY_DB = {"draft": 35.0, "preview": 42.0, "good": 50.0, "best": 60.0}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("volume", metavar="VOLUME", help="file, folder of slices, pattern or sample:NAME")
    parser.add_argument(
        "--transfer",
        required=True,
        metavar="TF",
        help="transfer function file (.toml, .json) or preset: wide, narrow, opaque, xray or edges",
    )
    wanted = parser.add_mutually_exclusive_group()
    wanted.add_argument("--quality", choices=QUALITY_DB, help="error of the picture by word (default: good)")
    wanted.add_argument("--target-snr", type=float, metavar="DB", help="error of the picture in dB, 10 to 90")
    parser.add_argument(
        "--rule", default="auto", help="step rule: auto, uniform, thesis, error or cells (default: auto)"
    )
    parser.add_argument("--quadrature", default="auto", help="auto, midpoint or preintegrated (default: auto)")
    parser.add_argument(
        "--report", action="store_true", help="measure the error against a reference, beside uniform steps"
    )
    parser.add_argument(
        "--out", type=Path, help=".png, .exr or .npy; #### is a frame's number (default: the volume's name, .png)"
    )
    parser.add_argument(
        "--light", action="append", default=[], metavar="NAME", help="such as D65, A, HP1, or a file; repeatable"
    )
    parser.add_argument("--backend", default="llvm", choices=["llvm", "cuda"], help="processor or graphics card")
    _add_camera(parser.add_argument_group("camera"))
    _add_file(parser.add_argument_group("properties that the file does not state"))


def _add_camera(camera: Any) -> None:
    camera.add_argument("--size", type=int, nargs=2, default=[512, 512], metavar=("W", "H"), help="pixels (512 512)")
    camera.add_argument("--azimuth", type=float, default=35.0, help="degrees around z (35)")
    camera.add_argument("--elevation", type=float, default=25.0, help="degrees above the xy plane (25)")
    camera.add_argument("--zoom", type=float, default=1.0, help="1 shows the whole volume")
    camera.add_argument("--fov", type=float, default=30.0, help="degrees across the picture; 0 is orthographic (30)")


def _add_file(file: Any) -> None:
    file.add_argument("--field", help="array, grid or key, if the file has several")
    file.add_argument("--component", type=int, help="vector component, channel or time step")
    file.add_argument("--raw-shape", type=int, nargs=3, metavar=("NX", "NY", "NZ"), help="of a file of bare numbers")
    file.add_argument("--raw-type", metavar="TYPE", help="its NumPy type, such as uint8")
    file.add_argument("--raw-order", choices=["little", "big"], default="little", help="its byte order")
    file.add_argument("--raw-offset", type=int, default=0, help="bytes before its numbers; -1: they end the file")
    file.add_argument(
        "--spacing", type=float, nargs=3, metavar=("X", "Y", "Z"), help="voxel size, instead of the file's"
    )


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    if arguments.volume.startswith("sample:"):
        of_files = ("field", "component", "raw_shape", "raw_type", "raw_order", "raw_offset")
        return dict.fromkeys(of_files, "a sample is not read from a file")
    return without_companion(arguments, {"raw_order": "raw_shape", "raw_offset": "raw_shape"})


def run(arguments: argparse.Namespace) -> int:
    from spectral_core.cli.shared.outputs import numbered, require_apart, require_outputs
    from spectral_core.cli.shared.spectra import illuminant_named
    from spectral_core.spectra.pictures import require_ending
    from spectral_core.spectra.spectrum import told_apart

    out = require_ending(arguments.out or Path(f"{_stem(arguments.volume)}.png"))
    lights = told_apart([illuminant_named(name) for name in arguments.light])  # an unknown name ends the command here
    files = frames_of(arguments)
    outs = [out if frame.number is None else numbered(out, frame.number) for frame in files]
    targets = [path for each in outs for path in _targets(each, lights)]
    require_apart(targets, [frame.path for frame in files])
    transfer = transfer_of(arguments.transfer, files)
    require_outputs(targets)
    space = framed(files)
    frames = []
    for frame, path in zip(files, outs, strict=True):
        volume = frame.read()
        figures = _render(arguments, (volume, space or volume), transfer(volume), path, lights)
        frames.append(figures | ({} if frame.number is None else {"frame": frame.number}))
    if arguments.json:
        print_json(frames[0] if len(frames) == 1 and "frame" not in frames[0] else {"frames": frames})
    return 0


def _stem(volume: str) -> str:
    if volume.startswith("sample:"):
        return volume.split(":")[1] or "sample"
    name = Path(volume).name.removesuffix(".gz")
    return (Path(name).stem.rstrip("#*_.-") or "volume").replace("%", "")


def _estimate(chosen: Plan) -> str:
    if not math.isfinite(chosen.estimate_db):
        return "no error expected"
    if chosen.is_bound:
        return f"estimated at least {chosen.estimate_db:.1f} dB"
    low, high = chosen.interval_db
    return f"estimated {chosen.estimate_db:.1f} dB ({low:.1f} to {high:.1f})"


def _render(
    arguments: argparse.Namespace,
    shown: tuple[ScalarVolume, ScalarVolume],
    transfer: TransferFunction,
    path: Path,
    lights: Sequence[Illuminant],
) -> dict[str, Any]:
    """Render, write and report a volume (``shown``: it, and the one whose space the picture shows)."""
    from spectral_core.cli.shared.volume_report import report, why_empty
    from spectral_core.volume.plan import plan
    from spectral_core.volume.renderer import VolumeRenderer
    from spectral_core.volume.view import View

    volume, space = shown
    width, height = arguments.size
    view = View.around(
        space,
        arguments.azimuth,
        arguments.elevation,
        zoom=arguments.zoom,
        width=width,
        height=height,
        fov_deg=arguments.fov or None,
    )
    wanted = arguments.target_snr if arguments.target_snr is not None else QUALITY_DB[arguments.quality or "good"]
    renderer = VolumeRenderer(volume, arguments.backend)
    chosen = plan(renderer, view, transfer, wanted, rule=arguments.rule, quadrature=arguments.quadrature)
    way = chosen.stepping
    print(
        f"{volume.name}: {'×'.join(map(str, volume.shape))} {volume.data.dtype}; {way.rule} steps, {way.quadrature}, "
        f"scale {way.scale:.3g}; {_estimate(chosen)} for {wanted:g} dB ({chosen.seconds:.2f} s)"
    )
    if chosen.shortfall:
        print(f"note: {chosen.shortfall}")
    image = renderer.render(view, transfer, way, counts=True)
    figures: dict[str, Any] = {
        "volume": volume.name, "shape": list(volume.shape), "dtype": str(volume.data.dtype), "wanted_db": wanted,
        "rule": way.rule, "quadrature": way.quadrature, "scale": way.scale, "estimate_db": chosen.estimate_db,
        "interval_db": list(chosen.interval_db), "is_reached": chosen.is_reached,
        "estimate_is_bound": chosen.is_bound,
        "samples": image.samples, "steps": image.steps, "seconds": image.seconds, "plan_seconds": chosen.seconds,
    }  # fmt: skip
    # before printing, because the reader of the lines may close the pipe
    figures["pictures"] = _write_lights(lights, image, path)
    print(f"{image.samples:,} samples of non-zero opacity or emission, {image.steps:,} steps, {image.seconds:.3f} s")
    if not image.samples:
        print(f"note: the picture is empty; {why_empty(volume, transfer)}")
    for number, target in enumerate(figures["pictures"]):
        print(f"wrote {target}" + (f" ({lights[number].name})" if lights else ""))
    if arguments.report:
        figures["report"] = report(renderer, view, transfer, chosen, wanted)
    return figures


def _targets(path: Path, lights: Sequence[Illuminant]) -> list[Path]:
    """The picture's file, or one for each of several lights."""
    if len(lights) < 2:
        return [path]
    return [path.with_stem(f"{path.stem}_{name}") for name in file_words([light.name for light in lights])]


def _write_lights(lights: Sequence[Illuminant], image: Any, path: Path) -> list[str]:
    """One picture per light, all from the same amounts; the paths."""
    from spectral_core.spectra.pictures import write_picture
    from spectral_core.volume.image import combine
    from spectral_core.volume.mitsuba_integrator.illumination import display_matrix

    if not lights:
        write_picture(path, combine(image.amounts, display_matrix(image.transfer, None)))
        return [str(path)]
    targets = _targets(path, lights)
    for target, light in zip(targets, lights, strict=True):
        write_picture(target, combine(image.amounts, display_matrix(image.transfer, light)))
    return [str(target) for target in targets]
