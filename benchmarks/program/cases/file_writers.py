# SPDX-License-Identifier: GPL-3.0-or-later
"""Every writer of the product, each with two contents: what ``fault-kill`` kills and ``fuzz`` mutates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Writer:
    """One way to write a file: ``write(path, version)`` for version 0 or 1; ``same`` compares two files of it."""

    name: str
    file_name: str
    write: Callable[[Path, int], object]
    read: Callable[[Path], Any] | None = None
    """Identifies the version of a file whose bytes differ between writings; None if they do not."""


def writers(side: int = 96) -> list[Writer]:
    """All writers, made once: their data are kept in memory.

    ``side``: pixels along an edge of the pictures, and twice the voxels along one of the volume.
    """
    return [*_documents(samples=20 * side), *_spectra(), *_pictures(side), *_volumes(side // 2)]


def _documents(samples: int) -> list[Writer]:
    from spectral_core.explore.board.recording import Recording
    from spectral_core.palette import presets, solve_palette
    from spectral_core.palette.files import swatches_of, write_palette, write_solution, write_swatches
    from spectral_core.volume.documents.transfer_file import write_transfer
    from spectral_core.volume.transfer import Material, TransferFunction

    palettes = [presets.hidden_mark(), presets.split_light()]
    solutions = [solve_palette(presets.hidden_mark()), solve_palette(presets.metamer_pair())]
    ramps = [TransferFunction((Material("m", [0, 1], [0, k + 1], [1, 0.5, 0.25]),)) for k in range(2)]
    times = np.arange(float(samples))
    motions = [Recording(("a", "b"), times, np.column_stack([times % (k + 2), times % 3]) / 3) for k in range(2)]
    return [
        Writer("palette.toml", "p.toml", lambda path, k: write_palette(path, palettes[k])),
        Writer("palette.json", "p.json", lambda path, k: write_palette(path, palettes[k])),
        Writer("solution", "s.json", lambda path, k: write_solution(path, solutions[k])),
        Writer("swatches.ase", "s.ase", lambda path, k: write_swatches(path, swatches_of(solutions[k]), clip=True)),
        Writer("swatches.gpl", "s.gpl", lambda path, k: write_swatches(path, swatches_of(solutions[k]), clip=True)),
        Writer("transfer", "t.toml", lambda path, k: write_transfer(path, ramps[k])),
        Writer("recording", "r.json", lambda path, k: motions[k].save(path)),
    ]


def _spectra() -> list[Writer]:
    from spectral_core.spectra import catalogue
    from spectral_core.spectra.files import read_spectrum, write_spectra

    lamps = [catalogue.illuminant("D65"), catalogue.illuminant("HP1")]

    def version(path: Path) -> int:
        return ["D65", "HP1"].index(read_spectrum(path).name)

    return [
        Writer("spectra.csv", "s.csv", lambda path, k: write_spectra(path, [lamps[k]])),
        Writer("spectra.spd", "s.spd", lambda path, k: write_spectra(path, [lamps[k]])),
        Writer("spectra.spdx", "s.spdx", lambda path, k: write_spectra(path, [lamps[k]]), version),
    ]


def _pictures(side: int) -> list[Writer]:
    from spectral_core.palette.texture.file import write_texture
    from spectral_core.palette.texture.reach import TEXTURE_GRID
    from spectral_core.palette.texture.texture import SpectralTexture
    from spectral_core.render.relight.page import write_page
    from spectral_core.render.relight.storage import MixtureStorage
    from spectral_core.render.relight.transport import Transport
    from spectral_core.render.relight.transport_file import write_transport
    from spectral_core.spectra import catalogue
    from spectral_core.spectra.pictures import write_picture

    rng = np.random.default_rng(7)
    pictures = [rng.random((side, side, 3)).astype(np.float32) for _ in range(2)]
    lights = (catalogue.illuminant("D65"), catalogue.illuminant("A"))
    transports = [
        Transport(
            MixtureStorage(),
            ("a", "b"),
            rng.random((2, 3, side, side)).astype(np.float32),
            np.ones((side, side), np.float32),
            lights,
            1.0,
            f"{k:064d}",
            4,
            k,
        )
        for k in range(2)
    ]
    weights = [np.full((2, side, side), 0.25 * (k + 1), np.float16) for k in range(2)]
    spectra = np.full((2, TEXTURE_GRID.size), 0.5)
    textures = [SpectralTexture(each, spectra, lights) for each in weights]
    return [
        Writer("picture.png", "p.png", lambda path, k: write_picture(path, pictures[k])),
        Writer("picture.exr", "p.exr", lambda path, k: write_picture(path, pictures[k])),
        Writer("picture.npy", "p.npy", lambda path, k: write_picture(path, pictures[k])),
        Writer("transport", "t.exr", lambda path, k: write_transport(path, transports[k])),
        Writer("texture", "x.exr", lambda path, k: write_texture(path, textures[k])),
        Writer("page", "p.html", lambda path, k: write_page(path, transports[k])),
    ]


def _volumes(side: int) -> list[Writer]:
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files import read_volume, write_volume
    from spectral_core.volume.files.formats import openvdb_format
    from spectral_core.volume.files.vdb.write import write_grid

    rng = np.random.default_rng(8)
    fields = [ScalarVolume(f"v{k}", rng.random((side,) * 3).astype(np.float32)) for k in range(2)]

    def version(path: Path) -> int:
        volume = read_volume(path)
        return next(k for k in range(2) if np.array_equal(volume.data, fields[k].data))

    def own(path: Path, k: int) -> None:
        from spectral_core.files.whole import whole_file

        with whole_file(path, check=openvdb_format.require_whole) as unfinished:
            write_grid(unfinished, fields[k].data, np.eye(4), "density", {})

    found = [Writer("volume.nrrd", "v.nrrd", lambda path, k: write_volume(fields[k], path), version)]
    if openvdb_format.find_openvdb() is not None:
        found.append(Writer("volume.vdb", "v.vdb", lambda path, k: write_volume(fields[k], path), version))
    return [*found, Writer("volume.vdb, own code", "o.vdb", partial(own), version)]
