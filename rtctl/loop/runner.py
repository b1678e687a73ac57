"""Loops of the controller and the emulated plant. The generator copies their source into the generated module.

There, `tick`, `start`, `advance` and `sample` are generated functions, and `link` is the module of the link.
"""

from typing import Any

from rtctl.loop import histogram, mailbox, ring
from rtctl.tick import clock, faults, safety
from rtctl.tick.memory import borrowed

tick: Any = None  # the generated tick: tick(p, s, t, c, rx, tx, y, m, k, fresh, late, passed, gone)
start: Any = None  # the generated plant: start(p, s), advance(p, s, tx), sample(p, s, rx)
advance: Any = None
sample: Any = None
link: Any = None  # rtctl.loop.zmq_link or shm_link


def run_real(
    status,
    box,
    tables,
    ring_,
    rows,
    p,
    s,
    c,
    staged,
    y,
    m,
    f,
    tx,
    rx,
    held,
    rx_staged,
    out,
    inp,
    period,
    late_ns,
    ahead,
    spin,
    most,
):
    """Run the loop on the wall clock until `status.stop` is set or `most` ticks are done."""
    box, tables, ring_, rows = borrowed(box), borrowed(tables), borrowed(ring_), borrowed(rows)
    p, s, c, staged, y, m, f = (
        borrowed(p), borrowed(s), borrowed(c), borrowed(staged), borrowed(y), borrowed(m), borrowed(f)
    )  # fmt: skip
    tx, rx, held, rx_staged = borrowed(tx), borrowed(rx), borrowed(held), borrowed(rx_staged)
    st = status[0]
    meet(st, out, inp, held, rx, rx_staged, period)
    tx[0].seq = held[0].seq
    wake = clock.now() + period
    st.first_ns = wake
    before = wake
    # CLOCK_BOOTTIME less CLOCK_MONOTONIC, ns: grows by the time in suspend. The order of the two reads here is opposite
    # to the order below, so that a stop of this process between two reads never counts as a suspend.
    awake = -(clock.now() - clock.boot())
    m[0].on = 1
    for k in range(most):
        if st.stop != 0:
            break
        due = wake + faults.lateness(c[0], k) if c[0].faulty != 0 else wake
        clock.sleep_until(due - spin)
        woke = clock.now()
        while woke < due:  # short spin, and sleeps cut short by a signal
            woke = clock.now()
        suspended = clock.boot() - clock.now() - awake
        if suspended < period:  # jitter of the two reads
            suspended = 0
        awake += suspended
        lateness = woke - wake + suspended
        skipped = lateness // period  # a missed tick is counted, never caught up
        late = 1 if lateness > late_ns else 0
        if ahead != 0 and skipped == 0:  # after a missed period the outputs of the last tick are old
            send(st, out, c[0], f[0], tx, held, k, woke)
        fresh = link.receive_newest(inp, rx, rx_staged)
        begun = clock.now()
        mailbox.take(box, staged, p, c)
        if c[0].faulty != 0:
            fresh = faults.receive(c[0], f[0], rx, fresh, k)
        if tx[0].seq - rx[0].outputs_seq > p[0].safety.link:  # answers old outputs: a frame delayed by a cut cable
            fresh = 0
        y[0].tick = k
        y[0].t = (woke - st.first_ns) * 1e-9
        y[0].period = (woke - before + suspended) * 1e-9
        y[0].lateness = lateness * 1e-9
        was = st.state
        gone = safety.gone(p[0].safety, woke, st.commander_ns, st.heartbeat_ns)
        tick(p[0], s[0], tables[c[0].table], c[0], rx[0], tx[0], y[0], m[0], k, fresh, late, 1 + skipped, gone)
        tx[0].inputs_t_ns, tx[0].state = rx[0].t_ns, s[0].safety.state
        wrote = clock.now()
        ring.put(ring_[0], rows, y)
        account(st, s[0].safety, k, rx[0].lost_counts)
        ticked = clock.now()
        if ahead == 0 or skipped > 0 or (st.state != was and (was == 1 or was == 2)):  # a trip does not wait
            send(st, out, c[0], f[0], tx, held, k, ticked)
        tx[0].seq = held[0].seq
        done = clock.now()
        if fresh > 0:
            st.link_frames += fresh
            histogram.add(st.age, woke - rx[0].t_ns)
            if rx[0].outputs_seq > 0:
                histogram.add(st.round_trip, begun - rx[0].outputs_t_ns)
        histogram.add(st.lateness, lateness)
        stages(st, m[0], begun, wrote, ticked)
        histogram.add(st.exchange, begun - woke + done - ticked)
        st.missed += skipped
        if late != 0:
            note_late(st, k, lateness)
        before = woke
        wake += ((lateness - suspended) // period + 1) * period
        if done > wake:
            st.overruns += 1
        if st.supervisor_lost != 0:
            break
    held[0].ao_codes[:] = 0
    held[0].dio_lines = 0
    held[0].state = 0
    for _ in range(3):  # a lost frame must not leave the outputs on
        post(st, out, held, clock.now())
        clock.sleep_until(clock.now() + period)
    st.ended = 1


def run_lockstep(
    status,
    box,
    tables,
    ring_,
    rows,
    p,
    s,
    c,
    staged,
    y,
    m,
    f,
    tx,
    rx,
    held,
    rx_staged,
    out,
    inp,
    period,
    late_ns,
    ahead,
    first,
    most,
):
    """Run the loop in lockstep with the plant on virtual time: wait for a sample, tick, send the outputs."""
    box, tables, ring_, rows = borrowed(box), borrowed(tables), borrowed(ring_), borrowed(rows)
    p, s, c, staged, y, m, f = (
        borrowed(p), borrowed(s), borrowed(c), borrowed(staged), borrowed(y), borrowed(m), borrowed(f)
    )  # fmt: skip
    tx, rx, rx_staged, held = borrowed(tx), borrowed(rx), borrowed(rx_staged), borrowed(held)
    st = status[0]
    for k in range(first, first + most):
        if st.stop != 0 or st.supervisor_lost != 0:
            break
        mailbox.take(box, staged, p, c)
        skipped = behind(c[0], k, period)
        for _ in range(skipped):  # the machine moves on while the loop stalls
            if link.receive(inp, rx, rx_staged) == 0:
                st.failed = 1
                break
            post(st, out, held, clock.now())
        if st.failed != 0 or link.receive(inp, rx, rx_staged) == 0:
            st.failed = 1
            break
        st.link_frames += 1
        virtual(st, tables, ring_, rows, p, s, c, y, m, f, tx, rx, held, period, late_ns, ahead, k, skipped)
        post(st, out, held, clock.now())


def run_fused(
    status,
    box,
    tables,
    ring_,
    rows,
    p,
    s,
    c,
    staged,
    y,
    m,
    f,
    tx,
    rx,
    held,
    pp,
    ps,
    period,
    late_ns,
    ahead,
    first,
    most,
):
    """Run loop and plant in one process on virtual time, as fast as possible; equal to lockstep to the bit."""
    box, tables, ring_, rows = borrowed(box), borrowed(tables), borrowed(ring_), borrowed(rows)
    p, s, c, staged, y, m, f = (
        borrowed(p), borrowed(s), borrowed(c), borrowed(staged), borrowed(y), borrowed(m), borrowed(f)
    )  # fmt: skip
    tx, rx, held, pp, ps = borrowed(tx), borrowed(rx), borrowed(held), borrowed(pp), borrowed(ps)
    st = status[0]
    if first == 0:
        start(pp[0], ps[0])
        sample(pp[0], ps[0], rx[0])
    for k in range(first, first + most):
        if st.stop != 0 or st.supervisor_lost != 0:
            break
        mailbox.take(box, staged, p, c)
        skipped = behind(c[0], k, period)
        for _ in range(skipped):  # the machine moves on while the loop stalls
            advance(pp[0], ps[0], held[0])
            sample(pp[0], ps[0], rx[0])
        virtual(st, tables, ring_, rows, p, s, c, y, m, f, tx, rx, held, period, late_ns, ahead, k, skipped)
        advance(pp[0], ps[0], held[0])
        sample(pp[0], ps[0], rx[0])


def behind(c, k, period):
    """Number of whole periods before tick `k` that an injected stall of the loop takes."""
    return faults.lateness(c, k) // period if c.faulty != 0 else 0


def virtual(st, tables, ring_, rows, p, s, c, y, m, f, tx, rx, held, period, late_ns, ahead, k, skipped):
    """One tick on virtual time, after `skipped` periods without a tick.

    Writes the outputs that act until the next tick to `held`.
    """
    st.missed += skipped
    if ahead != 0 and skipped == 0:
        faults.transmit(c[0], f[0], tx, held, k)
    fresh, late, lateness = 1, 0, 0
    if c[0].faulty != 0:
        fresh = faults.receive(c[0], f[0], rx, fresh, k)
        lateness = faults.lateness(c[0], k)
        if lateness > late_ns:
            late = 1
            note_late(st, k, lateness)
    y[0].tick = k
    y[0].t = (k + st.missed) * (period * 1e-9)
    y[0].period = (1 + skipped) * period * 1e-9
    y[0].lateness = lateness * 1e-9
    was = st.state
    m[0].on = 1 if k % 16 == 0 else 0  # reading the clock would cost a fused tick a tenth of its time
    begun = clock.now() if m[0].on != 0 else 0
    tick(p[0], s[0], tables[c[0].table], c[0], rx[0], tx[0], y[0], m[0], k, fresh, late, 1 + skipped, 0)
    tx[0].state = s[0].safety.state
    wrote = clock.now() if m[0].on != 0 else 0
    if (
        ahead == 0 or skipped > 0 or (s[0].safety.state != was and (was == 1 or was == 2))
    ):  # a trip does not wait for a tick
        faults.transmit(c[0], f[0], tx, held, k)
    ring.put(ring_[0], rows, y)
    account(st, s[0].safety, k, rx[0].lost_counts)
    if m[0].on != 0:
        stages(st, m[0], begun, wrote, clock.now())


def meet(st, out, inp, held, rx, rx_staged, period):
    """Exchange outputs that are off until the plant answers one of them, for at most half a second.

    Discards samples that queued while the loop was compiled. The board's watchdog switches off outputs that answer
    an old sample, which would trip the first ticks.
    """
    begun = clock.now()
    wake = begun
    while st.stop == 0 and st.supervisor_lost == 0 and clock.now() - begun < 500_000_000:
        post(st, out, held, clock.now())
        wake += period
        clock.sleep_until(wake)
        link.receive_newest(inp, rx, rx_staged)
        if begun <= rx[0].outputs_t_ns and rx[0].outputs_t_ns <= clock.now():
            break


def send(st, out, c, f, tx, wire, k, now):
    """Send the outputs, as changed by injected faults."""
    if faults.transmit(c, f, tx, wire, k) != 0:
        post(st, out, wire, now)


def post(st, out, frame, now):
    """Send a frame with its sequence number and time."""
    frame[0].seq += 1
    frame[0].t_ns = now
    if not link.send(out, frame):
        st.link_dropped += 1


def stages(st, m, begun, wrote, ticked):
    """Add the durations of the stages of a tick to their histograms."""
    histogram.add(st.read, m.read - begun)
    histogram.add(st.law, m.law - m.read)
    histogram.add(st.write, wrote - m.law)
    histogram.add(st.publish, ticked - wrote)
    histogram.add(st.ticks, ticked - begun)


def note_late(st, k, lateness):
    """Count a late tick, and keep it among the newest ones."""
    last = st.late_ticks[st.late % len(st.late_ticks)]
    last.tick = k
    last.lateness = lateness
    st.late += 1


def account(st, safety, k, lost_counts):
    """Write tick, state and trip to the status record, which the supervisor reads without the ring."""
    st.tick = k + 1
    st.state = safety.state
    st.trip = safety.trip
    st.trip_tick = safety.trip_tick
    st.lost_counts = lost_counts
    st.ready = 1


def plant_real(status, p, s, tx, tx_staged, rx, out, inp, period, most_behind, hold):
    """Run the emulated machine on the wall clock: take the newest outputs, advance one period, send a sample.

    The board has a watchdog: outputs that answer a sample older than `hold` ns, by the plant's clock, are set to zero.
    So a dead loop leaves no output on, and frames delayed in a cut cable have no effect.
    """
    p, s, tx, tx_staged, rx = borrowed(p), borrowed(s), borrowed(tx), borrowed(tx_staged), borrowed(rx)
    st = status[0]
    start(p[0], s[0])
    sample(p[0], s[0], rx[0])
    wake = clock.now() + period
    while st.stop == 0:
        clock.sleep_until(wake)
        woke = clock.now()
        if link.receive_newest(inp, tx, tx_staged) > 0:
            st.frames += 1
        guard(st, tx[0], rx[0], woke - tx[0].inputs_t_ns > hold)
        periods = 1 + (woke - wake) // period  # a late emulator catches up
        if periods > 1:
            st.catch_ups += 1
        if periods > most_behind:
            st.skipped += periods - most_behind
            wake += (periods - most_behind) * period
            periods = most_behind
        for _ in range(periods):
            advance(p[0], s[0], tx[0])
        sample(p[0], s[0], rx[0])
        answer(st, rx, tx, out, clock.now())
        wake += periods * period
        histogram.add(st.ticks, clock.now() - woke)


def guard(st, tx, rx, old):
    """The board's watchdog: set outputs that are too `old` to zero. Outputs that were on are counted and reported."""
    if not old:
        return
    if tx.state == safety.ARMED or tx.state == safety.RUNNING:
        st.watchdog += 1
        rx.watchdog += 1
        rx.watchdog_seq = tx.seq
    tx.ao_codes[:] = 0
    tx.dio_lines = 0
    tx.state = 0


def plant_lockstep(status, p, s, tx, tx_staged, rx, out, inp):
    """Run the emulated machine in lockstep on virtual time: send a sample, take outputs, advance one period."""
    p, s, tx, tx_staged, rx = borrowed(p), borrowed(s), borrowed(tx), borrowed(tx_staged), borrowed(rx)
    st = status[0]
    start(p[0], s[0])
    while st.stop == 0:
        sample(p[0], s[0], rx[0])
        answer(st, rx, tx, out, clock.now())
        while link.receive(inp, tx, tx_staged) == 0:
            if st.stop != 0:
                return
        st.frames += 1
        advance(p[0], s[0], tx[0])


def answer(st, rx, tx, out, now):
    """Send a sample with its number, its time, and the number and time of the newest outputs."""
    rx[0].seq += 1
    rx[0].t_ns = now
    rx[0].outputs_seq = tx[0].seq
    rx[0].outputs_t_ns = tx[0].t_ns
    link.send(out, rx)
    st.tick += 1
    st.ready = 1
