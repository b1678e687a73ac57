"""Plan of a campaign: all runs by number, as plain data for any process."""

import hashlib
import json
from collections.abc import Callable
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any

import pyarrow as pa

from rtctl import machines
from rtctl.campaign.axes import CONFIG, REFERENCE, Axis, place_of, reference_of, resolve
from rtctl.campaign.metrics import METRICS
from rtctl.campaign.settings import CampaignSettings, KeepSettings
from rtctl.config.errors import UserError
from rtctl.config.fields import written
from rtctl.config.load import load_settings, set_paths
from rtctl.config.yaml_file import find, load_yaml
from rtctl.sources import sources_hash
from rtctl.trace import metrics as step

MOST_RUNS = 1_000_000
CHUNKS = 200  # approximate number of parts of a large campaign
MOST_TICKS = 2_000_000  # ticks of a run; its rows are held in memory
AFTER = 2.0  # s after the end of a reference
Load = Callable[[str, list[str] | None], Any]  # loader of a config, such as rtctl.cli.common.load_config

FIXED = ("run", "trip", "error")  # columns other than axes and metrics


class Plan:
    """All runs of a campaign. `payload` is plain data (JSON) for workers; its hash identifies the campaign."""

    def __init__(self, payload: dict[str, Any]):
        self.payload = payload
        self.axes: list[Axis] = payload["axes"]
        self.shape = [len(axis[0]["values"]) for axis in self.axes]
        self.columns = {column["name"]: column["labels"] for axis in self.axes for column in axis}
        self.units = {column["name"]: column["unit"] for axis in self.axes for column in axis}
        self.metrics: list[str] = payload["metrics"]
        self.keep = KeepSettings(**payload["keep"])
        self._bases: dict[str, Any] = {}

    @property
    def name(self) -> str:
        return str(self.payload["campaign"])

    @cached_property
    def runs(self) -> int:
        """Number of runs."""
        count = 1
        for length in self.shape:
            count *= length
        return count

    @cached_property
    def identity(self) -> str:
        """Hash of the campaign: equal for equal runs in equal order."""
        return hashlib.sha256(json.dumps(self.payload, sort_keys=True).encode()).hexdigest()

    @property
    def chunk(self) -> int:
        """Number of runs in a part of the results."""
        return min(max(-(-self.runs // CHUNKS), 1), 1000)

    @property
    def chunks(self) -> int:
        return -(-self.runs // self.chunk)

    def numbers(self, chunk: int) -> range:
        """Numbers of the runs of a chunk."""
        return range(chunk * self.chunk, min((chunk + 1) * self.chunk, self.runs))

    def at(self, run: int) -> list[int]:
        """Index of a run on each axis; the last axis varies fastest."""
        places = []
        for length in reversed(self.shape):
            run, place = divmod(run, length)
            places.append(place)
        return places[::-1]

    def labels(self, run: int) -> dict[str, Any]:
        """Label of a run on each axis, for the table."""
        pairs = zip(self.axes, self.at(run), strict=True)
        return {column["name"]: column["labels"][place] for axis, place in pairs for column in axis}

    def changes(self, run: int) -> dict[str, Any]:
        """Dotted path of a setting -> its value in this run, including `config`."""
        pairs = zip(self.axes, self.at(run), strict=True)
        return {path: c["values"][place] for axis, place in pairs for c in axis for path in c["paths"]}

    def config(self, run: int) -> Any:
        """Settings of a run. Raises UserError for an invalid value."""
        changes = self.changes(run)
        base = self.base(changes.pop(CONFIG, next(iter(self.payload["bases"]))))
        return set_paths(base, changes)

    def base(self, name: str) -> Any:
        """Base settings of the runs with config `name`."""
        if name not in self._bases:
            data = self.payload["bases"][name]
            self._bases[name] = machines.settings(data)
        return self._bases[name]

    def ticks(self, machine: Any) -> int:
        """Length of a run in ticks. Raises UserError above MOST_TICKS."""
        seconds = self.payload["seconds"]
        if seconds is None:
            table = machine.reference
            seconds = AFTER + max(float(table.t[table.n - 1]), table.period * machine.dt)
        ticks = round(seconds * machine.rate)
        if not 1 < ticks <= MOST_TICKS:
            raise UserError(f"{seconds:g} s are {ticks} ticks; a run of a campaign has 2 to {MOST_TICKS}")
        return ticks

    @cached_property
    def schema(self) -> pa.Schema:
        """Arrow schema of the results."""
        fields = [pa.field("run", pa.int64(), nullable=False)]
        fields += [
            pa.field(name, _kind(labels), metadata={"unit": self.units[name]}) for name, labels in self.columns.items()
        ]
        fields += [
            pa.field(name, pa.float64(), metadata={"unit": METRICS[name].unit, "help": METRICS[name].words})
            for name in self.metrics
        ]
        fields += [pa.field(name, pa.string(), nullable=False) for name in ("trip", "error")]
        return pa.schema(fields)


def _kind(labels: list[Any]) -> pa.DataType:
    if all(isinstance(x, bool) for x in labels):
        return pa.bool_()
    if all(isinstance(x, int) and not isinstance(x, bool) and abs(x) < 2**62 for x in labels):
        return pa.int64()
    if all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in labels):
        return pa.float64()
    return pa.string()


def find_campaign(name: str) -> Path:
    """Path of a campaign file: as given, or among the campaigns of rtctl. Raises UserError."""
    shipped = Path(str(resources.files("rtctl.configs"))) / "campaigns"
    for place in (Path(name), Path(f"{name}.yaml"), shipped / name, shipped / f"{name}.yaml"):
        try:
            if place.is_file():
                return place
        except (OSError, ValueError):
            break
    return find(name)


def load_plan(name: str, load: Load, seconds: float | None = None) -> Plan:
    """Plan from a campaign file; `load` reads configs, `seconds` replaces the length in the file.

    A machine's config is a campaign of one run: an experiment proposed by `rtctl diagnose` runs unchanged. Raises
    UserError with file, line and key.
    """
    path = find_campaign(name)
    document = load_yaml(path)
    data = document.data if isinstance(document.data, dict) else {}
    if "machine" in data and "campaign" not in data:
        one = KeepSettings(bundles="all")
        settings = CampaignSettings(campaign=load(str(path), None).name, config=str(path.absolute()), keep=one)
        document = document._replace(lines={})
    else:
        settings = load_settings(path, CampaignSettings)

    def where(key: tuple) -> str:
        line = document.line(key)
        return f"{path}:{line}" if line else str(path)

    def near(file: str) -> Path:
        beside = path.parent / file
        return beside if beside.is_file() else find(file)

    names = _configs(settings, where)
    bases = {each: _base(settings, each, where, near, load) for each in names}
    first = bases[names[0]]
    axes = [resolve(key, given, first, where, near) for key, given in settings.matrix.items()]
    _check_columns(axes, where)
    payload = {
        "campaign": settings.campaign,
        "seconds": seconds or settings.seconds,
        "trips": settings.trips,
        "metrics": settings.metrics or list(METRICS),
        "keep": settings.keep.model_dump(),
        "bases": {each: written(base) for each, base in bases.items()},
        "axes": axes,
        "sources": sources(),
    }
    plan = Plan(json.loads(json.dumps(payload)))
    if plan.runs > MOST_RUNS:
        raise UserError(f"{where(('matrix',))}: matrix: {plan.runs} runs; {MOST_RUNS} are the most")
    return plan


def sources() -> str:
    """Hash of the sources that determine a row: those of the tick and of the metrics."""
    digest = hashlib.sha256(sources_hash().encode())
    for path in (Path(step.__file__ or ""), *(Path(__file__).with_name(name) for name in ("metrics.py", "cell.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _configs(settings: CampaignSettings, where: Any) -> list[str]:
    """Names of base configs: the config of the file, or the values of an axis `config`."""
    given = settings.matrix.get(CONFIG)
    if given is None:
        return [settings.config]
    if not isinstance(given, list) or not given or not all(isinstance(name, str) for name in given):
        raise UserError(f"{where(('matrix', CONFIG))}: matrix.config: expected a list of configs, e.g. [ivu, ldu]")
    return list(dict.fromkeys(given))


def _base(settings: CampaignSettings, name: str, where: Any, near: Any, load: Load) -> Any:
    """Settings of a machine with the changes of `set`. Raises UserError."""
    try:
        config = load(str(near(name)), None)
    except UserError as error:
        key = ("matrix", CONFIG) if CONFIG in settings.matrix else (CONFIG,)
        raise UserError(f"{where(key)}: {'.'.join(key)}: {error}") from None
    changes: dict[str, Any] = {"loop.mode": "fused"}
    for path, value in settings.set.items():
        try:
            place_of(config, path)
            set_paths(config, {path: value})
        except UserError as error:
            raise UserError(f"{where(('set', path))}: set: {error}") from None
        changes[path] = value
    if settings.reference is not None:
        try:
            changes[REFERENCE] = reference_of(config, settings.reference, near)
        except UserError as error:
            raise UserError(f"{where(('reference',))}: reference: {error}") from None
    return set_paths(config, changes)


def _check_columns(axes: list[Axis], where: Any) -> None:
    """Raise UserError where two axes change one setting or have one name."""
    names: set[str] = {*METRICS, *FIXED}
    taken: dict[str, str] = {}
    for axis in axes:
        for column in axis:
            at = f"{where(('matrix', column['name']))}: matrix.{column['name']}"
            if column["name"] in names:
                raise UserError(f"{at}: there is a column '{column['name']}' already; give it another name")
            names.add(column["name"])
            for path in column["paths"]:
                if path in taken:
                    raise UserError(f"{at}: {path} is changed by '{taken[path]}' already")
                taken[path] = column["name"]
