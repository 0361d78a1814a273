# SPDX-License-Identifier: GPL-3.0-or-later
"""Color error and time by number of bands: relit from 31, 61 and 121 bands, by lamp, on measured and designed surfaces.

Colors are computed at 1 nm without noise: the product of a path's reflectances, and its approximation by bands.
A path that meets two surfaces has the product of their reflectances. One rendered scene checks the computation.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks.relight.cases.scenes import scenes, under_lights
from benchmarks.relight.relight_speed import filled
from spectral_core.palette.files import read_palette
from spectral_core.palette.presets import design_grid
from spectral_core.palette.solve import solve_palette
from spectral_core.render import render_scene
from spectral_core.render.relight.band_storage import BAND_COUNTS, BAND_ERRORS, BandStorage
from spectral_core.render.relight.mix import LiveMix, relight
from spectral_core.render.relight.sampling import SAMPLING_LIGHTS
from spectral_core.render.relight.transport import record_transport
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import STANDARD, normalized, observer
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]
EXAMPLES = Path(__file__).parents[2] / "examples"
PALETTES = ("metamer_pair", "hidden_mark", "split_light", "color_constancy", "most_distinct")
SMOOTH = ("A", "D50", "D65", "E", "LED-B1", "LED-B3", "LED-B5", "LED-V1")
LINES = ("FL2", "FL4", "FL8", "FL11", "FL12", "FL3.12", "HP1", "HP2", "HP4", "HP5")
LASERS = {"laser 532": (532,), "laser 589": (589,), "lasers 450, 532, 638": (450, 532, 638)}


def run(options: Options) -> dict[str, Any]:
    """Per number of bands: mean ΔE2000 of the worst lamp, all lamps' table, and times."""
    surfaces = _surfaces(40)
    lamps = [(catalogue.illuminant(name), "smooth") for name in SMOOTH]
    lamps += [(catalogue.illuminant(name), "lines") for name in LINES]
    lamps += [(laser(*lines, name=name), "laser") for name, lines in LASERS.items()]
    figures: dict[str, Any] = {"lamps": len(lamps), "surfaces": {kind: len(rows) for kind, rows in surfaces.items()}}
    errors = {count: {lamp.name: _errors(count, lamp, surfaces) for lamp, _ in lamps} for count in BAND_COUNTS}
    _print_table(errors, {lamp.name: kind for lamp, kind in lamps})
    for count in BAND_COUNTS:
        figures[str(count)] = _worst(errors[count], lamps, surfaces) | _times(count, options.quick)
        figures[str(count)]["any_laser"] = _any_laser(count, surfaces, 25 if options.quick else 2)
        figures[str(count)]["rendered"] = _rendered(count, options.quick)
        figures[str(count)]["stated"] = list(BAND_ERRORS[count])
        print(f"{count:4} bands: {_in_words(figures[str(count)])}")
    figures["holds"] = {
        f"{count} bands: no error is above the one that the panel states": all(
            found <= stated for found, stated in zip(_found(figures[str(count)]), BAND_ERRORS[count], strict=True)
        )
        for count in BAND_COUNTS
    }
    return figures


def _found(row: dict[str, Any]) -> tuple[float, float, float]:
    """The errors that the panel states: of smooth lamps, of lamps of lines, and of lasers."""
    laser_error = max(row["laser"]["worst_mean"], row["any_laser"])
    return row["smooth"]["worst_mean"], row["lines"]["worst_mean"], laser_error


def laser(*lines_nm: int, name: str = "laser") -> Illuminant:
    """Lines 2 nm wide at their feet, each of equal power."""
    values = sum(np.clip(1 - np.abs(WAVELENGTHS_NM - line), 0, None) for line in lines_nm)
    return Illuminant(name, SpectralGrid(WAVELENGTHS_NM), np.asarray(values))


def _surfaces(count: int) -> dict[str, Array]:
    """Reflectances (n, 471) at 1 nm of paths: a color chart, spiky designs, and those of the palettes in ``examples``,
    each once and twice.
    """
    rng = np.random.default_rng(7)
    chart = np.stack([catalogue.reflectance(name).at(WAVELENGTHS_NM) for name in catalogue.reflectance_names()])
    # Designs on a 10 nm grid tend to the bounds (bang-bang): knots at 0 or 1, and some in between. They end at 380 and
    # 780 nm, as palettes do.
    grid = design_grid()
    knots = rng.choice([0.0, 1.0, -1.0], size=(count, grid.size), p=[0.4, 0.4, 0.2])
    knots = np.where(knots < 0, rng.random((count, grid.size)), knots)
    spiky = knots @ grid.values_from_knots(WAVELENGTHS_NM).T
    solved = [solve_palette(read_palette(EXAMPLES / f"{name}.toml")).reflectances for name in PALETTES]
    palettes = np.stack([surface.at(WAVELENGTHS_NM) for surfaces in solved for surface in surfaces])
    found = {}
    for kind, once in {"chart": chart, "designed": spiky, "palettes": palettes}.items():
        pairs = rng.integers(0, len(once), (count, 2))
        found |= {kind: once, f"{kind}, two bounces": once[pairs[:, 0]] * once[pairs[:, 1]]}
    return found


def _errors(count: int, lamp: Spectrum, surfaces: dict[str, Array]) -> dict[str, Array]:
    """ΔE2000 of each path's color, its white being as bright as the lamp."""
    storage, light = BandStorage(count), normalized(Illuminant(lamp.name, lamp.grid, lamp.values))
    measured = storage.measured()
    assert measured is not None
    rgb_from_channels, cmfs = storage.rgb_from_channels(light), observer(STANDARD).cmfs
    found = {}
    for kind, rows in surfaces.items():
        true = rows * light.at(WAVELENGTHS_NM) @ cmfs.T @ RGB_FROM_XYZ.T
        relit = rows @ np.asarray(measured.responses).T @ rgb_from_channels.T
        found[kind] = delta_e_2000(lab_from_linear_rgb(relit), lab_from_linear_rgb(true))
    return found


def _worst(errors: dict[str, dict[str, Array]], lamps: list[Any], surfaces: dict[str, Array]) -> dict[str, Any]:
    """The mean over the surfaces of a kind, of the kind and lamp where it is largest."""
    figures: dict[str, Any] = {}
    for wanted in ("smooth", "lines", "laser"):
        names = [lamp.name for lamp, kind in lamps if kind == wanted]
        means = {(name, kind): float(errors[name][kind].mean()) for name in names for kind in surfaces}
        name, kind = max(means, key=lambda key: means[key])
        everything = np.concatenate([errors[n][k] for n in names for k in surfaces])
        figures[wanted] = {
            "worst_mean": means[name, kind], "lamp": name, "surfaces": kind,
            "p95": float(np.percentile(everything, 95)), "largest": float(everything.max()),
        }  # fmt: skip
    return figures


def _any_laser(count: int, surfaces: dict[str, Array], step: int) -> float:
    """Worst mean of a single laser anywhere from 410 to 690 nm."""
    return max(
        float(values.mean())
        for line in range(410, 691, step)
        for values in _errors(count, laser(line), surfaces).values()
    )


def _times(count: int, quick: bool) -> dict[str, float]:
    """New spectrum to pixels, 3 lights."""
    width, height = (192, 108) if quick else (1920, 1080)
    live = LiveMix(filled(BandStorage(count), width, height, np.random.default_rng(0)))
    for group in live.transport.groups:
        live.set_light(group, catalogue.illuminant("D65"))
    times = []
    for name in ("HP1", "A", "FL11", "D50", "FL2"):
        start = time.perf_counter()
        live.set_light("Key", catalogue.illuminant(name))
        live.picture([1, 1, 1])
        times.append(1000 * (time.perf_counter() - start))
    return {"new_spectrum_ms": float(np.median(times)), "megabytes": live.transport.channels.nbytes / 1e6}


def _rendered(count: int, quick: bool) -> float:
    """Mean ΔE2000 of a rendered corner under sodium, fluorescent and LED light; the same paths relit and rendered."""
    scene = scenes(*((16, 12) if quick else (64, 48)), 16)["corner"]
    spectra = {
        "Key": catalogue.illuminant("HP1"),
        "Fill": catalogue.illuminant("FL11"),
        "Sky": catalogue.illuminant("A"),
    }
    relit = relight(record_transport(scene, BandStorage(count)), lights=spectra)
    spectral = replace(scene, settings=replace(scene.settings, transport="spectral"))
    rendered = render_scene(under_lights(spectral, spectra), sampling_lights=SAMPLING_LIGHTS).pixels
    scale = 0.5 / rendered[..., 1].mean()
    return float(delta_e_2000(*(lab_from_linear_rgb(scale * each[..., :3]) for each in (relit, rendered))).mean())


def _print_table(errors: dict[int, dict[str, dict[str, Array]]], kinds: dict[str, str]) -> None:
    print("mean ΔE2000, on the chart | on designed surfaces, two bounces")
    print(f"{'':24}" + "".join(f"{count:>7} bands   " for count in BAND_COUNTS))
    for name, kind in kinds.items():
        row = [errors[count][name] for count in BAND_COUNTS]
        cells = [f"{each['chart'].mean():6.2f} |{each['designed, two bounces'].mean():6.2f} " for each in row]
        print(f"{name:20} {kind[:3]} " + "".join(cells))


def _in_words(figures: dict[str, Any]) -> str:
    smooth, lines = figures["smooth"], figures["lines"]
    return (
        f"worst mean {smooth['worst_mean']:.2f} under smooth lamps ({smooth['lamp']}, {smooth['surfaces']}), "
        f"{lines['worst_mean']:.2f} under sodium and fluorescent ({lines['lamp']}, {lines['surfaces']}), "
        f"{figures['laser']['worst_mean']:.2f} under lasers ({figures['laser']['lamp']}), "
        f"{figures['any_laser']:.2f} for any one laser; rendered corner {figures['rendered']:.2f}; "
        f"{figures['megabytes']:.0f} MB, {figures['new_spectrum_ms']:.0f} ms"
    )
