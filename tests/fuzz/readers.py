"""What is read from files and from a person: quantities, configs, bundles, keys."""

import json
import math
import tempfile
from pathlib import Path
from random import Random
from typing import Any

import mutators
import numpy as np
import yaml
from target import CONFIGS, Target, as_json, of_bytes, of_json, of_text

from rtctl import machines
from rtctl.case.format1 import read_case
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import load_settings, set_path
from rtctl.config.units import to_si
from rtctl.config.yaml_file import parse
from rtctl.daemon import keys
from rtctl.loop.mailbox import COMMAND
from rtctl.trace.bundle import ARROWS, PARQUET, load_bundle, load_case, save_case
from rtctl.trace.columns import Column
from rtctl.trace.orders import ORDERS, Journal, orders, restore
from rtctl.trace.recorder import Recorder
from rtctl.trace.repair import repair
from rtctl.trace.rotation import Rotation
from rtctl.trace.stream import StreamWriter
from rtctl.trace.trigger import Trigger

TRIGGERS = ("abs(error) > 1e-3 and u1 < 2", "not (t >= 1 or max(u1, -t, 3) == 2)", "-1e-3 < error <= u1*2/t")
UNITS = ("80 Hz", "1.5 mNm", "20mm/s", "160 ms", "2.4e-3", "3 V/rad", "1/s", "5 %")


def unit(_: Path) -> Target:
    """A quantity as a person writes it."""

    def feed(data: bytes) -> None:
        wanted = ("Hz", "m", "s", "V/rad", "", "N")[len(data) % 6]
        try:
            found = to_si(data.decode("utf-8", "replace"), wanted)
        except ValueError:
            return
        assert isinstance(found, float)

    seeds = tuple(text.encode() for text in UNITS)
    return Target(feed, of_text(*seeds))


def trigger(_: Path) -> Target:
    """The condition of a capture."""
    rows = np.zeros(4, [("t", "f8"), ("u1", "f8"), ("error", "f8"), ("n", "i8")])
    rows["u1"] = [0.0, math.nan, math.inf, -1.0]

    def feed(data: bytes) -> None:
        try:
            made = Trigger(data.decode("utf-8", "replace"), rows.dtype.names or ())
        except UserError:
            return
        assert -1 <= made(rows) < 4

    seeds = tuple(text.encode() for text in TRIGGERS)
    return Target(feed, of_text(*seeds))


def setting(_: Path) -> Target:
    """A new value at a path, and the machine built with it."""
    configs = [machines.CONFIGS[kind].model_validate(yaml.safe_load((CONFIGS / f"{kind}.yaml").read_text()))
               for kind in ("ivu", "ldu", "axis")]  # fmt: skip
    leaves = [list(_leaves(config.model_dump(mode="json"))) for config in configs]

    def feed(data: bytes) -> None:
        which, path, value = json.loads(data)
        try:
            machines.build(set_path(configs[which], path, value))
        except (UserError, ValueError):
            return

    def mutant(rng: Random) -> bytes:
        which = rng.randrange(3)
        path, value = rng.choice(leaves[which])
        if rng.random() < 0.2:
            path = mutators.of_text(rng, (path.encode(),)).decode("utf-8", "replace")
        return as_json([which, path, mutators.of_tree(rng, value)])

    return Target(feed, mutant)


def _leaves(node: Any, path: str = "") -> Any:
    """Path and value of everything in plain data, groups included."""
    if path:
        yield path, node
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, item in items:
        yield from _leaves(item, f"{path}.{key}" if path else str(key))


def yaml_text(_: Path) -> Target:
    """YAML, whatever it says."""
    seeds = tuple(path.read_bytes() for path in sorted(CONFIGS.glob("references/*.yaml")))
    seeds += (b"a: &x [1, 2]\nb: [*x, *x, *x]\n", b"!!python/object:os.system {x: 1}\n", b"- 'a'\n- |\n  x\n- 0x1F\n")

    def feed(data: bytes) -> None:
        try:
            found = parse(data.decode("utf-8", "replace"), "x.yaml")
        except UserError as error:
            assert len(str(error)) < 2000
        else:
            assert len(found.lines) <= 20_001

    return Target(feed, of_text(*seeds))


def config(folder: Path) -> Target:
    """A config file, read, checked and built."""
    path = folder / "x.yaml"
    seeds = tuple((CONFIGS / f"{kind}.yaml").read_bytes() for kind in ("ivu", "ldu", "axis"))
    models = tuple(machines.CONFIGS.values())

    def feed(data: bytes) -> None:
        path.write_bytes(data)
        model = next((m for kind, m in machines.CONFIGS.items() if kind.encode() in data[:40]), models[0])
        try:
            machines.build(load_settings(path, model))
        except (UserError, ValueError):
            return

    return Target(feed, of_text(*seeds))


COLUMNS = tuple(Column(name, unit, "") for name, unit in (("tick", ""), ("t", "s"), ("u", "V"), ("x", "m")))
ROW = np.dtype([("tick", "i8"), ("t", "f8"), ("u", "f8"), ("x", "f8")])
CASE = {
    "format": 1, "plant": "axis", "sample_rate": 500.0, "delay_samples": 1.0, "parameters": {"M": 1.0, "K": 2.0},
    "sensors": {"x_resolution_m": 1e-6}, "drive": {"newton_per_volt": 1.0, "limit_volt": 10.0, "dac_bits": 12},
    "controller": {"kind": "pd", "P": 100.0, "D": 1.0, "derivative_filter_hz": 80.0}, "controller_known": True,
    "reaches": {"parameter_tolerance": 0.15}, "notes": "x", "losses": {"rows": 0, "gaps": []}, "rows": 40,
}  # fmt: skip


def _rows(count: int) -> np.ndarray:
    rows = np.zeros(count, ROW)
    rows["tick"] = np.arange(count)
    rows["t"], rows["u"] = rows["tick"] * 0.002, np.sin(rows["tick"])
    return rows


def case(folder: Path) -> Target:
    """case.json of a bundle."""

    def feed(data: bytes) -> None:
        (folder / "case.json").write_bytes(data)
        try:
            read_case(load_case(folder), folder)
        except (UserError, NoAnswer):
            return

    return Target(feed, of_json(CASE))


def parquet(folder: Path) -> Target:
    """recording.parquet of a bundle."""
    run = Recorder(folder / "whole", COLUMNS, ROW, CASE)
    run.put(_rows(200))
    seeds = ((run.finish() / PARQUET).read_bytes(),)
    save_case(folder, CASE)

    def feed(data: bytes) -> None:
        (folder / PARQUET).write_bytes(data)
        try:
            found = load_bundle(folder)
        except UserError:
            return
        assert len({len(column) for column in found.columns.values()}) == 1

    return Target(feed, of_bytes(*seeds))


def stream(folder: Path) -> Target:
    """What a killed recording left behind."""
    path = folder / "whole.arrows"
    writer = StreamWriter(path, COLUMNS, ROW, {"case": json.dumps(CASE)})
    for size in (1, 20, 5):
        writer.write(_rows(size))
    writer.close()
    seeds = (path.read_bytes(),)

    def feed(data: bytes) -> None:
        (folder / ARROWS).write_bytes(data)
        (folder / PARQUET).unlink(missing_ok=True)
        save_case(folder, CASE)
        try:
            found = repair(folder)
        except (UserError, NoAnswer):
            return
        assert found.rows >= 0 and not (folder / ARROWS).exists()

    return Target(feed, of_bytes(*seeds))


def repaired(folder: Path) -> Target:
    """The cases of a long recording of which one part was killed."""
    run = Recorder(folder / "run", COLUMNS, ROW, CASE, rotation=Rotation(minutes=0.1 / 60))
    run.put(_rows(120))
    whole = run.finish()
    stream = StreamWriter(folder / ARROWS, COLUMNS, ROW, {"case": json.dumps(CASE)})
    stream.write(_rows(20))
    stream.close()
    kept = {path: path.read_bytes() for path in whole.rglob("*") if path.is_file()}

    def feed(data: bytes) -> None:
        for path, content in kept.items():
            path.write_bytes(content)
        (whole / ("case.json", "part-0001/case.json", "part-0003/case.json")[len(data) % 3]).write_bytes(data)
        (whole / "part-0003" / PARQUET).unlink()
        (whole / "part-0003" / ARROWS).write_bytes((folder / ARROWS).read_bytes())
        try:
            rows = repair(whole).rows
            assert rows in (100, 120) and repair(whole).rows == rows  # a case that cannot be written keeps its stream
        except UserError as error:
            assert "JSON" in str(error)

    return Target(feed, of_json(CASE))


def journal(folder: Path) -> Target:
    """orders.jsonl beside a recording, and its orders put back into a command record."""
    record = np.zeros(1, COMMAND)[0]
    written = Journal()
    written.open(folder)
    for number in range(3):
        record["order"] = number
        written.note(record, {"law.position.gain": 100.0})
    written.close()
    seeds = ((folder / ORDERS).read_bytes(),)

    def feed(data: bytes) -> None:
        (folder / ORDERS).write_bytes(data)
        try:
            for order in orders(folder).values():
                restore(record, order.command)
        except UserError:
            return

    return Target(feed, of_text(*seeds))


def key_file(folder: Path) -> Target:
    """A public key that a client sent."""
    with tempfile.TemporaryDirectory() as made:
        seeds = (keys.new_keys("a", Path(made))[0].read_bytes(),)
    path = folder / "a.key"

    def feed(data: bytes) -> None:
        path.write_bytes(data)
        try:
            assert len(keys.load_public(path)) == 40
        except UserError:
            return

    return Target(feed, of_bytes(*seeds))
