# SPDX-License-Identifier: GPL-3.0-or-later
"""The import of volumes: files are read and written without Blender, so that a thread can do it."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from bpy.types import Context, Volume
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, RenderCancelled

from ... import compat
from ...properties.volume import RANGE_KEY
from ...translate.volume_looks import transfer as volume_transfer

if TYPE_CHECKING:
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files.sequence import VolumeSequence


@dataclass
class Import:
    """The files to import, and how; ``read`` reads nothing from Blender.

    Parameters
    ----------
    paths
        Of the files; of a sequence, one of its files.
    options
        Of ``read_volume``.
    key
        Text on the options, by which imports of one file with different options differ.
    folder
        For the OpenVDB files.
    preset
        Name of the preset of their transfer functions.
    is_sequence
        True if the file belongs to a sequence of frames, all of which are imported.
    centered
        True if the middle of the volume comes to the origin of its object.
    stopping
        Once it is set, no further file is begun.
    progress
        Text on a sequence that is being read; ``read`` changes it.
    """

    paths: list[Path]
    options: dict[str, Any]
    key: str
    folder: Path
    preset: str
    is_sequence: bool
    centered: bool
    stopping: threading.Event
    progress: str = ""

    def read(self) -> list[Imported]:
        """Read all files and write the OpenVDB files. Raises SpectralError and OSError."""
        return [self._one(path) for path in self.paths]

    def _one(self, path: Path) -> Imported:
        from spectral_core.volume.documents.transfer_document import stated_in_fractions
        from spectral_core.volume.files import read_volume, sequence_of
        from spectral_core.volume.fill_values import fill_values_note
        from spectral_core.volume.presets import preset

        frames, warnings = None, []
        if self.is_sequence:
            frames = sequence_of(path, **self.options)
            if frames is None:
                raise InvalidInputError(
                    f"{path.name} is no frame of a sequence: no other file differs in its number only"
                )
            if frames.missing_note:
                warnings.append(frames.missing_note)
        self._require_wanted()
        first = read_volume(path, **self.options) if frames is None else frames.first()
        self._require_wanted()
        made, widest = self._written(path, first, frames)
        note = fill_values_note(first.data, first.range_without_fill_values)
        made.warnings = [*warnings, *([f"{first.name}: {note}"] if note else [])]
        # fitted to one frame, and stretched to the range of all, as on the command line: the first one may be empty
        made.look = stated_in_fractions(preset(self.preset, widest), widest)
        return made

    def _written(self, path: Path, first: ScalarVolume, frames: VolumeSequence | None) -> tuple[Imported, ScalarVolume]:
        """Write the OpenVDB files; also returns the frame of the widest range. A centered volume has its origin in its
        middle.
        """
        from spectral_core.volume.files import write_volume

        low, high = first.range_without_fill_values
        whole_low, whole_high = first.value_range
        widest = first
        shift = -first.corners_world.mean(axis=0) if self.centered else np.zeros(3)
        files = [path] if frames is None else [file for _, file in frames.frames]
        # the times of a header without data and of a folder of slices do not tell whether the voxels are others
        voxels = hashlib.sha256(np.ravel(first.data, order="A").data).hexdigest()
        key = f"{self.key} {self.centered} {voxels}"
        stem = _stem(path if frames is None else Path(frames.pattern), files, key)
        if frames is None:
            target = self.folder / f"{stem}.vdb"
            write_volume(_moved(first, shift), target)
        else:
            # Consecutive numbers, because Blender counts frames from the first file's.
            for place, number in enumerate(frames.numbers, 1):
                self._require_wanted()
                self.progress = f"frame {place} of {len(frames)}"
                volume = frames.read(number)
                own = volume.range_without_fill_values
                low, high = min(low, own[0]), max(high, own[1])
                widest = volume if np.ptp(own) > np.ptp(widest.range_without_fill_values) else widest
                whole_low, whole_high = min(whole_low, volume.value_range[0]), max(whole_high, volume.value_range[1])
                write_volume(_moved(volume, shift), self.folder / f"{stem}_{place:04d}.vdb")
            target = self.folder / f"{stem}_0001.vdb"
        facts = f"{' × '.join(map(str, first.shape))} voxels of {first.data.dtype}, {whole_low:g} to {whole_high:g}"
        # The viewport shows the data as smoke: nearly opaque over its whole depth.
        voxel = float(np.prod(first.voxel_size) ** (1 / 3))
        density = 20.0 / max(abs(high), abs(low), 1e-9) / (max(first.shape) * voxel)
        longest = float(np.ptp(first.corners_world, axis=0).max())
        frame_count = 0 if frames is None else len(frames)
        ends = float(low), float(high)
        return Imported(first.name, path, target, frame_count, ends, facts, density, longest), widest

    def _require_wanted(self) -> None:
        if self.stopping.is_set():
            raise RenderCancelled("stopped; nothing was imported")


@dataclass
class Imported:
    """A volume that was read and written. ``frames``: their number in a sequence, else 0; ``longest``: length of its
    longest side.
    """

    name: str
    source: Path
    target: Path
    frames: int
    range: tuple[float, float]
    facts: str
    density: float
    longest: float
    warnings: list[str] = field(default_factory=list)
    look: Any = None

    def made(self) -> Volume:
        """A new data-block of it."""
        data = bpy.data.volumes.new(self.name)
        try:
            if self.frames:
                data.is_sequence, data.frame_start, data.frame_duration = True, 1, self.frames
            data.filepath = bpy.path.relpath(str(self.target)) if bpy.data.filepath else str(self.target)
            data[RANGE_KEY] = list(self.range)
            data.spectral.source, data.spectral.facts = str(self.source), self.facts
            data.display.density = self.density
            volume_transfer.store_transfer(data, self.look)
        except Exception:
            bpy.data.volumes.remove(data)
            raise
        return data

    def add_to(self, context: Context, scene: bpy.types.Scene, size: float) -> None:
        """Add an object of it at the cursor; its longest side has the length ``size``."""
        shown = bpy.data.objects.new(self.name, self.made())
        if size:
            shown.scale = (size / self.longest,) * 3
            shown.location = scene.cursor.location
        compat.collection_for_new(context, scene).objects.link(shown)
        if scene != context.scene:  # the window shows another scene by now
            return
        for other in context.selected_objects:
            other.select_set(False)
        shown.select_set(True)
        context.view_layer.objects.active = shown


def _moved(volume: ScalarVolume, shift: NDArray[np.float64]) -> ScalarVolume:
    """The same volume at another position."""
    from spectral_core.volume.field import ScalarVolume

    matrix = volume.world_from_index.copy()
    matrix[:3, 3] += shift
    return ScalarVolume(volume.name, volume.data, matrix)


def _stem(path: Path, files: Sequence[Path], key: str) -> str:
    """A file name that identifies the source and its version, so that no other volume's file is overwritten.

    ``path``: of the file, or the pattern of a sequence; ``files``: those that are read; ``key``: text on the options
    and the voxels.
    """
    states = [each.stat() for each in files]
    state = "; ".join(
        f"{file.name} {each.st_mtime_ns} {each.st_size}" for file, each in zip(files, states, strict=True)
    )
    plain = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in path.name.split(".")[0])
    mark = hashlib.sha256(f"{path.resolve()} {state} {key}".encode()).hexdigest()[:8]
    return f"{plain.strip('_') or 'volume'}_{mark}"
