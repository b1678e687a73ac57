"""Calibrated constants of the verdict: noise, errors of laws, priors, and thresholds of a named effect.

Constants of the search decide only how much is tried; each is in the module that uses it. `rtctl prove` measures the
effect of a changed constant. docs/diagnosis_details.md holds the calibration of each constant.
"""

# The recording
INNOVATIONS = 10000.0  # effective innovations of a recording, at most: no model is exact
INNOVATIONS_OF_INTERVAL = 700.0  # effective innovations for an interval, at most: a law error exceeds noise
CLOCK = (0.025, 4e-6)  # share of a tick, and s: timing error of a usual clock, by nulls of the printers
CHANCE = 0.3  # share of innovations in the power of a residual, from which it gives the times of ticks
QUICKER = 30.0  # nats: least gain of another bandwidth of the observer; below it, all effects gain alike

# Laws
LAW_ERROR = 0.05  # share of an effect: standard deviation of the error of its law
EXACT = {1.0: 0.0, 0.1: 2.3, 0.01: 4.6}  # factor of LAW_ERROR: nats against it, one law in ten, in a hundred
LAW_ERROR_OF_FORCE = 0.1  # share of the force of an effect: error of its law as a free force, twice LAW_ERROR
UNEXPLAINED = 0.004  # share of the driving force: time-varying force beside a right description, by nulls
SLOW_ERROR = 0.01  # share of the driving force: slow error of the laws, twice the residual of right descriptions
UNSEEN = (0.25, 0.5)  # shares of the least size that a sensor shows: sizes of effects below the resolution

# Priors
TOLERANCE = 0.7  # share of the tolerance: standard deviation of a nominal value, between uniform and certain
BEYOND = 1.5  # times the tolerance: bound of a fitted value
FACTOR = 3.0  # ratio: one standard deviation, in logarithm, of a nominal value with a gross error
FREE_FORCE = 0.3  # share of the force that moves a node: prior standard deviation of an unnamed force
FREE_ERROR = 0.01  # share of the spread of a reading: prior standard deviation of an unnamed error of the reading
ODDS = 3.0  # nats (20 to 1) against an unnamed function, a gross error, and a noise growth of one sensor alone

# A name
FIRST = 5.0  # nats of evidence: least gain of a first effect, 150 to 1
FURTHER = 3.0  # nats of evidence: least gain of a further effect, 20 to 1
FURTHER_SHARE = 0.05  # share of the evidence of all effects together: least gain of a further effect
FURTHER_POWER = 0.3  # share of the residual power under the other effects: least part that a further effect explains
QUIET = (2.0, 1.2)  # times counting noise, and times noise from block to block: noise floor of a residual
SURE = 0.9  # probability from which a name is given, or a missing effect is reported
VISIBLE = 0.1  # share of the residual power above sensor noise: least part that an explanation explains
POOR = 0.1  # share of the spread of a sensor: largest residual above noise of a complete description
MOSTLY = 0.5  # share of the residual power above the noise: least part that named effects explain
WORSE = 1.0  # nats: loss on held-out rows at which a name is withdrawn; a smaller loss is chance
