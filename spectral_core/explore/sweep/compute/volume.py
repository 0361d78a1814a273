# SPDX-License-Identifier: GPL-3.0-or-later
"""A volume's rendering as a compute node: its transfer function, its view and the steps of the march are swept."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.explore.features.images import image_features
from spectral_core.explore.sweep.compute.paths import place_of, require_set_once, set_path
from spectral_core.explore.sweep.files import json_text
from spectral_core.explore.sweep.outcome import Outcome
from spectral_core.explore.sweep.parameters import Space, Value

SETTINGS: dict[str, Value] = {
    "rule": "error", "quadrature": "midpoint", "scale": 1.0, "azimuth": 35.0, "elevation": 25.0, "zoom": 1.0,
}  # fmt: skip
"""Names that can be swept, and their values if they are not."""
TRANSFER = "transfer."
SAMPLE_SIZE = 64


@dataclass(frozen=True)
class VolumeNode:
    """Renders a volume through a transfer function.

    ``volume``: a file, or ``sample:NAME:SIZE``. ``transfer``: its document as JSON, or the name of a preset. ``paths``
    by parameter: a name of ``SETTINGS``, or ``transfer.`` and a path in the document.
    """

    volume: str
    transfer: str
    folder: str
    paths: tuple[tuple[str, str], ...]
    settings: tuple[tuple[str, Value], ...] = ()
    size: tuple[int, int] = (256, 256)
    fingerprint: str = ""
    _kept: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def of(
        cls,
        volume: str,
        transfer: str,
        space: Space,
        folder: Path | None = None,
        *,
        settings: Mapping[str, Value] | None = None,
        size: tuple[int, int] = (256, 256),
    ) -> VolumeNode:
        """The node of a volume and a transfer function; checks every path.

        Parameters
        ----------
        volume : a file, or sample:NAME:SIZE.
        transfer : a file, or the name of a preset.
        space : the parameters.
        folder : where relative files are sought.
        settings : values of ``SETTINGS`` that hold for every point.
        size : pixels of the picture.
        """
        from spectral_core.volume.image import MOST_SCALE, Stepping
        from spectral_core.volume.presets import PRESETS
        from spectral_core.volume.samples import sample_named

        base = (folder or Path()).resolve()
        text = transfer
        contents = [hashlib.sha256(b"").hexdigest()]
        if volume.startswith("sample:"):
            sample_named(volume, SAMPLE_SIZE)
        else:
            volume = str((base / volume).resolve())
            contents = _hashes(Path(volume))
        if min(size) < 1:
            raise InvalidInputError(f"the size of the pictures is {list(size)}; expected two whole numbers from 1")
        if Path(transfer).suffix.lower() in (".toml", ".json"):
            from spectral_core.volume.documents.transfer_document import document_of
            from spectral_core.volume.documents.transfer_file import read_transfer

            text = json_text(document_of(read_transfer(base / transfer)))
        elif transfer not in PRESETS:
            raise UnknownNameError.among("transfer function preset", transfer, PRESETS)
        paths = tuple((parameter.name, parameter.target) for parameter in space.parameters)
        for name in settings or {}:
            if name not in SETTINGS:
                raise UnknownNameError.among("setting of a volume", name, SETTINGS)
        node = cls(volume, text, str(base), paths, tuple(sorted((settings or {}).items())), size)
        for parameter in space.parameters:
            for value in parameter.choices or (parameter.value(0.0), parameter.value(1.0)):
                chosen, _ = node._with(parameter.target, value, {**SETTINGS, **dict(node.settings)}, node._document())
                require_range("the scale of the steps", chosen["scale"], 1e-6, MOST_SCALE)  # type: ignore[arg-type]
                Stepping(chosen["rule"], chosen["quadrature"])  # type: ignore[arg-type]
        require_set_once(
            [(f"the setting {name}", name) for name, _ in node.settings]
            + [(f"the parameter {name}", node._place(path)) for name, path in paths]
        )
        # by its contents, not its folder, which may be moved with the sweep
        named = volume if volume.startswith("sample:") else Path(volume).name
        said = json_text([named, *contents, text, [list(p) for p in paths], size, dict(node.settings)])
        return replace(node, fingerprint=hashlib.sha256(said.encode()).hexdigest())

    def __call__(self, parameters: Mapping[str, Value], seed: int) -> Outcome:
        from spectral_core.volume.image import Stepping, combine
        from spectral_core.volume.mitsuba_integrator.illumination import display_matrix
        from spectral_core.volume.view import View

        settings, document = {**SETTINGS, **dict(self.settings)}, self._document()
        for name, path in self.paths:
            settings, document = self._with(path, parameters[name], settings, document)
        renderer = self._renderer()
        way = Stepping(settings["rule"], settings["quadrature"], float(settings["scale"]))  # type: ignore[arg-type]
        azimuth, elevation, zoom = (float(settings[name]) for name in ("azimuth", "elevation", "zoom"))
        width, height = self.size
        view = View.around(renderer.volume, azimuth, elevation, zoom=zoom, width=width, height=height)
        transfer = self._transfer(document)
        image = renderer.render(view, transfer, way, counts=True)
        picture = combine(image.amounts, display_matrix(transfer, None))
        values: dict[str, float | int | str] = dict(image_features(picture))
        values |= {
            "march_samples": int(image.samples or 0),
            "march_steps": int(image.steps or 0),
            "march_seconds": image.seconds,
        }
        return Outcome(values, {"": picture})

    def _document(self) -> Any:
        return json.loads(self.transfer) if self.transfer.startswith("{") else None

    def _place(self, path: str) -> Any:
        """The place that a path sets, equal for each way to write it."""
        return path if path in SETTINGS else place_of(self._document(), path.removeprefix(TRANSFER))

    def _with(self, path: str, value: Value, settings: dict[str, Value], document: Any) -> tuple[dict[str, Value], Any]:
        if path in SETTINGS:
            if isinstance(value, str) != isinstance(SETTINGS[path], str):
                raise InvalidInputError(f"{path} of a volume cannot be {value!r}")
            return {**settings, path: value}, document
        if not path.startswith(TRANSFER):
            raise UnknownNameError.among("property of a volume's look", path, [*SETTINGS, "transfer.…"])
        if document is None:
            raise InvalidInputError(f"{path} needs a transfer function file; {self.transfer!r} is a preset")
        return settings, set_path(document, path.removeprefix(TRANSFER), value)

    def _transfer(self, document: Any) -> Any:
        volume = self._renderer().volume
        if document is None:
            from spectral_core.volume.presets import preset

            return self._kept.setdefault("preset", preset(self.transfer, volume))
        from spectral_core.volume.documents.transfer_document import transfer_of

        return transfer_of(document, Path(self.folder)).for_volume(volume)

    def _renderer(self) -> Any:
        if "renderer" not in self._kept:
            from spectral_core.volume.files import read_volume
            from spectral_core.volume.renderer import VolumeRenderer
            from spectral_core.volume.samples import sample_named, sample_volume

            if self.volume.startswith("sample:"):
                volume = sample_volume(*sample_named(self.volume, SAMPLE_SIZE))
            else:
                volume = read_volume(self.volume)
            self._kept["renderer"] = VolumeRenderer(volume, "llvm")
        return self._kept["renderer"]

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": {}}

    def describe(self) -> list[str]:
        """Sentences for the plan of a run."""
        return ["marches in workers that keep the volume on the device; a swept number compiles nothing"]


def _hashes(path: Path) -> list[str]:
    """Hashes of the file of a volume, and of its numbers if these are in other files. Raises SpectralError."""
    from spectral_core.volume.files import read_volume
    from spectral_core.volume.files.formats.raw_format import HEADERS

    if not path.exists():
        raise InvalidInputError(f"there is no file {path}; check its name and its folder")
    found = [hashlib.sha256(path.read_bytes() if path.is_file() else b"").hexdigest()]
    if path.is_dir() or path.suffix.lower() in HEADERS:
        found.append(hashlib.sha256(read_volume(path).data.tobytes(order="A")).hexdigest())
    return found
