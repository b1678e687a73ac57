import numpy as np

from rtctl.case.quantities import quantities
from rtctl.diagnose.evidence.diagnosis import Effect, Interval
from rtctl.plants.physics import TERMS

SLIDES = quantities(None)
IVU = {"tau_F1": 0.0024, "tau_F2": 0.0026, "tau_Fc": 1e-4}


class FakeRecord:
    """Record attributes used by the phrases."""

    plant = "ivu"
    y = {"capstan_counts": np.array([-1000.0, 1000.0] * 50)}  # noqa: RUF012


def sample(name: str, value: float = 0.01) -> dict[str, Interval]:
    """Intervals for the required parameters of a term."""
    fields = TERMS[name].settings.model_fields
    wanted = [n for n, f in fields.items() if f.is_required() and n != "node"]
    wanted += ["F_added"] * (name == "friction.coulomb")
    return {n: Interval(value, 0.9 * value, 1.1 * value) for n in wanted}


STICKS = Effect("friction.stribeck", "motor1", 0.94, {"F_s": Interval(0.0031, 0.003, 0.0032, "Nm")}, ())
BRISTLES = Effect(
    "friction.presliding", "motor1", 0.4, {"z_s": Interval(0.002, 0.001, 0.003, "rad")}, (), "friction.stribeck:motor1"
)
DEAD = Effect("drive.deadband", "drive2", 0.8, {"band": Interval(0.075, 0.07, 0.08, "V")}, ())


def test_every_term_of_the_library_has_a_phrase():
    assert all(term.phrase for term in TERMS.values())
