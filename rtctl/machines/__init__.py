"""Machines, one file each: settings of the loop, and the block diagram from which the tick is generated."""

from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

from rtctl.config.load import Widen
from rtctl.drivers import boards
from rtctl.laws import excitation, reference
from rtctl.machines import axis, described, ivu, ldu, own_plant
from rtctl.machines.base import DESCRIBED, Column, Diagram, MachineSettings, PlantDiagram, Signals
from rtctl.own import model
from rtctl.own.files import OwnError
from rtctl.tick import faults

CONFIGS: dict[str, type[MachineSettings]] = {
    kind.model_fields["machine"].default: kind for kind in (ivu.IvuConfig, ldu.LduConfig, axis.AxisConfig)
}
MODULES: dict[str, Any] = dict(zip(CONFIGS, (ivu, ldu, axis), strict=True))
EVERY: dict[str, type[MachineSettings]] = {**CONFIGS, DESCRIBED: described.DescribedConfig}  # of every kind


def module_of(kind: str) -> Any:
    """Module of a kind of machine, with columns, units and diagrams."""
    return described if kind == DESCRIBED else MODULES[kind]


def class_of(data: Any) -> type[MachineSettings] | None:
    """Settings class for plain data, by its key `machine`: a name, or a description; None where it is neither."""
    machine = data.get("machine") if isinstance(data, Mapping) else None
    if isinstance(machine, Mapping):
        return described.config_class(data)
    return CONFIGS.get(machine) if isinstance(machine, str) else None


class Machine(NamedTuple):
    """Machine built from a config: diagrams with their params, and data for the supervisor."""

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
    unit: str  # of position and reference, rad or m, or of a speed
    metres_per_unit: float | None  # None where nothing moves along a line
    radius: float | None  # m, turns metres into radians; None if unknown
    signals: Signals


def _widened(base: Any, data: Any, folder: Any = None, law: bool = True) -> tuple[Any, Any]:
    """Settings class and data as of `rtctl.own.model.widened`, in the units of the machine that the data describe."""
    return model.widened(class_of(data) or base, data, folder, law)


OWN = Widen(model.long_form, _widened)  # for load_settings
OWN_PLANT = Widen(model.long_form, partial(_widened, law=False))  # for callers without need of the law


def widened(data: Any) -> tuple[Any, Any]:
    """Settings class for complete plain data of a machine, with the keys of the user files that the data name, and the
    data; see `rtctl.own.model.widened`. Raises OwnError."""
    kind = class_of(data)
    if kind is None:
        raise OwnError(f"machine: {str(data.get('machine'))[:40]!r} is not one of {', '.join(CONFIGS)}")
    return model.widened(kind, data)


def settings(data: Any) -> Any:
    """Settings of complete plain data, as `written` returns them. Raises ValidationError, or OwnError."""
    kind, data = widened(data)
    return kind.model_validate(data)


def build(config: Any) -> Machine:
    """Diagrams and params for a config. Raises ValueError where the settings contradict each other."""
    try:
        return _build(config)
    except ArithmeticError as error:  # 1e308 s, 1e-320 ohm
        raise ValueError(f"a value is too large or too small to compute with ({error})") from error


def _build(config: Any) -> Machine:
    check_plant(config)
    module = module_of(config.kind)
    dt = 1.0 / config.loop.rate
    if config.loop.mode == "real":
        period = 1.0 / (config.plant.rate or max(module.PLANT_RATE, config.loop.rate))
    else:
        period = dt
    substeps = module.substeps(config, period)
    diagram = module.diagram(config, dt)
    if own_plant.is_own(config):
        plant = own_plant.plant_diagram(config, period, config.loop.seed, substeps)
    else:
        plant = module.plant_diagram(config, period, config.loop.seed)
    return Machine(
        kind=config.kind,
        config=config,
        rate=config.loop.rate,
        dt=dt,
        plant_period=period,
        substeps=substeps,
        diagram=diagram,
        plant_diagram=plant,
        reference=reference.build(config.reference, dt),
        excitation=excitation.build(config.excitation, dt),
        faults=tuple(faults.build(settings, dt, 0, diagram.blocks) for settings in config.faults),
        truth=plant.truth if config.record.truth else (),
        unit=module.unit(config),
        metres_per_unit=module.metres_per_unit(config),
        radius=module.radius(config),
        signals=module.signals(config),
    )


def fmu_of(config: Any) -> Any:
    """Settings of the FMU that replaces the plant's equations; None without an FMU."""
    return getattr(config.plant, "fmu", None)


def emulated(config: Any) -> bool:
    """Whether a machine runs against its own emulator: neither a real board nor an FMU."""
    return config.driver.kind == "emulated" and fmu_of(config) is None


def check_plant(config: Any) -> None:
    """Raise ValueError where the board or the plant of a config cannot run in its mode, UserError where a bus lacks a
    drive or a sensor of the machine."""
    real, fmu, mode = config.driver.kind != "emulated", fmu_of(config) is not None, config.loop.mode
    if real and fmu:
        raise ValueError(f"plant.fmu and driver.kind {config.driver.kind}: a machine is real or a model; drop one")
    if real and mode != "real":
        raise ValueError(f"driver.kind {config.driver.kind}: a real board keeps real time; set loop.mode to real "
                         f"(--mode real), or driver.kind to emulated for {mode}")  # fmt: skip
    if real:
        from rtctl.machines.wiring import wiring  # reads the profiles, which read this package

        boards.check(config.driver, wiring(config))
    if fmu and mode != "lockstep":
        raise ValueError(f"plant.fmu: an FMU runs in lockstep only, and loop.mode is {mode}; use --mode lockstep")
    if fmu and config.plant.physics:
        raise ValueError(
            "plant.physics: terms act inside our own equations, not inside an FMU; drop plant.fmu or the terms"
        )
