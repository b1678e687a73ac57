"""Settings of the Image Verification Unit's config."""

from typing import Literal

from pydantic import Field, model_validator

from rtctl.drivers.at_mio_16de import AnalogInputSettings, AnalogOutputSettings
from rtctl.drivers.l292 import L292Settings
from rtctl.drivers.ls7084 import Ls7084Settings
from rtctl.drivers.optical_sensor import OpticalSensorSettings
from rtctl.idiom import Settings, quantity
from rtctl.laws.allocation import AllocationSettings
from rtctl.laws.bumpless import BumplessSettings
from rtctl.laws.excitation import ExcitationSettings, NoneSettings
from rtctl.laws.friction_feedforward import FrictionFeedforwardSettings
from rtctl.laws.gain_schedule import GainScheduleSettings
from rtctl.laws.inertia_feedforward import InertiaFeedforwardSettings
from rtctl.laws.limit import LimitSettings
from rtctl.laws.pd import PdSettings
from rtctl.laws.reel_radius import ReelRadiusSettings
from rtctl.laws.reference import ReferenceSettings
from rtctl.laws.shaper import ShaperSettings
from rtctl.laws.tension import TensionSettings
from rtctl.laws.tension_estimate import TensionEstimateSettings
from rtctl.laws.velocity import VelocitySettings
from rtctl.machines.base import (
    MachineSettings,
)
from rtctl.machines.compensation import CompensationSettings
from rtctl.machines.physics import PhysicsTerm, check_nodes
from rtctl.plants import ivu as plant_ivu
from rtctl.plants.fmu import FmuSettings


class BoardSettings(Settings):
    """AT-MIO-16DE-10: outputs 0 and 1 to the drivers, counter 0 on the capstan, two inputs on the reel sensors."""

    output1: AnalogOutputSettings = AnalogOutputSettings(channel=0)
    output2: AnalogOutputSettings = AnalogOutputSettings(channel=1)
    reel1: AnalogInputSettings = AnalogInputSettings(channel=0, polarity="unipolar", gain=1)
    reel2: AnalogInputSettings = AnalogInputSettings(channel=1, polarity="unipolar", gain=1)
    dither: bool = Field(default=False, description="0.5 LSB rms of noise on every analog input")


class SensorSettings(Settings):
    """Encoder on the capstan, optical sensors on the reels."""

    capstan: Ls7084Settings = Ls7084Settings(lines=2500)
    reel1: OpticalSensorSettings = OpticalSensorSettings()
    reel2: OpticalSensorSettings = OpticalSensorSettings()


class RadiusSettings(Settings):
    """Reel radii that the laws use: given, or measured when the machine is armed (5.2, 6.2)."""

    source: Literal["given", "measured"] = Field(
        default="given", description="given: R1 and R2 below; measured: at arming"
    )
    R1: float = quantity(0.038, unit="m", gt=0.005, le=0.2, help="radius of reel 1")
    R2: float = quantity(0.022, unit="m", gt=0.005, le=0.2, help="radius of reel 2")
    d_tape: float = quantity(0.5e-3, unit="m", ge=0, help="thickness of the tape, for tracking the radii")
    measure: ReelRadiusSettings = ReelRadiusSettings()


class FrictionSettings(Settings):
    """Friction compensation: of the winding motor always, of the paying motor while it turns."""

    motor1: FrictionFeedforwardSettings = FrictionFeedforwardSettings(tau_C=2.4e-3)
    motor2: FrictionFeedforwardSettings = FrictionFeedforwardSettings(tau_C=2.4e-3)
    speed: float = quantity(
        0.3, unit="rad/s", gt=0, help="reference speed at which the paying motor is fully compensated"
    )
    hand_over: float = quantity(
        0.6, unit="", ge=0, le=1, help="share of the paying motor's friction that the winding one takes at standstill"
    )


class IvuLawSettings(Settings):
    """The law, block by block in the order of the tick."""

    shaper: ShaperSettings = ShaperSettings()
    position: PdSettings
    gain_schedule: GainScheduleSettings = GainScheduleSettings()
    friction: FrictionSettings = FrictionSettings()
    inertia: InertiaFeedforwardSettings = InertiaFeedforwardSettings()
    tension: TensionSettings = TensionSettings()
    allocation: AllocationSettings = AllocationSettings()
    limit: LimitSettings = LimitSettings()
    bumpless: BumplessSettings = BumplessSettings()
    velocity: VelocitySettings = VelocitySettings(filter=30.0)
    tension_estimate: TensionEstimateSettings = TensionEstimateSettings()
    compensation: CompensationSettings = CompensationSettings()


class IvuPlantSettings(plant_ivu.IvuSettings):
    """The emulated machine."""

    rate: float | None = quantity(None, unit="Hz", gt=0, help="rate of the emulator in real mode; 2 kHz if absent")
    substep: float = quantity(5e-4, unit="s", gt=0, le=2e-3, help="longest integration step")
    follow_tape: bool = Field(default=True, description="radii and inertias follow the tape (4.3-4.8)")
    driver: L292Settings = L292Settings()
    physics: list[PhysicsTerm] = Field(default=[], description="terms of physics beyond the equations")
    fmu: FmuSettings | None = Field(default=None, description="an FMU in the equations' place, in lockstep")

    @model_validator(mode="after")
    def _nodes(self) -> "IvuPlantSettings":
        check_nodes(self.physics, "ivu")
        return self


class IvuConfig(MachineSettings):
    """The Image Verification Unit: two reels and a capstan at 500 Hz."""

    machine: Literal["ivu"] = "ivu"
    board: BoardSettings = BoardSettings()
    sensors: SensorSettings = SensorSettings()
    radius: RadiusSettings = RadiusSettings()
    law: IvuLawSettings
    reference: ReferenceSettings = ReferenceSettings()
    excitation: ExcitationSettings = NoneSettings()
    plant: IvuPlantSettings = IvuPlantSettings()
    R_c: float = quantity(0.0125, unit="m", gt=0, help="radius of the capstan, for millimetres")
