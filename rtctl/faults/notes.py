"""What a person should know of each fault: what it imitates, what detects it, and what to do about it."""

from typing import NamedTuple


class Note(NamedTuple):
    imitates: str
    detected: str
    do: str


NOTES = {
    "link.delay": Note(
        "a congested network, or an emulator on a busy machine",
        "nothing directly: the loop loses its phase margin and swings, until `following_error` or `sensors_disagree`",
        "look at `link_latency_us` in `rtctl status`; move the plant closer, or lower the gain",
    ),
    "link.loss": Note(
        "a bad cable or a full queue",
        "`link_age` in the trace counts ticks without a frame; a trip needs `safety.link_timeout` of them in a row",
        "a loop rides through a half of its frames; look at the cable when `frames` falls behind `ticks`",
    ),
    "link.reorder": Note(
        "a network with two paths", "nothing, and nothing has to: the newest frame wins", "nothing",
    ),
    "link.silent": Note(
        "cable out, board dead",
        "`link_lost` after `safety.link_timeout`; a drive that pulls harder meanwhile may trip `following_error` first",
        "zeros are written but do not arrive: a board needs a watchdog of its own. That of the emulator runs on the "
        "wall clock, so in lockstep the last outputs stay until the link is back",
    ),
    "encoder.freeze": Note(
        "a dead encoder or its broken wire",
        "`encoder_frozen` where the drive pulls, `following_error` while moving, `sensors_disagree` where another "
        "sensor sees the same motion. At rest nothing tells a dead encoder from a machine that stands",
        "mend it, and home the machine: what was not counted is lost",
    ),
    "encoder.missed": Note(
        "dirt on the disc, a speed beyond the counter's",
        "only another sensor can see it: `sensors_disagree`, once `safety.disagreement` has built up",
        "set `safety.disagreement` wherever there are two sensors; home the machine afterwards",
    ),
    "encoder.noise": Note(
        "a cable without its screen beside a motor cable",
        "what it makes of the command: `following_error` or `current_time` where it is strong; a position loop with a "
        "filtered speed rides through it",
        "screen the cable",
    ),
    "adc.open": Note(
        "a wire off an analog input",
        "on the reel unit `sensors_disagree`, while the tape moves: a reel sensor that stands still. The linear drive "
        "uses no analog input",
        "look at the reel sensors' counts in `rtctl status`",
    ),
    "dac.stuck": Note(
        "a broken bit of a converter",
        "nothing: the loop compensates an offset that comes and goes, at the price of accuracy",
        "writing zero does not make such an output zero: bit 9 leaves 2.5 V of the 10 V on. An amplifier has to have "
        "an enable line or a contactor that does not go through the converter",
    ),
    "driver.hot": Note(
        "an amplifier that has switched itself off",
        "`following_error`, once the machine falls behind",
        "let it cool down",
    ),
    "supply.sag": Note(
        "a supply at its limit", "`following_error`, once the machine falls behind", "measure the supply under load",
    ),
    "loop.stall": Note(
        "a CPU hog of higher priority, an SMI, a virtual machine that is put aside",
        "late ticks are counted and listed with their numbers; `missed_ticks` of them in a row trip",
        "`rtctl doctor`",
    ),
    "plant.kill": Note(
        "an emulator that crashes, a board that is switched off and on",
        "`link_lost`; its counters begin again, and so does the position, while the machine is tripped",
        "`rtctl reset`, `rtctl arm`: the laws start from where the machine stands",
    ),
    "supervisor.kill": Note(
        "the out-of-memory killer",
        "the loop sees its pipe close, writes zeros and ends",
        "`rtctl trace recover NAME` repairs the recording and joins the rows that only shared memory has",
    ),
    "recorder.stall": Note(
        "a disk that does not answer for a while",
        "`rows.queued` grows; beyond 64 MB rows are lost and counted, with their ticks",
        "another disk",
    ),
    "disk.full": Note(
        "a full disk",
        "`rows.error`; the recording ends with its last whole batch",
        "make room; the run itself goes on",
    ),
    "clock.step": Note(
        "NTP that sets the clock at last",
        "nothing depends on it: only `recorded_at` and the name of a folder have the date. Stepped under the "
        "supervisor alone",
        "nothing",
    ),
    "cpu.hog": Note(
        "a build on the bench PC",
        "virtual time does not care; in real time late ticks are counted",
        "an isolated CPU and SCHED_FIFO: `rtctl doctor`",
    ),
}  # fmt: skip
