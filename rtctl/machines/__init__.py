"""One file a machine: the settings of its loop and its block diagram, from which the tick is generated."""

from typing import Any, NamedTuple

from rtctl.laws import excitation, reference
from rtctl.loop import faults
from rtctl.machines import axis, ivu, ldu
from rtctl.machines.base import Column, Diagram, MachineSettings, PlantDiagram

MODULES: dict[str, Any] = {"ivu": ivu, "ldu": ldu, "axis": axis}
CONFIGS: dict[str, type[MachineSettings]] = {
    "ivu": ivu.IvuConfig,
    "ldu": ldu.LduConfig,
    "axis": axis.AxisConfig,
}


class Machine(NamedTuple):
    """A config made ready: diagrams with their params, and what the supervisor needs to know of the machine."""

    kind: str
    config: Any
    rate: float  # Hz
    dt: float  # s
    plant_period: float  # s
    substeps: int  # of the plant in that period
    diagram: Diagram
    plant_diagram: PlantDiagram
    reference: reference.ReferenceParams
    excitation: excitation.ExcitationParams
    faults: tuple[faults.Fault, ...]
    truth: tuple[Column, ...]
    unit: str  # of position and reference, rad or m
    metres_per_unit: float
    radius: float  # m, turns metres into radians


def build(config: Any) -> Machine:
    """Diagrams and params for a config. Raises ValueError where the settings contradict each other."""
    try:
        return _build(config)
    except ArithmeticError as error:  # 1e308 s, 1e-320 ohm
        raise ValueError(f"a value is too large or too small to compute with ({error})") from error


def _build(config: Any) -> Machine:
    module = MODULES[config.machine]
    dt = 1.0 / config.loop.rate
    if config.loop.mode == "real":
        period = 1.0 / (config.plant.rate or max(module.PLANT_RATE, config.loop.rate))
    else:
        period = dt
    plant = module.plant_diagram(config, period, config.loop.seed)
    return Machine(
        kind=config.machine,
        config=config,
        rate=config.loop.rate,
        dt=dt,
        plant_period=period,
        substeps=module.substeps(config, period),
        diagram=module.diagram(config, dt),
        plant_diagram=plant,
        reference=reference.build(config.reference, dt),
        excitation=excitation.build(config.excitation, dt),
        faults=tuple(faults.build(settings, dt) for settings in config.faults),
        truth=plant.truth if config.record.truth else (),
        unit=module.UNIT,
        metres_per_unit=module.metres_per_unit(config),
        radius=module.radius(config),
    )
