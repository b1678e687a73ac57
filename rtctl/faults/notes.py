"""Notes on each fault for a person: what it imitates, what detects it, and what to do."""

from typing import NamedTuple


class Note(NamedTuple):
    imitates: str
    detected: str
    do: str


NOTES = {
    "link.delay": Note(
        "a congested network, or an emulator on a busy machine",
        "nothing directly: the loop loses phase margin and oscillates, until `following_error` or `sensors_disagree` "
        "trips",
        "look at `link_latency_us` in `rtctl status`; move the plant closer, or lower the gain",
    ),
    "link.loss": Note(
        "a bad cable or a full queue",
        "`link_age` in the trace counts ticks without a frame; `link_lost` trips after `safety.link_timeout` in a row",
        "the loop works with half of its frames; check the cable where `frames` falls behind `ticks`",
    ),
    "link.reorder": Note(
        "a network with two paths", "nothing; no detection is needed, since the newest frame wins", "nothing",
    ),
    "link.silent": Note(
        "a cable that is pulled out, a dead board",
        "`link_lost` after `safety.link_timeout`; `following_error` may trip first: the reference moves on",
        "give the board a watchdog of its own: zeros are written but do not arrive. The watchdog of the emulated board "
        "runs on the wall clock; in lockstep the last outputs stay until the link is back",
    ),
    "encoder.freeze": Note(
        "a dead encoder or its broken wire",
        "`encoder_frozen` where the drive pulls, `following_error` while moving, `sensors_disagree` where another "
        "sensor sees the same motion. At rest a dead encoder and a standing machine look the same",
        "repair the encoder, then home the machine: the counts of the meantime are lost",
    ),
    "encoder.missed": Note(
        "dirt on the disc, a speed above the limit of the counter",
        "only a second sensor: `sensors_disagree`, once the difference reaches `safety.disagreement`",
        "clean or replace the encoder, then home the machine; set `safety.disagreement` on machines with two sensors",
    ),
    "encoder.noise": Note(
        "an unscreened cable beside a motor cable",
        "its effect on the command: `following_error` or `current_time` where the noise is strong. A position loop "
        "with a filtered speed tolerates it",
        "screen the cable",
    ),
    "adc.open": Note(
        "a wire that came off an analog input",
        "on the reel unit `sensors_disagree` while the tape moves, since a reel sensor stops. The linear drive "
        "uses no analog input",
        "compare the counts of the reel sensors in `rtctl status`; check the wire of the one that stops",
    ),
    "dac.stuck": Note(
        "a defective bit of a converter",
        "nothing: the loop compensates an offset that varies, and loses accuracy",
        "give the amplifier an enable line or a contactor that does not pass through the converter. Zeros do not "
        "switch such an output off: bit 9 leaves 2.5 V of 10 V",
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
        "a process of higher priority, an SMI, a virtual machine that is not scheduled",
        "late ticks are counted and listed with their numbers; `missed_ticks` trips after as many in a row",
        "run `rtctl doctor`, which lists what to change",
    ),
    "plant.kill": Note(
        "an emulator that crashes, a board that is switched off and on again",
        "`link_lost`. The counters and the position restart while the machine is tripped",
        "`rtctl reset`, then `rtctl arm`: the laws start at the present position",
    ),
    "supervisor.kill": Note(
        "the out-of-memory killer",
        "the loop: its pipe closes, so it writes zeros and ends",
        "`rtctl trace recover NAME` repairs the recording and appends the rows that only shared memory holds",
    ),
    "recorder.stall": Note(
        "a disk that does not answer for a while",
        "`rows.queued` grows; beyond 64 MB rows are lost, and counted with their ticks",
        "use a faster disk",
    ),
    "disk.full": Note(
        "a full disk",
        "`rows.error`; the recording ends with its last whole batch",
        "free disk space; the run itself goes on",
    ),
    "clock.step": Note(
        "NTP, which sets the clock late",
        "nothing; only `recorded_at` and the name of a folder depend on the wall clock. The fault sets the clock of "
        "the supervisor only",
        "nothing",
    ),
    "cpu.hog": Note(
        "a compilation on the bench PC",
        "in real time late ticks are counted; virtual time is not affected",
        "isolate a CPU and allow SCHED_FIFO; `rtctl doctor` says how",
    ),
}  # fmt: skip
