# SPDX-License-Identifier: GPL-3.0-or-later
"""From a texture project to its files and figures; ``texture`` and ``design`` share it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spectral_core.cli.shared.report import print_json

if TYPE_CHECKING:
    from spectral_core.palette.texture.project import TextureOutcome, TextureProject

WHITE_AT_DELTA_E = 10.0
NOTICED_DELTA_E = 1.0
PROGRESS = "progress"
"""First word of the lines that report progress: ``progress 0.45 spectra``."""


WRITTEN = (
    "texture.exr", "lights.csv", "shown_1.png", "shown_2.png", "lost_1.png", "lost_2.png", "report.json"
)  # fmt: skip
"""Names of all files that a texture may write."""


def make_texture(
    project: TextureProject, folder: Path, *, read: Iterable[str | Path], as_json: bool, tell: bool
) -> int:
    """Design, write the files into ``folder``, print the figures; exit status 0.

    ``read``: files that the project came from, beside its pictures; none of them is written over.
    """
    from spectral_core.cli.shared.outputs import require_outputs
    from spectral_core.files.whole_set import whole_files
    from spectral_core.palette.texture.project import run_project
    from spectral_core.palette.texture.texture import Picture, require_one_size
    from spectral_core.render.images.pictures import read_picture

    def progress(share: float, what: str) -> None:
        if tell:
            print(f"{PROGRESS} {share:.3f} {what}", flush=True)

    pictures = [Picture(path.stem, read_picture(path)) for path in project.pictures]
    require_one_size(pictures)
    require_outputs([folder / name for name in WRITTEN], [*project.pictures, *read])
    outcome = run_project(project, pictures, progress)
    figures = figures_of(outcome)
    with whole_files(folder) as unfinished:  # a new texture beside earlier lights would show neither picture
        written = _write(unfinished, outcome, figures, progress)
    progress(1.0, "done")
    _print(outcome, figures)  # after the files, because the reader of the lines may close the pipe
    for note in outcome.notes:
        print(f"note: {note}")
    print(f"written to {folder}: {', '.join(written)}")
    if as_json:
        print_json(figures | {"out": str(folder), "files": written})
    return 0


def figures_of(outcome: TextureOutcome) -> dict[str, Any]:
    """Contents of the report: contrast, losses, whites for other observers, wanted colors."""
    from spectral_core.palette.texture.realism import white_differences

    design = outcome.design
    figures: dict[str, Any] = {
        "floor": design.floor,
        "slope": design.slope,
        "exact_slope": design.stated_slope,
        "spectra": len(design.texture.spectra),
        "size": list(design.texture.weights.shape[1:]),
        "compressed_share": design.compressed,
        "pictures": [
            {
                "name": loss.name, "mean_delta_e": loss.mean, "p95_delta_e": loss.p95, "p99_delta_e": loss.p99,
                "largest_delta_e": loss.largest, "contrast": loss.contrast, "ghost": loss.ghost,
            }
            for loss in design.losses
        ],
        "whites": [
            {"observer": each.observer, "between_delta_e": each.between, "to_daylight_delta_e": each.to_daylight}
            for each in white_differences(design.texture.lights)
        ],
        "seconds": design.seconds,
        "notes": list(outcome.notes),
    }  # fmt: skip
    if outcome.allowed is not None:
        figures |= {"allowed_slope": outcome.allowed.slope, "allowed_contrast": outcome.allowed.contrast}
    if outcome.designed_lights is not None:
        figures |= {
            "white_delta_e": list(outcome.designed_lights.white_delta_e),
            "light_seconds": outcome.designed_lights.seconds,
        }
    if outcome.wanted_colors:
        figures["wanted_colors"] = [
            {
                "color": each.color.tolist(), "delta_e": each.delta_e, "reachable": each.reachable,
                "nearest": each.nearest.tolist(), "delta_e_to_nearest": each.delta_e_nearest,
            }
            for each in outcome.wanted_colors
        ]  # fmt: skip
    return figures


def _observer_named(name: str) -> str:
    """``cie_1964_10deg`` as people write it: CIE 1964 10°."""
    return name.replace("cie_", "CIE ").replace("_", " ").replace("deg", "°")


def _print(outcome: TextureOutcome, figures: dict[str, Any]) -> None:
    from spectral_core.spectra.color import display_hex_from_linear

    design, designed = outcome.design, outcome.designed_lights
    if designed is not None:
        print(
            f"designed two lights in {designed.seconds:.1f} s: unrelated pictures have a contrast of up to "
            f"{(designed.floor + designed.slope) / designed.floor:.2g}:1, their whites differ from D65 by ΔE2000 "
            f"{max(designed.white_delta_e):.3f}"
        )
        others = ", ".join(
            f"{_observer_named(each['observer'])}: {each['to_daylight_delta_e']:.1f}" for each in figures["whites"][1:]
        )
        print(f"for other observers the whites differ from D65 by ΔE2000: {others}")
    elif outcome.allowed is not None:
        print(
            f"these lights allow unrelated pictures a contrast of {outcome.allowed.contrast:.2g}:1 at floor "
            f"{outcome.allowed.floor:g}"
        )
    print(
        f"{figures['spectra']} spectra; black is shown as {design.floor:g} and white as "
        f"{design.floor + design.slope:.3g}; "
        f"{100 * design.compressed:.1f} % of the texels show the nearest colors that these spectra can have"
    )
    for loss in design.losses:
        ghost = f", ghost of the other picture {loss.ghost:.3f}" if len(design.losses) > 1 else ""
        print(
            f"{loss.name}: ΔE2000 mean {loss.mean:.3f}, 99 % {loss.p99:.2f}, largest {loss.largest:.2f}; "
            f"details kept {loss.contrast:.2f}{ghost}"
        )
    for number, each in enumerate(outcome.wanted_colors, 1):
        shown = display_hex_from_linear(each.nearest)
        nearest = "" if each.reachable else f"; the nearest color that these spectra can show is {shown}"
        print(f"wanted color {number}: ΔE2000 {each.delta_e:.2f}{nearest}")
    if max(loss.mean for loss in design.losses) > NOTICED_DELTA_E:
        print(
            "these lights cannot show both pictures with this contrast: lower --slope, raise --floor, give --exact, "
            "favor one picture with --importance, or leave out --light to have the lights designed"
        )


def _write(
    folder: Path, outcome: TextureOutcome, figures: dict[str, Any], progress: Callable[[float, str], None]
) -> list[str]:
    from spectral_core.files.whole import write_text
    from spectral_core.palette.texture.file import write_texture
    from spectral_core.spectra.files import write_spectra
    from spectral_core.spectra.pictures import write_png_rows

    design = outcome.design
    texture = design.texture
    size = (texture.weights.shape[1], texture.weights.shape[2])
    progress(0.95, "writing")
    write_texture(folder / "texture.exr", texture)
    write_spectra(folder / "lights.csv", list(texture.lights))
    names = ["texture.exr", "lights.csv"]
    for number, light in enumerate(texture.lights, 1):

        def shown(first: int, last: int, light: Any = light) -> Any:
            return texture.rows(light, first, last)

        write_png_rows(folder / f"shown_{number}.png", size, shown)
        names.append(f"shown_{number}.png")
    for number, loss in enumerate(design.losses, 1):

        def lost(first: int, last: int, delta_e: Any = loss.delta_e) -> Any:
            shares = np.minimum(delta_e[first:last].astype(np.float32) / WHITE_AT_DELTA_E, 1.0)
            return np.repeat(shares[..., None], 3, axis=2)

        write_png_rows(folder / f"lost_{number}.png", size, lost)
        names.append(f"lost_{number}.png")
    write_text(folder / "report.json", json.dumps(figures, indent=1))
    return [*names, "report.json"]
