"""Numbers that a verdict hangs on, in one place: what is assumed of noise, of laws, of priors, and what a name needs.

Numbers of the search, which only decide how much is tried, stand where they are used. `rtctl prove` measures what a
change of one of these does; docs/diagnosis_details.md says where each comes from.
"""

# The recording
INNOVATIONS = 10000.0  # that a recording counts for at most: no model is exact, however long it is observed
INNOVATIONS_OF_INTERVAL = 700.0  # the same for an interval: an error of a law moves its numbers more than noise does
CLOCK = (0.025, 4e-6)  # of a tick, and s: what any clock is off by
CHANCE = 0.3  # of the power of a residual, which must be chance where it tells of the times of ticks
QUICKER = 30.0  # nats that another bandwidth of the observer must bring: below, all names gain alike

# Laws
LAW_ERROR = 0.05  # of what an effect does: standard deviation of the error of its law
EXACT = {1.0: 0.0, 0.1: 2.3, 0.01: 4.6}  # of the usual error, and nats against it: one law in ten, in a hundred
LAW_ERROR_OF_FORCE = 0.1  # of what a name takes the place of: a free force beside it that is an error of its law
UNEXPLAINED = 0.004  # of the force that moves the machine: what comes and goes beside a description that is right
SLOW_ERROR = 0.01  # of the same force: slow error that laws leave
UNSEEN = (0.25, 0.5)  # of the least size of an effect that a sensor could show: what may be there without a name

# Priors
TOLERANCE = 0.7  # of the tolerance: standard deviation of the owner's error, between uniform and certain
BEYOND = 1.5  # times the tolerance: a value that a fit may reach, improbable as its prior makes it
FACTOR = 3.0  # by which a number is wrong that is wrong by far: one standard deviation, in logarithm
FREE_FORCE = 0.3  # of the force that moves a node: standard deviation of a force without a name
FREE_ERROR = 0.01  # of the spread of a reading: standard deviation of an error of it without a name
ODDS = 3.0  # nats against what has no name, a number that is wrong by far, and a noise of one sensor of its own growth

# A name
FIRST = 5.0  # nats of evidence that a first effect must bring
FURTHER = 3.0  # nats that a further one must bring
FURTHER_SHARE = 0.05  # of the evidence of all effects together, which a further one must bring
FURTHER_POWER = 0.3  # share of the power that the others leave, which a further effect must take off
QUIET = (2.0, 1.2)  # times what counting leaves, and what differs from block to block: nothing is left to explain
SURE = 0.9  # probability from which a name is given, or that something is missing
VISIBLE = 0.1  # share of what is missing beyond sensor noise that an explanation has to take off: less is no finding
POOR = 0.1  # share of the spread of a sensor: a description that leaves more, and no noise, lacks something
MOSTLY = 0.5  # share of the residual's power above the noise that names have to take off
WORSE = 1.0  # nats by which unseen rows must be predicted worse, until a name is withdrawn: less is chance
