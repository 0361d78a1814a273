# SPDX-License-Identifier: GPL-3.0-or-later
"""A transfer function prepared for one field: its table, and its step grids, computed on demand."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.bricks import BrickStatistics
from spectral_core.volume.march.device.grid import DeviceGrid
from spectral_core.volume.march.device.table import DeviceTable
from spectral_core.volume.march.device.voxels import DeviceVolume
from spectral_core.volume.march.march_input import USUAL, Limits, MarchInput, no_integrals, quadratures_of
from spectral_core.volume.march.ranges import RangeTables
from spectral_core.volume.march.rules import Rule, step_grid
from spectral_core.volume.march.tables import TransferTable, tabulate
from spectral_core.volume.transfer import TransferFunction


class FieldOnDevice(Protocol):
    """Data of a field that do not depend on the transfer function."""

    types: Any
    volume: ScalarVolume
    device_volume: DeviceVolume

    @property
    def gradient(self) -> DeviceVolume:
        """Gradient magnitudes on the device."""

    def statistics(self, rule: Rule) -> BrickStatistics:
        """Brick statistics that ``rule`` needs."""


class PreparedTransfer:
    """The table and the step grids of ``transfer`` for ``field``."""

    def __init__(self, field: FieldOnDevice, transfer: TransferFunction) -> None:
        self.field = field
        self.gradient = field.gradient if transfer.uses_gradient else None
        highest = self.gradient.volume.value_range[1] if self.gradient else 0.0
        self.table: TransferTable = tabulate(transfer, field.volume, highest)
        self.weights = None
        if self.gradient and self.table.weights is not None:
            self.weights = DeviceTable(field.types, self.table.weights, self.gradient, integrals=False)
        self.ranges = RangeTables(self.table, float(np.prod(field.volume.voxel_size) ** (1 / 3)))
        self._grids: dict[Rule, DeviceGrid] = {}
        self._tables: dict[bool, DeviceTable] = {}

    def grid(self, rule: Rule) -> DeviceGrid:
        """The step grid of ``rule`` on the device."""
        rule = "error" if rule == "cells" else rule  # these differ in the march, not in their grid
        if rule not in self._grids:
            made = step_grid(rule, self.field.statistics(rule), self.ranges, self.field.device_volume.unit)
            self._grids[rule] = DeviceGrid(self.field.types, made, self.field.volume.shape)
        return self._grids[rule]

    def march_input(self, stepping: Stepping, limits: Limits = USUAL) -> MarchInput:
        """The input of ``march``; numbers that may change without a new kernel are opaque."""
        import drjit as dr

        with_integrals = stepping.quadrature == "preintegrated"
        if stepping.quadrature not in quadratures_of(self.gradient is not None):
            raise no_integrals()
        types, volume = self.field.types, self.field.device_volume
        if with_integrals not in self._tables:
            self._tables[with_integrals] = DeviceTable(types, self.table, volume, integrals=with_integrals)
        scale, floor, most_stretch, shortest = (
            dr.opaque(types.Float, float(v))
            for v in (stepping.scale, limits.least_transmittance, limits.most_stretch, limits.shortest_step)
        )
        return MarchInput(
            volume,
            self.grid(stepping.rule),
            self._tables[with_integrals],
            scale,
            stepping.quadrature,
            floor,
            most_stretch,
            shortest,
            limits.ends_at_faces or stepping.rule == "cells",
            limits.approaches,
            limits.ends_at_turns and with_integrals,
            self.gradient,
            self.weights,
        )
