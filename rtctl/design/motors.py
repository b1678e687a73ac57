"""Selection of motors for reels: torque and speed of a move, compared with those of a motor behind its gear.

    I = min(V / R, I_max),  tau_F = K I_0,  w = (V - R I) / K                          at the rotor
    tau = n (K I - tau_F),  w / n,  n^2 J                                               behind a gear of ratio n

A gear adds no loss to the motor's own friction here: appendix E gives one no-load current for every gear. A reel that
pays out is turned by its tape, whose tension must exceed the motor's pull by n tau_F / R.

Source: thesis appendix E, chapter 9 ("it is also recommended to use other DC motors").
"""

import math
from typing import NamedTuple

RPM = 2.0 * math.pi / 60.0


class Motor(NamedTuple):
    """A motor with its gear."""

    name: str
    gear: float
    volts: float
    resistance: float  # ohm
    K: float  # Nm/A at the rotor
    I_0: float  # A without load
    J: float  # kg m^2 of the rotor
    most: float = math.inf  # Nm behind the gear, continuous

    @property
    def friction(self) -> float:
        """Dry friction behind the gear, Nm."""
        return self.gear * self.K * self.I_0

    @property
    def stall(self) -> float:
        """Torque at standstill behind the gear, Nm."""
        return self.gear * self.K * self.volts / self.resistance - self.friction

    @property
    def no_load(self) -> float:
        """Speed without load behind the gear, rad/s."""
        return (self.volts - self.resistance * self.I_0) / (self.K * self.gear)

    @property
    def inertia(self) -> float:
        """Inertia behind the gear, kg m^2."""
        return self.gear**2 * self.J

    def at(self, speed: float) -> float:
        """Available torque at a speed behind the gear (rad/s), Nm."""
        return min(self.stall * (1.0 - speed / self.no_load), self.most)

    def current(self, torque: float) -> float:
        """Motor current for a torque behind the gear (Nm), A."""
        return (torque + self.friction) / (self.K * self.gear)


class Move(NamedTuple):
    """Speed, torque and acceleration of a move at the motor that winds."""

    speed: float  # rad/s of its reel
    torque: float  # Nm, without the friction and the inertia of a motor
    acceleration: float  # rad/s^2 of its reel


class Fit(NamedTuple):
    """A motor against a move."""

    torque: float  # Nm, for the move with the inertia of both motors
    left: float  # Nm, reserve at the speed of the move
    current: float  # A
    back: float  # N of tension at which a reel of radius R turns the motor back
    good: bool


ROTOR = 6.6e-8  # kg m^2, with which the 150.4 gear has the identified J_m of 1.5e-3 kg m^2; the text gives none
APPENDIX_E = tuple(  # 24 V: ratio, continuous torque in Nm
    Motor(f"{order}, {ratio:g}:1", ratio, 24.0, 58.0, 61e-3, 24e-3, ROTOR, most)
    for order, ratio, most in (("706", 81.0, 0.24), ("707", 150.4, 0.45), ("708", 243.0, 0.6), ("709", 451.25, 0.6),
                               ("711", 729.0, 0.6))
)  # fmt: skip
BARE = Motor("537 without gear", 1.0, 24.0, 58.0, 61e-3, 24e-3, ROTOR)
BRUSHLESS = Motor("brushless, 4:1", 4.0, 24.0, 1.2, 33.5e-3, 10e-3, 9.2e-6, 0.2)  # flat, 43 mm, iron core: chosen


def move(distance: float, seconds: float, R: float, F_t: float = 0.1) -> Move:
    """Peaks of a move of `distance` m in `seconds`, 1 - cos, on a reel of radius `R` m with its tape at `F_t` N."""
    w = math.pi / seconds
    return Move(0.5 * distance * w / R, F_t * R, 0.5 * distance * w * w / R)


def fit(motor: Motor, asked: Move, R: float, paper: float) -> Fit:
    """A motor against a move of a reel of radius `R` m; both reels with their motors move, `paper` kg m^2 in all."""
    torque = asked.torque + (2.0 * motor.inertia + paper) * asked.acceleration + motor.friction  # of the other motor
    left = motor.at(asked.speed) - torque
    back = motor.friction / R
    return Fit(torque, left, motor.current(torque), back, left > 0.0 and back < 1.0)
