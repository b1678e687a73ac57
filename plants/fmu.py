"""Co-simulation FMU instead of a machine's own equations, from the drives' volts to the sensors.

    plant:
      fmu: {file: carriage.fmu, inputs: {drive: u}, outputs: {sensor: x}, parameters: {m: 80}}

The names on the left are the machine's (`rtctl.machines.wiring`), those on the right the FMU's. The FMU's units are
converted; board, converters and encoders stay emulated. The FMU runs in lockstep, one communication step in `ticks`
ticks.

Source: FMI 2.0.4 and 3.0.1 (fmi-standard.org); FMPy loads and calls it.
"""

import math
import re
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import Field, ValidationInfo, field_validator

from rtctl.config.errors import UserError, nearest
from rtctl.config.units import convert
from rtctl.idiom import Settings
from rtctl.plants.fmu_file import describe, instance, major, unpack

REALS = ("Real", "Float64")


class FmuSettings(Settings):
    """FMU file, and the variables of the FMU that are the machine's drives and sensors."""

    file: str = Field(description="path of the .fmu file, from the folder of the config")
    inputs: dict[str, str] = Field(description="the machine's drives: variables of the FMU, e.g. {drive: u}")
    outputs: dict[str, str] = Field(description="the machine's sensors: variables of the FMU, e.g. {sensor: x}")
    units: dict[str, str] = Field(
        default={}, description="units of variables for which the FMU gives none, e.g. {x: mm}"
    )
    parameters: dict[str, float] = Field(default={}, description="start values of variables of the FMU, in its units")
    ticks: int = Field(default=1, ge=1, le=1000, description="ticks of the loop in one communication step")

    @field_validator("file")
    @classmethod
    def _beside_the_config(cls, value: str, info: ValidationInfo) -> str:
        beside = (info.context or {}).get("folder", Path()) / value
        return str(beside.resolve()) if beside.is_file() else value


class Fmu:
    """One instance, from its start values. `drives`, `sensors`: terminals with `name` and `unit`; `dt`: of a tick, s.

    Raises UserError where file, platform, kind, variables or units do not fit.
    """

    def __init__(self, settings: FmuSettings, drives: Sequence[Any], sensors: Sequence[Any], dt: float) -> None:
        self.settings = settings
        self._folder: Path | None = None
        self._fmu: Any = None
        self._model, self._in, self._out, self._set = plan(settings, drives, sensors, dt)
        self.h = dt * settings.ticks
        self.time = 0.0
        self._ticks = 0
        try:
            self._start()
        except BaseException:
            self.close()
            raise
        self.readings = self._read()

    def _start(self) -> None:
        from fmpy.fmi1 import FMICallException

        self._folder = Path(tempfile.mkdtemp())
        unpack(self.settings.file, self._folder)
        try:
            self._fmu = instance(self._folder, self._model)
            self._second = major(self._model) == 2
            self._write_reals = self._fmu.setReal if self._second else self._fmu.setFloat64
            self._read_reals = self._fmu.getReal if self._second else self._fmu.getFloat64
            if self._set:
                self._write_reals([r for r, _ in self._set], [v for _, v in self._set])
            if self._second:
                self._fmu.setupExperiment(startTime=0.0)
            self._fmu.enterInitializationMode()
            self._fmu.exitInitializationMode()
        except FMICallException as error:
            raise UserError(f"{self._where}: it does not start ({error}); see its parameters") from error
        except UserError as error:
            raise UserError(f"{self._where}: {error}") from error
        except Exception as error:  # FMPy raises plain exceptions where a library does not load
            raise UserError(f"{self._where}: it cannot be loaded: {error}") from error

    @property
    def _where(self) -> str:
        return f"plant.fmu: {self.settings.file}"

    def tick(self, volts: Sequence[float]) -> Sequence[float]:
        """One tick with `volts` at the drives (V); returns the sensors' readings, in the machine's units.

        Raises UserError where the FMU refuses its step, with the time.
        """
        if self._ticks % self.settings.ticks == 0:
            from fmpy.fmi1 import FMICallException

            try:
                self._write_reals([r for r, _ in self._in], [v * f for v, (_, f) in zip(volts, self._in, strict=True)])
                done = self._fmu.doStep(currentCommunicationPoint=self.time, communicationStepSize=self.h)
                self.readings = self._read()
            except FMICallException as error:
                raise UserError(f"{self._where}: {error} at {self.time:.6g} s of its time") from error
            if done is not None and done[1]:
                raise UserError(f"{self._where}: it asks to end the simulation at {self.time:.6g} s of its time")
            self.time = self.h * (self._ticks // self.settings.ticks + 1)
        self._ticks += 1
        return self.readings

    def _read(self) -> list[float]:
        values = self._read_reals([r for r, _ in self._out])
        readings = [v / f for v, (_, f) in zip(values, self._out, strict=True)]
        if not all(map(math.isfinite, readings)):
            raise UserError(f"{self._where}: its outputs are {values} at {self.time:.6g} s of its time")
        return readings

    def close(self) -> None:
        """End the instance and remove the unpacked files."""
        if self._fmu is not None:
            self._fmu.freeInstance()
            self._fmu.freeLibrary()
            self._fmu = None
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None


class Plan(NamedTuple):
    """Value references of an FMU, each with the factor of its unit, or with its start value."""

    model: Any
    inputs: list[tuple[int, float]]
    outputs: list[tuple[int, float]]
    parameters: list[tuple[int, float]]


def plan(settings: FmuSettings, drives: Sequence[Any], sensors: Sequence[Any], dt: float) -> Plan:
    """Check an FMU against a machine without loading its library. Raises UserError where they do not fit."""
    model = describe(settings.file)
    _check_step(settings, model, dt * settings.ticks)
    variables = {v.name: v for v in model.modelVariables}
    for name in settings.units:
        _find(settings, f"units.{name}", name, variables)
    return Plan(
        model,
        _mapped("inputs", settings, settings.inputs, drives, variables, ("input", "parameter")),
        _mapped("outputs", settings, settings.outputs, sensors, variables, ("output", "local")),
        [
            (_find(settings, f"parameters.{name}", name, variables).valueReference, value)
            for name, value in settings.parameters.items()
        ],
    )


def _check_step(settings: FmuSettings, model: Any, h: float) -> None:
    inner = float(model.coSimulation.fixedInternalStepSize or 0)  # FMPy leaves it as text
    if inner and abs(h / inner - round(h / inner)) > 1e-6:
        raise UserError(f"plant.fmu.ticks: {settings.file} steps by {inner:g} s and {h:g} s is no multiple of it; "
                        "change ticks or loop.rate")  # fmt: skip


def _mapped(
    key: str,
    settings: FmuSettings,
    names: dict[str, str],
    terminals: Sequence[Any],
    variables: dict[str, Any],
    causalities: tuple[str, ...],
) -> list[tuple[int, float]]:
    """Value reference and factor (FMU's unit per the machine's) of each terminal, in the machine's order."""
    wanted = [t.name for t in terminals]
    for name in names:
        if name not in wanted:
            near = nearest(name, wanted)
            raise UserError(f"plant.fmu.{key}: the machine has no '{name}'; it has {', '.join(wanted)}"
                            + (f"; did you mean '{near}'?" if near else ""))  # fmt: skip
    found = []
    for t in terminals:
        if t.name not in names:
            raise UserError(
                f"plant.fmu.{key}: '{t.name}' ({t.unit}) is missing: which variable of {settings.file} is it?"
            )
        where = f"{key}.{t.name}"
        variable = _find(settings, where, names[t.name], variables)
        if variable.causality not in causalities:
            raise UserError(f"plant.fmu.{where}: '{variable.name}' of {settings.file} is of causality "
                            f"{variable.causality}; it takes {' or '.join(causalities)}")  # fmt: skip
        found.append((variable.valueReference, _factor(settings, where, variable, t.unit)))
    return found


def _find(settings: FmuSettings, where: str, name: str, variables: dict[str, Any]) -> Any:
    variable = variables.get(name)
    if variable is None:
        near = nearest(name, variables)
        raise UserError(f"plant.fmu.{where}: {settings.file} has no variable '{name}'"
                        + (f"; did you mean '{near}'?" if near else ""))  # fmt: skip
    if variable.type not in REALS:
        raise UserError(f"plant.fmu.{where}: '{name}' of {settings.file} is of type {variable.type}; it has to be Real "
                        "(FMI 2) or Float64 (FMI 3)")  # fmt: skip
    return variable


def _factor(settings: FmuSettings, where: str, variable: Any, unit: str) -> float:
    """Number of the variable's units in one machine unit."""
    own = variable.unit or (variable.declaredType.unit if variable.declaredType else None)
    given = settings.units.get(variable.name)
    try:
        if own and given and not math.isclose(convert(1.0, given, modelica(own)), 1.0):
            raise UserError(f"plant.fmu.units: {settings.file} says that '{variable.name}' is in {own}, not {given}; "
                            "leave it out")  # fmt: skip
        theirs = modelica(own) if own else given or unit
        return convert(1.0, unit, theirs)
    except ValueError as error:
        raise UserError(f"plant.fmu.{where}: '{variable.name}' of {settings.file} is in '{own or given}', and it has "
                        f"to be a quantity in {unit} ({error})") from error  # fmt: skip


def modelica(unit: str) -> str:
    """A unit as FMI spells it, in our spelling: N.m, m/s2, rad/s."""
    return re.sub(r"([A-Za-z])(-?\d)", r"\1^\2", unit.replace(".", "*"))
