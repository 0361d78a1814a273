# SPDX-License-Identifier: GPL-3.0-or-later
"""Code shared by the volume benchmarks: the fields, the metric, references and samples at equal SNR."""

from __future__ import annotations

import gzip
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import ROOT
from spectral_core.errors import UnknownNameError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping, palette_matrix
from spectral_core.volume.march.march_input import REFERENCE
from spectral_core.volume.pilot.rays import Pilot, snr_db
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.samples import sample_volume
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

REAL = ("hipip", "neghip", "hydrogen", "nut", "bolt", "vase", "headsq", "mni152", "stent", "embryo")
OWN = (("gaussians", 64), ("marschner-lobb", 64), ("shells", 128), ("engine", 128), ("noise", 48))


def shared_data() -> Path | None:
    """Folder of real volumes: SPECTRAL_SHARED_DATA, or shared/data beside the repository; None if absent."""
    places = [
        os.environ.get("SPECTRAL_SHARED_DATA"),
        ROOT.parent / "shared" / "data",
        ROOT.parents[1] / "shared" / "data",
    ]
    for place in places:
        if place and (Path(place) / "volumes").is_dir():
            return Path(place)
    return None


def load_nrrd(path: Path) -> ScalarVolume:
    """A gzip NRRD with attached data and space or axis spacings, as the shared volumes are."""
    raw = path.read_bytes()
    head, _, body = raw.partition(b"\n\n")
    fields = dict(
        line.split(":", 1) for line in head.decode("ascii").splitlines()[1:] if ":" in line and line[0] != "#"
    )
    fields = {key.strip(): value.strip(" =") for key, value in fields.items()}
    sizes = [int(n) for n in fields["sizes"].split()]
    kinds = {
        "uint8": "u1",
        "unsigned char": "u1",
        "uint16": "<u2",
        "unsigned short": "<u2",
        "uint8_t": "u1",
        "uint16_t": "<u2",
    }
    data = np.frombuffer(gzip.decompress(body), kinds[fields["type"]]).reshape(sizes, order="F")
    spacing = [float(s) for s in fields.get("spacings", "1 1 1").split()]
    return ScalarVolume.from_spacing(path.name.split(".")[0], data, spacing)


def all_volumes(quick: bool = False, names: list[str] | None = None) -> Iterator[ScalarVolume]:
    """Real volumes if present, then sample fields; a few small ones with ``quick``."""
    folder = shared_data()
    wanted = names or (["hipip", "gaussians"] if quick else [*REAL, *(name for name, _ in OWN)])
    sizes = dict(OWN)
    for name in wanted:
        if name in sizes:
            yield sample_volume(name, min(sizes[name], 32) if quick else sizes[name])
        elif names and not (folder and (folder / "volumes" / f"{name}.nrrd").is_file()):
            raise UnknownNameError(
                f"there is no volume {name!r}; real ones are read from volumes/{name}.nrrd under the folder that "
                f"SPECTRAL_SHARED_DATA names; the synthetic ones are {', '.join(sizes)}"
            )
        elif folder:
            yield load_nrrd(folder / "volumes" / f"{name}.nrrd")


def reference(renderer: VolumeRenderer, view: View, transfer: TransferFunction, target_db: float = 70.0) -> np.ndarray:
    """Linear colors to ``target_db`` and 15 dB more: fine steps, pre-integrated where the function has a table."""
    way = Stepping("error", "midpoint" if transfer.uses_gradient else "preintegrated")
    pilot = Pilot(renderer, view, transfer, target_db)
    scale = pilot.reference_scale
    image = renderer.render(view, transfer, Stepping(way.rule, way.quadrature, scale), limits=REFERENCE)
    return colors_of(image, transfer)


def colors_of(image: Any, transfer: TransferFunction) -> np.ndarray:
    """The picture in float64, for the metric."""
    return image.amounts.astype(np.float64) @ palette_matrix(transfer)


class Curve:
    """SNR, samples and iterations of one step rule near a wanted SNR, on the whole picture."""

    def __init__(self, renderer: VolumeRenderer, view: View, transfer: TransferFunction, exact: np.ndarray) -> None:
        self.renderer, self.view, self.transfer, self.exact = renderer, view, transfer, exact

    def point(self, stepping: Stepping) -> tuple[float, int, int]:
        image = self.renderer.render(self.view, self.transfer, stepping, counts=True)
        assert image.samples is not None and image.steps is not None
        return snr_db(self.exact, colors_of(image, self.transfer) - self.exact), image.samples, image.steps

    def at(self, stepping: Stepping, target_db: float, points: int = 5) -> dict[str, float]:
        """Samples, steps and scale at which ``target_db`` is first reached, from scales around ``stepping``'s.

        The SNR of uniform stepping wiggles as steps fall in and out of tune with the voxels; each way is given the
        best it has reached with so many samples, so that a lucky step counts for it.
        """
        rows: dict[float, tuple[float, int, int]] = {}
        middle = stepping.scale
        for _ in range(4):
            for scale in middle * np.exp(np.linspace(0.4, -0.4, points)):
                if not any(abs(np.log(scale / seen)) < 0.05 for seen in rows):
                    rows[float(scale)] = self.point(Stepping(stepping.rule, stepping.quadrature, float(scale)))
            reached = [snr for snr, _, _ in rows.values()]
            if min(reached) < target_db <= max(reached):
                break
            middle = (min(rows) * 0.67) if max(reached) < target_db else (max(rows) * 1.5)
        table = np.array([(np.log(scale), *row) for scale, row in sorted(rows.items(), reverse=True)])
        best = np.maximum.accumulate(table[:, 1]) + 1e-9 * np.arange(len(table))
        scale, samples, steps = (
            float(np.exp(np.interp(target_db, best, column)))
            for column in (table[:, 0], np.log(np.maximum(table[:, 2], 1)), np.log(np.maximum(table[:, 3], 1)))
        )
        return {"samples": samples, "steps": steps, "scale": scale, "reached": float(best[-1])}
