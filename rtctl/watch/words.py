"""Sentence of an alarm: place, effect and size, in the terms of the report of a diagnosis."""

from rtctl.diagnose.answer.si_format import nice
from rtctl.diagnose.answer.words import channel_unit, here
from rtctl.plants.physics.dimensions import DIMENSIONS
from rtctl.watch.band import ALONG, Band, Measure
from rtctl.watch.observer import Observer
from rtctl.watch.windows import Batch

WAYS = {  # regressor of a missing force, for a positive and a negative coefficient
    "push": ("a push that the model does not have", "a push backwards that the model does not have"),
    "direction": ("less resistance to the motion than the model has", "resistance to the motion that the model lacks"),
    "speed": ("less drag than the model has", "drag that grows with speed and that the model lacks"),
    "acceleration": ("less inertia than the model has", "inertia that the model lacks"),
}
OFF = {  # regressor of the error of a reading
    "push": "always the same way",
    "direction": "the other way with the direction of motion",
    "speed": "in proportion to the speed",
    "acceleration": "in proportion to the acceleration",
}


def force_unit(observer: Observer, number: int) -> str:
    """Unit of the missing force at a followed body."""
    return DIMENSIONS["force"][not observer.sim.case.machine.turns(observer.sim.followed[number].body)]


def sentence(observer: Observer, band: Band, measure: Measure, windows: Batch) -> str:
    """One sentence on the measure that has risen in the windows (n,) of an alarm."""
    machine = observer.sim.case.machine
    k = band.sensors.index(measure.of)
    if measure.what == "noise":
        now = float(band.innovations(windows)[:, k].mean())
        return (
            f"the reading of {here(machine, measure.of)} scatters {now / band.sigma[k]:.2g} times as much about the "
            "model as it did when the band was learned"
        )
    left = band.missing(windows)
    signals = [band.sensors[n] for n in band.followed] + band.beside
    number = signals.index(measure.of)
    r = left[:, :, number]
    if number < len(band.followed):
        unit, at = force_unit(observer, number), here(machine, observer.sim.followed[number].body)
        what = "torque" if unit == "Nm" else "force"
    else:
        unit, at, what = channel_unit(machine, measure.of), here(machine, measure.of), "reading"
    if measure.what == "size":
        rms = float((r**2).mean() ** 0.5)
        return f"a {what} that comes and goes at {at} is missing in the model, {nice(rms, unit)} rms"
    name, sign = measure.what[:-1], measure.what[-1]
    f = band.along(windows, number)[:, :, ALONG.index(name)]
    amount = abs(float((r * f).sum() / max(float((f**2).sum()), 1e-300)))
    if number >= len(band.followed):
        return f"the reading of {at} is off by {nice(amount, unit)}, {OFF[name]}"
    return f"{WAYS[name][sign == '-']}, at {at}: {nice(amount, unit)} of {what}"
