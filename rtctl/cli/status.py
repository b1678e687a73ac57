"""`rtctl status`: what a running machine does."""

import time
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption, NameOption

app = typer.Typer(add_completion=False)
EVERY = 0.25  # s between two frames or JSON lines
EVERY_LINE = 1.0  # s between two lines where there is no terminal
SIGNALS = (  # signals in the table, where the machine has them
    *("ref", "capstan", "capstan_error", "position", "x", "position_error"),
    *("tension1_estimate", "tension2_estimate"),
)


@app.command()
def status(
    json: JsonOption = False,
    watch: Annotated[bool, typer.Option("--watch", "-w", help="Keep showing it until Ctrl-C.")] = False,
    every: Annotated[
        str | None, typer.Option(metavar="T", help="Interval with --watch; 250ms if absent, to a pipe 1s.")
    ] = None,
    name: NameOption = None,
) -> None:
    """Show state, timing, link and signals of a running machine.

    With --watch it continues across a restart of the daemon. A terminal gets a panel with sparklines of the last 30 s,
    a pipe gets a line each time.

    Examples:

      rtctl status

      rtctl status --watch --every 1s --name ivu

      rtctl status --json | jq .state
    """
    pause = common.seconds(every, "--every")
    if pause is not None and not watch:
        from rtctl.config.errors import UserError

        raise UserError("--every is for --watch; without it the status is shown once")
    with common.client(name) as client:
        found = common.first_status(client) if watch else client.call("status")
        if watch and json:
            _json_lines(client, found, pause or EVERY)
        elif json:
            common.print_json(found)
        elif watch:
            from rich.console import Console

            from rtctl.terminal.screen import takes_pictures
            from rtctl.terminal.watch import Watch

            console = Console()
            Watch(client, found, console).run(pause or (EVERY if takes_pictures(console) else EVERY_LINE))
        else:
            from rich.console import Console

            units = {s["name"]: s["unit"] for s in client.call("signals")["signals"]}
            Console().print(table(found, units))


def _json_lines(client: Any, found: dict[str, Any], every: float) -> None:
    """Print one JSON object a line, until Ctrl-C or the end of the daemon."""
    from rtctl.config.errors import UserError
    from rtctl.daemon.client import listens

    try:
        while True:
            common.print_json(found)
            time.sleep(every)
            found = client.call("status")
    except KeyboardInterrupt:
        return
    except UserError:
        if listens(client.endpoint):
            raise
        typer.echo(f"{found['name']} has ended", err=True)


def table(found: dict[str, Any], units: dict[str, str]) -> Any:
    """Table of a status reply; `units` are the units of the signals by name."""
    from rich.table import Table
    from rich.text import Text

    from rtctl.terminal.view import STYLE

    out = Table(box=None, show_header=False, pad_edge=False)
    out.add_column(style="dim")
    out.add_column()
    late, tick, rows = found["lateness_us"], found["tick_us"], found["rows"]
    out.add_row("machine", Text(f"{found['name']} ({found['machine']}, pid {found['pid']})", "bold"))
    out.add_row("state", Text(found["state"], STYLE.get(found["state"], "")))
    if found["trip"]:
        trip = found["trip"]
        out.add_row("trip", Text(f"{trip['code']} at tick {trip['tick']}: {trip['why']}", "bold red"))
    if found.get("model"):
        from rtctl.daemon.watched import sentence

        out.add_row("model", Text(sentence(found["model"]), "bold red" if found["model"].get("alarm") else ""))
    measured = f", {found['measured_rate_hz']:g} Hz measured" if found["measured_rate_hz"] else ""
    out.add_row("ticks", f"{found['ticks']} at {found['rate_hz']:g} Hz{measured}, {found['mode']}")
    out.add_row("missed", f"{found['missed']} missed, {found['late']} late, {found['overruns']} overruns")
    if found["mode"] == "real":
        out.add_row("lateness", _times(late))
    out.add_row("tick time", _times(tick))
    stages = [f"{name} {found['stages_us'][name]['p50']:.2f}" for name in ("read", "law", "write", "publish")]
    out.add_row("stages", ", ".join(stages) + " us at p50")
    if found["late_ticks"]:
        last = found["late_ticks"][-1]
        out.add_row("last late", f"tick {last['tick']}, by {last['lateness_us']:.0f} us")
    frames = found["frames"]
    out.add_row("link", f"{found['link']}, {frames['received']} frames, {frames['not_sent']} not sent")
    if found["mode"] == "real":
        out.add_row("latency", _times(found["link_latency_us"]))
    recorded = f"{rows['recorded']} recorded, {rows['lost']} lost" if "recorded" in rows else "not recorded"
    failed = f", {rows['error']}" if rows.get("error") else ""
    out.add_row("rows", f"{recorded}, {rows['lost_in_ring']} lost in the ring{failed}")
    for signal in SIGNALS:
        if signal in found["signals"]:
            out.add_row(signal, f"{found['signals'][signal]:+.5g} {units.get(signal, '')}")
    for lack in found["lacks"]:
        out.add_row("lacks", Text(lack, "yellow"))
    return out


def _times(percentiles: dict[str, float]) -> str:
    """Text of percentiles in us."""
    return "p50 {p50:.0f}, p99 {p99:.0f}, p99.9 {p999:.0f}, max {max:.0f} us".format(**percentiles)
