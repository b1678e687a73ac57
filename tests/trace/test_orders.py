"""Journal of orders: bit-exact round trip, and only the torn last line is lost."""

import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.loop.mailbox import COMMAND
from rtctl.tick import faults
from rtctl.trace.orders import ORDERS, Journal, orders, restore


def command(order, target=0.0):
    record = np.zeros(1, COMMAND)[0]
    record["order"], record["arm"], record["setpoint"]["target"] = order, 1, target
    faults.fill(record, [faults.Fault(faults.LINK_LOSS, 0, 10, faults.FOR_EVER, 0.1 + order)])
    return record


def test_every_order_is_read_back_bit_exact(tmp_path):
    journal = Journal()
    journal.note(command(1), {})
    journal.open(tmp_path)
    journal.note(command(2, 0.1 + 0.2), {"law.position.gain": 20.0})
    journal.close()
    found = orders(tmp_path)
    assert list(found) == [1, 2] and found[2].changed == {"law.position.gain": 20.0}
    for number, target in ((1, 0.0), (2, 0.1 + 0.2)):
        back = np.zeros(1, COMMAND)[0]
        restore(back, found[number].command)
        assert back == command(number, target)


def test_recording_without_a_journal_has_no_orders(tmp_path):
    assert orders(tmp_path) == {}


def test_torn_last_line_is_skipped_and_any_other_damage_is_an_error(tmp_path):
    journal = Journal()
    journal.open(tmp_path)
    journal.note(command(1), {})
    journal.note(command(2), {})
    journal.close()
    path = tmp_path / ORDERS
    text = path.read_text()
    path.write_text(text[:-40])
    assert list(orders(tmp_path)) == [1]
    path.write_text("{}\n" + text)
    with pytest.raises(UserError, match=r"orders.jsonl, line 1: not an order"):
        orders(tmp_path)


def test_full_disk_ends_the_journal_but_not_the_run(tmp_path):
    journal = Journal()
    journal.open(tmp_path)
    journal._file.close()
    journal._file = open("/dev/full", "wb", buffering=0)  # noqa: SIM115, PTH123
    journal.note(command(1), {})
    journal.note(command(2), {})
