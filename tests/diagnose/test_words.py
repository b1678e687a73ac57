import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.diagnose import words
from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Diagnosis, Effect, Interval, Located, Rival
from rtctl.diagnose.model import Model
from rtctl.diagnose.preflight import Preflight
from rtctl.diagnose.quantities import quantities
from rtctl.diagnose.words import node_words, sentence, verdict_sentences
from rtctl.plants.physics import TERMS, anywhere

SLIDES = quantities(None)
IVU = {"tau_F1": 0.0024, "tau_F2": 0.0026, "tau_Fc": 1e-4}


class FakeRecord:
    """What words ask of a record."""

    plant = "ivu"
    y = {"capstan_counts": np.array([-1000.0, 1000.0] * 50)}  # noqa: RUF012


def diagnosis(verdict=NAMED, effects=(), after=None, **more) -> Diagnosis:
    base = Model("ivu", IVU)
    values = dict.fromkeys(Diagnosis._fields) | {
        "record": FakeRecord(), "preflight": Preflight(()), "verdict": verdict, "effects": tuple(effects),
        "parameters": {}, "owner": base, "before": base, "after": after or base, "heldout_before": 0.012,
        "heldout_after": 0.0004, "noise_floor": 0.0003, "evidence": (), "null_line": 0.08, "cannot_test": (),
        "hides": {}, "fit_rows": (0, 75), "seconds": 1.0,
    }  # fmt: skip
    return Diagnosis(**(values | more))


def sample(name: str, value: float = 0.01) -> dict[str, Interval]:
    """Any values for the parameters that a term asks for."""
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


@pytest.mark.parametrize("name", TERMS)
@pytest.mark.parametrize("value", [0.01, -0.01])
def test_every_phrase_fills_in_at_every_node(name, value):
    for kind, nodes in anywhere(TERMS[name]).items():
        for node in nodes:
            effect = Effect(name, node, 0.9, sample(name, value), ())
            head, detail = words.effect_clause(effect, Model(kind, {**IVU, "F_c": 1.0, "R_c": 0.01}))
            assert head and detail and not re.search(r"[{}_]|unknown|None|\bnan\b", head + detail), (head, detail)


@pytest.mark.parametrize("name", TERMS)
def test_sizes_and_units_stand_in_the_sentence(name):
    kind, nodes = next(iter(anywhere(TERMS[name]).items()))
    effect = Effect(name, nodes[0], 0.9, sample(name), ())
    _, detail = words.effect_clause(effect, Model(kind, {**IVU, "F_c": 1.0, "R_c": 0.01}))
    if effect.parameters:
        assert re.search(r"\d", detail), detail


def test_one_effect():
    assert verdict_sentences(diagnosis(effects=[STICKS])) == (
        "Motor 1 sticks: it needs 3.1 mNm to start but 2.4 mNm to keep moving. "
        "With that in the model the error on the part that was not fitted falls from 12 to 0.40 counts."
    )


def test_several_effects_are_joined():
    text = verdict_sentences(diagnosis(effects=[STICKS, DEAD]))
    assert text.startswith("Two things are missing: motor 1 sticks (it needs 3.1 mNm")
    assert "and drive 2 has a dead zone (commands below 75 mV do nothing). With them" in text


def test_a_prediction_that_got_worse_is_not_said_to_fall():
    assert "goes from" in verdict_sentences(diagnosis(effects=[STICKS], heldout_after=0.02))


def test_sticking_counts_dry_friction_that_was_added():
    more = TERMS["friction.coulomb"].settings(node="motor1", F_C=0.0004)
    text = verdict_sentences(diagnosis(effects=[STICKS], after=Model("ivu", IVU, (more,))))
    assert "2.8 mNm to keep moving" in text


def test_ambiguous_names_both_and_what_to_run():
    text = verdict_sentences(diagnosis(AMBIGUOUS, [STICKS, BRISTLES]))
    assert text.startswith("Either motor 1 sticks (") and " or motor 1 gives like a spring" in text
    assert "this record cannot tell. Run this next: " in text
    assert TERMS["friction.stribeck"].look_alikes["friction.presliding"].rstrip(".") in text


def test_ambiguous_between_places():
    other = STICKS._replace(node="motor2", instead_of="friction.stribeck:motor1")
    text = verdict_sentences(diagnosis(AMBIGUOUS, [STICKS, other]))
    assert " or motor 2 sticks" in text and "Run this next: drive one motor alone" in text


def test_what_is_sure_is_not_put_in_doubt():
    text = verdict_sentences(diagnosis(AMBIGUOUS, [STICKS, DEAD, BRISTLES]))
    sure, _, doubt = text.partition(", which is sure. Beside that ")
    assert sure == "Drive 2 has a dead zone (commands below 75 mV do nothing)"
    assert doubt.startswith("either motor 1 sticks (") and "dead zone" not in doubt.partition("Run this")[0]
    assert " or motor 1 gives like a spring before it breaks away" in doubt


def test_two_doubts_at_once():
    lag = Effect("drive.lag", "drive2", 0.3, {"tau": Interval(0.002, 0.001, 0.003, "s")}, (), "drive.deadband:drive2")
    text = verdict_sentences(diagnosis(AMBIGUOUS, [STICKS, DEAD, BRISTLES, lag])).partition(" Run this")[0]
    assert text.count("either") + text.count("Either") == 2 and "sure" not in text
    assert (
        text.index("gives like a spring") < text.index("and either drive 2 has a dead zone") < text.index("comes late")
    )


def test_without_a_rival_the_least_likely_is_in_doubt():
    text = verdict_sentences(diagnosis(AMBIGUOUS, [STICKS, DEAD]))
    assert "which is sure. Beside that perhaps drive 2 has a dead zone" in text


@settings(deadline=None)
@given(st.lists(st.tuples(st.sampled_from([STICKS, DEAD, BRISTLES]), st.floats(0.05, 0.99)), min_size=1, max_size=4))
def test_an_ambiguous_verdict_always_doubts_something(found):
    effects = [e._replace(confidence=confidence) for e, confidence in found]
    if all(e.instead_of for e in effects):
        effects.append(STICKS)
    text = verdict_sentences(diagnosis(AMBIGUOUS, effects)).lower()
    assert ("either " in text or "perhaps " in text) and "this record cannot tell. run this next: " in text


def test_what_tells_apart_is_about_the_rivals_and_not_about_what_is_sure():
    text = verdict_sentences(diagnosis(AMBIGUOUS, [DEAD, STICKS, BRISTLES]))
    assert TERMS["friction.stribeck"].look_alikes["friction.presliding"].rstrip(".") in text


def test_the_designed_experiment_is_the_one_to_run():
    plan = {"words": "Move slowly back and forth through zero speed."}
    text = verdict_sentences(diagnosis(AMBIGUOUS, [STICKS, BRISTLES], experiment=plan))
    assert text.endswith("Run this next: move slowly back and forth through zero speed.")


def test_an_entry_within_a_sentence():
    assert words.at("friction.stribeck:motor1", SLIDES) == "sticking at motor 1"
    assert words.at("nothing", SLIDES) == "nothing"


def test_ambiguous_with_a_rival_that_was_fitted():
    lone = STICKS._replace(look_alikes=(Rival("friction.load", "motor1", 0.4, 1.0),))
    assert "Perhaps motor 1 sticks" in verdict_sentences(diagnosis(AMBIGUOUS, [lone]))


def test_unnamed_says_where_and_how_much():
    at = Located("capstan_counts", "tape2", "velocity", "below 0.4 rad/s", 2.5, 0.81)
    text = verdict_sentences(diagnosis(UNNAMED, located=at, heldout_after=0.009))
    assert "missing at the tape at reel 2" in text and "velocity, below 0.4 rad/s, from 2.50 s on" in text
    assert "81 %" in text and "9.0 counts where noise leaves 0.30 counts" in text


def test_unnamed_without_a_place():
    assert "no clear place" in verdict_sentences(diagnosis(UNNAMED))


def test_nothing_says_what_would_have_shown():
    hides = {
        "friction.coulomb:motor1": Interval(1e-4, 1e-4, 1e-4, "Nm"),
        "friction.coulomb:motor2": Interval(1e-4, 1e-4, 1e-4, "Nm"),
        "drive.deadband:drive1": Interval(0.012, 0.012, 0.012, "band"),  # the parameter in place of its unit
        "drive.gain_asymmetry:drive1": Interval(0.02, 0.02, 0.02, ""),
    }
    text = verdict_sentences(diagnosis(NOTHING, heldout_after=0.00031, hides=hides))
    assert text.startswith("Nothing is missing: ") and "0.31 counts" in text
    assert "dry friction of 100 uNm at motor 1, a dead zone of 12 mV at drive 1 and unequal gain of 2.0 %" in text
    assert "motor 2" not in text  # one node of each effect is enough for a sentence


def test_random_forces_are_told_apart_from_the_noise_of_the_sensor():
    text = verdict_sentences(diagnosis(NOTHING, heldout_after=0.012, random_forces=True))
    assert text.startswith("Nothing is missing that has a pattern: random forces move")
    assert "by 12 counts, and noise makes 0.30 counts beside that" in text


def test_what_is_less_than_random_forces_do_is_told_so():
    text = verdict_sentences(diagnosis(effects=[STICKS], heldout_after=0.0118, faint=True))
    assert "Random forces do more than that: with that in the model the error " in text
    assert text.endswith(", but beneath them it is plain.")


def test_nothing_without_sizes():
    assert "was not worked out" in verdict_sentences(diagnosis(NOTHING))


@pytest.mark.parametrize(
    ("node", "text"),
    [("motor1", "motor 1"), ("tape2", "the tape at reel 2"), ("carriage", "the carriage"), ("drive1", "drive 1")],
)
def test_nodes_in_words(node, text):
    assert node_words(node, SLIDES) == text


def test_every_node_of_the_library_has_words():
    nodes = {n for term in TERMS.values() for where in anywhere(term).values() for n in where}
    assert all(re.fullmatch(r"[a-z ]+\d?", node_words(n, SLIDES)) for n in nodes)


@pytest.mark.parametrize("name", TERMS)
def test_what_cannot_be_tested_is_a_sentence(name):
    text = sentence(f"{name}:motor1", "motor2", units=SLIDES)
    assert text.startswith("This record cannot show ") and text.endswith(".")
    assert "at motor 1 and motor 2" in text and "that takes" in text


def test_an_unknown_entry_is_still_a_sentence():
    assert sentence("friction.magic:motor1", units=SLIDES) == "This record cannot show friction.magic at motor 1."


@pytest.mark.parametrize(
    ("kind", "name", "node", "parameter", "unit"),
    [
        ("ivu", "friction.coulomb", "motor1", "F_C", "Nm"), ("ldu", "friction.coulomb", "carriage", "F_C", "N"),
        ("ldu", "ripple.encoder", "encoder", "A", "rad"), ("ivu", "drive.deadband", "drive1", "band", "V"),
        ("ldu", "transmission.creep", "wheel", "kappa", "1/Nm"), ("ivu", "friction.load", "motor1", "mu", ""),
        ("ivu", "structure.stiffening", "tape1", "c3", "N/m^3"), ("ivu", "transmission.slip", "capstan", "F_max", "N"),
    ],
)  # fmt: skip
def test_units_by_node(kind, name, node, parameter, unit):
    assert words.unit_at(kind, name, node, parameter, SLIDES) == unit
