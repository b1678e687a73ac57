"""Emulated machines whose mechanics are in a file of the user's own: the board, its counters and sensors around it."""

from typing import Any, NamedTuple

from rtctl.drivers import at_mio_16de, daq_stc, ldu_amplifier, linear_scale, ls7084, optical_sensor
from rtctl.machines import axis, ivu_plant, ldu_plant
from rtctl.machines.base import Block, Column, PlantDiagram
from rtctl.own.parts import Parts
from rtctl.own.plant import INPUTS, TRUTH, own_plants

COLUMNS: dict[str, tuple[Column, ...]] = {"axis": axis.TRUTH, "ldu": ldu_plant.TRUTH, "ivu": ivu_plant.TRUTH}


class StepParams(NamedTuple):
    h: float  # s, of a substep


def is_own(config: Any) -> bool:
    """Whether the plant of a config is a file of the user's own."""
    return type(config.plant) in own_plants


def plant_diagram(config: Any, period: float, seed: int, substeps: int) -> PlantDiagram:
    """Blocks and lines of the emulated machine, advanced by `period` s a call."""
    kind, h = config.kind, period / substeps
    parts = own_plants[type(config.plant)]
    blocks, read, write, sample = {"axis": _axis, "ldu": _ldu, "ivu": _ivu}[kind](config, h, seed)
    fields = parts.state.names or ()
    truth = (f"s.own.{name}" if name in fields else "np.nan" for name in TRUTH[kind])
    used = [line for lines in (read, write, sample) for line in lines]
    step = parts.call("step", "own", INPUTS[kind])
    return PlantDiagram(
        uses=(parts.module.__name__, *(m for m in DRIVERS if any(m.rpartition(".")[2] in u for u in [*used, step]))),
        blocks=(Block("plant", StepParams(h), None), Block("own", parts.build(config.plant, h), parts.state), *blocks),
        truth=COLUMNS[kind],
        start=(parts.call("start", "own", {}),),
        advance=(("drives", read), ("physics", (step,)), ("encoders", write)),
        sample=(("scan", sample), ("truth", tuple(f"rx.truth[{i}] = {value}" for i, value in enumerate(truth)))),
    )


def parts_of(config: Any) -> Parts | None:
    """The parts of an own plant, None for one that comes with rtctl."""
    return own_plants.get(type(config.plant))


DRIVERS = tuple(
    f"rtctl.drivers.{name}"
    for name in ("at_mio_16de", "daq_stc", "ldu_amplifier", "linear_scale", "ls7084", "optical_sensor")
)
Lines = tuple[str, ...]


def _axis(config: Any, h: float, seed: int) -> tuple[tuple[Block, ...], Lines, Lines, Lines]:
    blocks = (
        Block("output", at_mio_16de.build_output(config.output, h), at_mio_16de.ANALOG_OUTPUT_STATE),
        Block("encoder", linear_scale.build(config.encoder, h), linear_scale.LINEAR_SCALE_STATE),
        Block("counter0", None, daq_stc.COUNTER_STATE),
    )
    return (
        blocks,
        ("volts = at_mio_16de.output_step(p.output, s.output, tx.ao_codes[0], p.plant.h)",),
        (
            "pulses = linear_scale.step(p.encoder, s.encoder, s.own.x)",
            "daq_stc.counter_step(s.counter0, abs(pulses), pulses > 0)",
        ),
        ("rx.counter_codes[0] = daq_stc.counter_step(s.counter0, 0, 1)",),
    )


def _ldu(config: Any, h: float, seed: int) -> tuple[tuple[Block, ...], Lines, Lines, Lines]:
    output = at_mio_16de.build_output(config.board.output, h)
    blocks = (
        Block("amplifier", ldu_amplifier.build(config.amplifier, h, output.volts_per_code), None),
        Block("output", output, at_mio_16de.ANALOG_OUTPUT_STATE),
        Block("encoder", ls7084.build(config.sensors.encoder, h), ls7084.LS7084_STATE),
        Block("counter0", None, daq_stc.COUNTER_STATE),
        Block("scale", linear_scale.build(config.sensors.scale, h), linear_scale.LINEAR_SCALE_STATE),
        Block("counter1", None, daq_stc.COUNTER_STATE),
    )
    return (
        blocks,
        (
            "volts = at_mio_16de.output_step(p.output, s.output, tx.ao_codes[0], p.plant.h)",
            f"forward = (tx.dio_lines >> {config.board.direction_line}) & 1",
            "volts = volts if forward != 0 else -volts",
        ),
        (
            "pulses = ls7084.step(p.encoder, s.encoder, s.own.encoder, p.plant.h)",
            "daq_stc.counter_step(s.counter0, abs(pulses), pulses > 0)",
            "pulses = linear_scale.step(p.scale, s.scale, s.own.scale)",
            "daq_stc.counter_step(s.counter1, abs(pulses), pulses > 0)",
        ),
        (
            "rx.counter_codes[0] = daq_stc.counter_step(s.counter0, 0, 1)",
            "rx.counter_codes[1] = daq_stc.counter_step(s.counter1, 0, 1)",
            "rx.lost_counts = s.encoder.lost",
        ),
    )


def _ivu(config: Any, h: float, seed: int) -> tuple[tuple[Block, ...], Lines, Lines, Lines]:
    board = config.board
    blocks = (
        Block("output1", at_mio_16de.build_output(board.output1, h), at_mio_16de.ANALOG_OUTPUT_STATE),
        Block("output2", at_mio_16de.build_output(board.output2, h), at_mio_16de.ANALOG_OUTPUT_STATE),
        Block("capstan", ls7084.build(config.sensors.capstan, h), ls7084.LS7084_STATE),
        Block("counter0", None, daq_stc.COUNTER_STATE),
        Block("reel1", optical_sensor.build(config.sensors.reel1, h), None),
        Block("reel2", optical_sensor.build(config.sensors.reel2, h), None),
        *(
            Block(name, at_mio_16de.build_input(wire, h, board.dither, i, seed), at_mio_16de.ANALOG_INPUT_STATE)
            for i, (name, wire) in enumerate((("input1", board.reel1), ("input2", board.reel2)))
        ),
    )
    return (
        blocks,
        tuple(
            f"u{i} = at_mio_16de.output_step(p.output{i}, s.output{i}, tx.ao_codes[{i - 1}], p.plant.h)" for i in (1, 2)
        ),
        (
            "pulses = ls7084.step(p.capstan, s.capstan, s.own.capstan, p.plant.h)",
            "daq_stc.counter_step(s.counter0, abs(pulses), pulses > 0)",
        ),
        (
            "rx.counter_codes[0] = daq_stc.counter_step(s.counter0, 0, 1)",
            *(
                f"rx.ai_codes[{i - 1}] = at_mio_16de.input_step("
                f"p.input{i}, s.input{i}, optical_sensor.volts(p.reel{i}, s.own.reel{i}))"
                for i in (1, 2)
            ),
            "rx.lost_counts = s.capstan.lost",
        ),
    )
