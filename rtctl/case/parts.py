"""Sensors, drive and tolerances in a case of exchange format 1."""

import math
from typing import Literal

from pydantic import Field

from rtctl.case.checks import Part
from rtctl.machines.exchange import DAMPING


class Sensors(Part):
    capstan_counts_per_rev: float | None = Field(None, gt=0)
    reel_counts_per_rev: float | None = Field(None, gt=0)
    encoder_counts_per_rev: float | None = Field(None, gt=0)
    scale_m_per_count: float | None = Field(None, gt=0)
    x_counts_per_rev: float | None = Field(None, gt=0)
    x_resolution_m: float | None = Field(None, ge=0)
    unit: Literal["m", "rad", "V"] | None = None  # of x
    column: str | None = None  # column of x


class Drive(Part):
    amp_per_volt: tuple[float, ...] = ()
    limit_volt: float | None = Field(None, gt=0)
    dac_bits: int | None = Field(None, ge=2, le=32)
    dac_range_volt: float = Field(10.0, gt=0)
    bandwidth_hz: float | None = Field(None, gt=0)
    damping: float | None = Field(None, gt=0)
    current_limit: float | None = Field(None, gt=0)  # A
    newton_per_volt: float | None = Field(None, gt=0)
    newton_metre_per_ampere: float | None = Field(None, gt=0)
    newton_metre_per_volt: float | None = Field(None, gt=0)
    column: str | None = None  # original name of the recorded command
    unit: Literal["V", "A", "N", "Nm"] = "V"  # of the command

    @property
    def late(self) -> float:
        """Low-frequency delay of the drive's second-order low pass, in s; 0 without a bandwidth."""
        if self.bandwidth_hz is None:
            return 0.0
        return 2 * (self.damping or DAMPING) / (2 * math.pi * self.bandwidth_hz)

    @property
    def step_volt(self) -> float | None:
        """One step of the DAC in V."""
        return None if self.dac_bits is None else 2 * self.dac_range_volt / 2**self.dac_bits


class Reaches(Part):
    parameter_tolerance: float | None = Field(0.15, ge=0)  # relative; None: unlimited
    radius_tolerance: float | None = Field(None, ge=0)  # None: as the other parameters
