"""Control allocation: the capstan command shared between the two motors.

`u_c` is the commanded capstan voltage in V, positive towards reel 1. T1 and T2 are the tension voltages.

    pull          u1 = T1 + max(u_c, 0)    u2 = T2 + max(-u_c, 0)    the winding motor positions, the other holds
    differential  u1 = T1 + u_c / 2        u2 = T2 - u_c / 2         both position
    motor1        u1 = T1 + u_c            u2 = T2
    motor2        u1 = T1                  u2 = T2 - u_c

A motor cannot push tape: where its voltage falls below the tension voltage, the paper may fold. `pull` never lowers a
motor below its tension voltage. The other modes have a floor, a share of the tension voltage: where a motor would fall
below the floor, the tension of the whole tape is raised until the motor is at the floor. The other motor then supplies
the missing command. Raising the tension adds the same multiple of T1 and T2, which moves nothing.

Source: thesis 5.2 (a change of direction is taken over by the other motor) and 8.3.
"""

from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick

PULL, DIFFERENTIAL, MOTOR1, MOTOR2 = 0, 1, 2, 3
KINDS = {"pull": PULL, "differential": DIFFERENTIAL, "motor1": MOTOR1, "motor2": MOTOR2}


class AllocationSettings(Settings):
    kind: Literal["pull", "differential", "motor1", "motor2"] = Field(
        default="pull", description="which motor positions: the winding one, both, or always the same one"
    )
    floor: float | None = quantity(
        None, unit="", ge=0, le=1, help="least share of its tension voltage that a motor keeps; no floor if absent"
    )


class AllocationParams(NamedTuple):
    kind: int
    has_floor: int
    floor: float  # share of the tension voltage


ALLOCATION_STATE = state(u1=float, u2=float)  # V


def build(settings: AllocationSettings, dt: float) -> AllocationParams:
    """Nothing to discretise: the law has no memory."""
    floor = settings.floor
    return AllocationParams(KINDS[settings.kind], int(floor is not None), 0.0 if floor is None else floor)


@tick
def step(p, s, u_c, T1, T2):
    """Write s.u1 and s.u2, V, for the capstan command `u_c` and the tension voltages `T1` and `T2`, V."""
    if p.kind == PULL:
        s.u1 = T1 + max(u_c, 0.0)
        s.u2 = T2 + max(-u_c, 0.0)
    elif p.kind == DIFFERENTIAL:
        s.u1 = T1 + u_c / 2
        s.u2 = T2 - u_c / 2
    elif p.kind == MOTOR1:
        s.u1 = T1 + u_c
        s.u2 = T2
    else:
        s.u1 = T1
        s.u2 = T2 - u_c
    if p.has_floor != 0 and T1 > 0.0 and T2 > 0.0:
        more = max(p.floor - s.u1 / T1, p.floor - s.u2 / T2)
        if more > 0.0:
            s.u1 += more * T1
            s.u2 += more * T2
