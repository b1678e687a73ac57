"""A cascade of up to four second-order sections, by name or by their raw coefficients.

    sections:
      - {kind: lead_lag, k: 1.7e5 V/m, alpha: 0.05, tau_I: 2.2 s, beta: 10, tau_D: 3.5 ms}
      - {kind: notch, frequency: 119 Hz, zeta_z: 0.05, zeta_p: 0.5}
      - [0.00553, 0.01105, 0.00553, -1.78086, 0.80297]        # b0 b1 b2 a1 a2, for one sample rate only

They act in the order given. Sections that are not used pass their input on unchanged.

Source: thesis 12.7, figure 12.9 (lead-lag, two notches, low-pass).
"""

from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field

from rtctl.idiom import Settings, state, tick
from rtctl.laws import biquad, lead_lag, low_pass, notch
from rtctl.laws.biquad import BIQUAD_STATE, BiquadParams, BiquadSettings
from rtctl.laws.lead_lag import LeadLagSettings
from rtctl.laws.low_pass import LowPassSettings
from rtctl.laws.notch import NotchSettings

MOST = 4
BUILDERS = {"biquad": biquad.build, "lead_lag": lead_lag.build, "notch": notch.build, "low_pass": low_pass.build}


def _by_name(value: Any) -> Any:
    """A bare list of coefficients is a biquad."""
    if not isinstance(value, (list, tuple)):
        return value
    if len(value) != 5:
        raise ValueError(f"a section given as a list takes five numbers b0 b1 b2 a1 a2, not {len(value)}")
    return {"kind": "biquad", **dict(zip(BiquadParams._fields, value, strict=True))}


AnySection = Annotated[BiquadSettings | LeadLagSettings | NotchSettings | LowPassSettings, Field(discriminator="kind")]


class SectionsSettings(Settings):
    sections: list[Annotated[AnySection, BeforeValidator(_by_name)]] = Field(
        default=[], max_length=MOST, description="filters in the order in which they act, four at most"
    )


class SectionsParams(NamedTuple):
    first: BiquadParams
    second: BiquadParams
    third: BiquadParams
    fourth: BiquadParams


SECTIONS_STATE = state(first=BIQUAD_STATE, second=BIQUAD_STATE, third=BIQUAD_STATE, fourth=BIQUAD_STATE)


def build(settings: SectionsSettings, dt: float) -> SectionsParams:
    """Sections for a tick of `dt` s. Raises ValueError that says which section cannot be built."""
    built = [biquad.IDENTITY] * MOST
    for i, section in enumerate(settings.sections):
        try:
            built[i] = BUILDERS[section.kind](section, dt)  # type: ignore[operator]
        except ValueError as error:
            raise ValueError(f"section {i + 1} ({section.kind}): {error}") from error
    return SectionsParams(*built)


@tick
def step(p, s, e):
    """Output of the cascade for the input `e`."""
    y = biquad.step(p.first, s.first, e)
    y = biquad.step(p.second, s.second, y)
    y = biquad.step(p.third, s.third, y)
    return biquad.step(p.fourth, s.fourth, y)


@tick
def reset(p, s, e):
    """Put every section in its steady state for the constant input `e` and return the output (see `biquad.reset`)."""
    y = biquad.reset(p.first, s.first, e)
    y = biquad.reset(p.second, s.second, y)
    y = biquad.reset(p.third, s.third, y)
    return biquad.reset(p.fourth, s.fourth, y)
