"""rtctl: a real-time controller daemon for motion hardware, with an emulated twin.

What a script needs, under one name each. Every name is loaded when it is first used, so that `import rtctl` is quick.

    import rtctl

    config = rtctl.load_config("ivu", {"law.position.gain": "25 V/rad"})
    run = rtctl.run(config, 5.0)                 # virtual time, in memory: run["capstan"]
    bundle = rtctl.record(config, 5.0, "runs/a") # on disk, as `rtctl run` does it
    found = rtctl.diagnose("runs/a")             # what the model lacks: found.effects, found.report()
    with rtctl.connect("ivu") as machine:        # one that runs
        machine.call("setpoint", value=0.5)

Of everything below these names, only what docs/ describes stays as it is from one version to the next.
"""

TYPE_CHECKING = False  # `python -m rtctl` would look for the module `typing` in the current folder
if TYPE_CHECKING:
    from typing import Any

    from rtctl import diagnose, identify, improve, watch
    from rtctl.api import change, connect, load_config, record, run, run_campaign, steps
    from rtctl.api_bundles import Simulation, export, import_recording, physics, simulate
    from rtctl.api_diagnosis import Diagnosis, Report, diagnosis
    from rtctl.config.errors import NoAnswer, RunFailed, UserError
    from rtctl.daemon.client import Client
    from rtctl.loop.fused import Run
    from rtctl.trace.bundle import Bundle, load_bundle
    from rtctl.trace.compare import compare
    from rtctl.trace.replay import replay

__version__ = "0.1.0"

__all__ = [
    "Bundle", "Client", "Diagnosis", "NoAnswer", "Report", "Run", "RunFailed", "Simulation", "UserError", "change",
    "compare", "connect", "diagnose", "diagnosis", "export", "identify", "import_recording", "improve", "load_bundle",
    "load_config", "physics", "record", "replay", "run", "run_campaign", "simulate", "steps", "watch",
]  # fmt: skip

_WHERE = {  # name -> module and name there; a package that is called as a function has no name there
    "Bundle": "rtctl.trace.bundle:Bundle",
    "Client": "rtctl.daemon.client:Client",
    "Diagnosis": "rtctl.api_diagnosis:Diagnosis",
    "NoAnswer": "rtctl.config.errors:NoAnswer",
    "Report": "rtctl.api_diagnosis:Report",
    "Run": "rtctl.loop.fused:Run",
    "RunFailed": "rtctl.config.errors:RunFailed",
    "Simulation": "rtctl.api_bundles:Simulation",
    "UserError": "rtctl.config.errors:UserError",
    "change": "rtctl.api:change",
    "compare": "rtctl.trace.compare:compare",
    "connect": "rtctl.api:connect",
    "diagnose": "rtctl.diagnose:",
    "diagnosis": "rtctl.api_diagnosis:diagnosis",
    "export": "rtctl.api_bundles:export",
    "identify": "rtctl.identify:",
    "import_recording": "rtctl.api_bundles:import_recording",
    "improve": "rtctl.improve:",
    "load_bundle": "rtctl.trace.bundle:load_bundle",
    "load_config": "rtctl.api:load_config",
    "physics": "rtctl.api_bundles:physics",
    "record": "rtctl.api:record",
    "replay": "rtctl.trace.replay:replay",
    "run": "rtctl.api:run",
    "run_campaign": "rtctl.api:run_campaign",
    "simulate": "rtctl.api_bundles:simulate",
    "steps": "rtctl.api:steps",
    "watch": "rtctl.watch:",
}


def __getattr__(name: str) -> "Any":
    import importlib

    if name not in _WHERE:
        raise AttributeError(f"module 'rtctl' has no attribute '{name}'")
    module, _, there = _WHERE[name].partition(":")
    found = importlib.import_module(module)
    value = globals()[name] = getattr(found, there) if there else found
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
