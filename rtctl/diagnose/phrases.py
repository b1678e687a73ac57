"""How each effect of the library is spoken of."""

from typing import NamedTuple


class Phrase(NamedTuple):
    """How one effect is spoken of. `head` and `detail` are filled in from Sizes, by the names of the parameters:

    {F_C} its size with unit, {a:%} a share in percent, {a:more|less} a word by its sign, {offset:+} the signed value,
    {at:3} three figures, {here} the node.
    """

    noun: str
    head: str
    detail: str
    need: str  # what a record must hold to show it


BOTH = "moves in both directions"
TURNS = "at least a full turn"
BEHIND = "long moves, with a sensor behind the contact"
WAVES = "moves over several waves, with a second sensor"
PASSES = "several passages of the same place"
PHRASES: dict[str, Phrase] = {name: Phrase(*words) for name, words in {
    "timing.delay": ("extra delay", "{here} acts late", "commands take effect {extra} later than stated",
                     "quick changes of the command"),
    "timing.jitter": ("an unsteady clock", "the clock of {here} is unsteady", "ticks are off by {sigma} rms",
                      "fast motion"),
    "drive.offset": ("an offset", "{here} pushes when nothing is asked for", "it gives {offset:+} at a command of zero",
                     "changes of command"),
    "drive.deadband": ("a dead zone", "{here} has a dead zone", "commands below {band} {form:words}",
                       "small commands of both signs"),
    "drive.gain_asymmetry": ("unequal gain", "{here} is stronger one way", "{a:%} {a:more|less} than asked for at "
                             "positive commands and {a:%} {a:less|more} at negative ones", "commands of both signs"),
    "drive.saturation": ("a lower limit", "{here} runs out of push", "beyond {limit} there is no more",
                         "commands near the limit"),
    "drive.supply_sag": ("a weak supply", "the supply of {here} sags", "{k:%} is lost for each {form:words} that all "
                         "drives ask for", "hard work of all drives at once"),
    "drive.lag": ("a lag", "{here} comes late and soft", "it takes {tau} to build up what is asked for",
                  "quick changes of the command"),
    "drive.thermal": ("drift with warmth", "{here} changes as it warms", "{a:%} {a:weaker|stronger} once warm, with a "
                      "time constant of {tau}", "a longer time of hard work"),
    "friction.coulomb": ("dry friction", "{here} rubs", "{F_added} {F_added:more|less} dry friction than in the "
                         "model, at any speed", BOTH),
    "friction.viscous": ("viscous friction", "{here} drags with speed", "{B} {B:more|less} viscous friction than in "
                         "the model", "moves at several speeds"),
    "friction.stribeck": ("sticking", "{here} sticks", "{sticking:words}", "standstills and slow moves"),
    "friction.load": ("friction from load", "{here} drags by its load", "friction {mu:grows|falls} by {mu:%} of the "
                      "load", "moves under several loads"),
    "friction.asymmetry": ("uneven friction", "{here} drags more one way", "dry friction is {a:%} {a:larger|smaller} "
                           "forwards and {a:%} {a:smaller|larger} backwards", BOTH),
    "friction.presliding": ("a spring before breakaway", "{here} gives like a spring before it breaks away",
                            "it springs over {z_s}", "standstills and slow reversals"),
    "friction.quadratic": ("drag by the square of speed", "{here} drags by the square of its speed", "{Q} of it",
                           "moves at several speeds"),
    "load.spring": ("a spring force", "something pulls {here} like a spring", "{k} {k:back to|away from} one place",
                    "long moves"),
    "load.cable_chain": ("a cable chain", "a cable chain pulls {here}", "{k} by position and {F_h} of drag",
                         "long moves with reversals"),
    "load.imbalance": ("imbalance", "{here} is heavy on one side", "{A} helps once a turn and hinders once a turn",
                       TURNS),
    "load.bump": ("a tight spot", "{here} has a tight spot", "{F} {F:more|less} to pass at {at:3}, within {width}",
                  PASSES),
    "transmission.backlash": ("play", "{here} has play", "{gap} is lost on each reversal", "reversals"),
    "transmission.slip": ("slip", "the contact at {here} slips", "it carries no more than {F_max}",
                          "hard acceleration, with a sensor behind the contact"),
    "transmission.creep": ("creep", "the contact at {here} creeps", "it loses {kappa} of the way by load", BEHIND),
    "structure.resonance": ("a resonance", "something on {here} shakes", "{mass} rings at {f_Hz:3}",
                            "excitation up to the resonance"),
    "structure.stiffening": ("a bent spring law", "the spring at {here} grows {c3:stiffer|softer} as it bends",
                             "its cubic stiffness is {c3:+}", "large deflections"),
    "tape.viscoelastic": ("slow give", "{here} gives way slowly", "a stiffness of {c_branch} relaxes within {tau}",
                          "changes of tension"),
    "tape.slack": ("slack", "{here} goes slack", "it pulls and cannot push", "moments of low tension"),
    "ripple.cogging": ("cogging", "{here} is notchy", "{A}, {per_turn:g} times a turn{harmonics:words}", TURNS),
    "ripple.encoder": ("a disc off centre", "the disc of {here} is off centre", "it reads up to {A} ahead and behind "
                       "once a turn{harmonics:words}", TURNS),
    "ripple.reel": ("a reel off centre", "{here} is off centre", "by {e} once a turn{harmonics:words}", TURNS),
    "ripple.capstan": ("a capstan out of round", "{here} is out of round", "by {a} once a turn{harmonics:words}",
                       TURNS),
    "guide.thickness": ("uneven thickness", "the guide at {here} is uneven", "{A} in waves of {wavelength}", WAVES),
    "guide.strip": ("a wavy strip", "the strip at {here} is wavy", "the way along it is {longer:%} longer than "
                    "straight, in waves of {wavelength}", WAVES),
    "guide.dirt": ("dirt on the strip", "there is dirt on the strip at {here}", "it is {A} off at {at:3}, within "
                   "{width}", PASSES),
    "sensor.missed_counts": ("lost counts", "{here} loses counts", "{jumps:words}",
                             "fast motion and a return to a known place"),
    "sensor.rectified": ("a sensor without direction", "{here} cannot tell direction", "{share:%} of the way back "
                         "counts as way out", BOTH),
    "sensor.scale": ("a wrong factor", "{here} has a wrong factor", "every way reads {relative:%} too "
                     "{relative:long|short}", "a second sensor to compare with"),
    "geometry.radius_change": ("a changing radius", "{here} changes its radius", "by {d} in each turn", "many turns"),
}.items()}  # fmt: skip
