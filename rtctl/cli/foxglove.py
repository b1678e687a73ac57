"""`rtctl foxglove`: a running machine in Foxglove, live."""

from typing import Annotated

import typer

from rtctl.cli import common

app = typer.Typer(add_completion=False)


@app.command()
def foxglove(
    name: Annotated[
        str | None, typer.Argument(metavar="[MACHINE]", help="The machine's `name`; the only one if absent.")
    ] = None,
    port: Annotated[int, typer.Option(metavar="N", min=0, max=65535, help="Port; 0 chooses a free one.")] = 8765,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Address to listen at.")] = "127.0.0.1",
    rate: Annotated[float, typer.Option(metavar="HZ", min=1, help="Most rows a second; others as min and max.")] = 500,
    whole: Annotated[bool, typer.Option("--whole", help="Every row, however many.")] = False,
    control: Annotated[bool, typer.Option("--control", help="Let viewers change settings and the setpoint.")] = False,
) -> None:
    """Serve a running machine to Foxglove: rows, status and events as channels, settings as parameters.

    There is no password: anyone who reaches the port can read, and with --control can set gains. So --control works on
    127.0.0.1 only. From another computer, forward the port: ssh -L 8765:127.0.0.1:8765 BENCH.

    Examples:

      rtctl foxglove ivu

      rtctl foxglove ldu --whole --port 9000

      rtctl foxglove ivu --control
    """
    from rtctl.config.errors import UserError

    if control and host not in ("127.0.0.1", "::1", "localhost"):
        raise UserError(f"--control at {host}: only 127.0.0.1 may be opened with it, since there is no password")
    with common.client(name) as client:
        try:
            from rtctl.foxglove.bridge import Bridge
        except ModuleNotFoundError as error:
            if (error.name or "").partition(".")[0] != "foxglove":
                raise
            raise UserError("this needs the package foxglove-sdk: pip install 'rtctl[foxglove]'") from None

        common.first_status(client)
        with Bridge(client, host, port, None if whole else rate, control) as bridge:
            typer.echo(f"{bridge.url}\n{bridge.app_url}\nCtrl-C ends", err=True)
            try:
                bridge.run()
            except KeyboardInterrupt:
                return
