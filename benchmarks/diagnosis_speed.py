"""Duration of a diagnosis, in seconds and in simulations of the recording.

    python benchmarks/diagnosis_speed.py [--json] [--machine ivu|ldu|both] [--plain]

Records the emulated machine with an effect missing in its nominal model (60 s of the IVU at 500 Hz, 10 s of the LDU at
10 kHz; `--plain`: without missing physics). Runs `rtctl diagnose` with the whole library on all CPUs as a separate
process, and measures wall time, CPU time and peak memory. The reference is one simulation of the nominal model for the
recording: the fastest of ten before and ten after the diagnosis.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from lateness import rtctl_command

from rtctl.diagnose.answer.load import load
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator

MACHINES = {
    "ivu": (60, 1.0, "rad", 3.0, "{term: friction.stribeck, node: motor1, F_s: 4.0e-3, v_s: 0.3}"),
    "ldu": (10, 2.0, "mm", 0.5, "{term: drive.deadband, node: drive, band: 0.1}"),
}
TRIES = 10


def record(machine: str, plain: bool, folder: Path) -> Path:
    """Bundle of steps to and fro over the whole recording; its case.json is without the concealed effect."""
    seconds, size, unit, apart, term = MACHINES[machine]
    at = [apart * (k + 0.5) for k in range(int(seconds / apart))]
    steps = [f"  - {{at: {t} s, to: {size * (1, 0, -1, 0)[k % 4]} {unit}}}" for k, t in enumerate(at)]
    reference, bundle = folder / "steps.yaml", folder / "bundle"
    reference.write_text("\n".join(["steps:", *steps]) + "\n")
    more = () if plain else ("--set", f"plant.physics=[{term}]")
    command = (
        *rtctl_command(), "run", machine, "--mode", "fused", "--reference", str(reference), "--for", f"{seconds}s",
        "--no-plot", "--out", str(bundle), *more,
    )  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    case = json.loads((bundle / "case.json").read_text())
    case["config"]["plant"]["physics"] = []
    (bundle / "case.json").write_text(json.dumps(case))
    return bundle


def one_simulation(sim: Simulator) -> float:
    """Shortest time in s of several simulations of the nominal model."""
    model, times = nominal(sim.case), []
    for _ in range(TRIES):
        before = time.perf_counter()
        sim.run(model)
        times.append(time.perf_counter() - before)
    return min(times)


def diagnosed(machine: str, plain: bool) -> dict[str, Any]:
    """Durations, memory and result of a diagnosis."""
    with tempfile.TemporaryDirectory(prefix="rtb-", dir="/tmp") as name:
        bundle, out = record(machine, plain, Path(name)), Path(name) / "out"
        sim = Simulator(load(bundle))
        sim.run(nominal(sim.case))  # compiles where needed
        quickest = one_simulation(sim)
        before = time.monotonic()
        command = (*rtctl_command(), "diagnose", str(bundle), "--no-report", "--out", str(out))
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        wall = time.monotonic() - before
        if status:
            raise RuntimeError(f"{' '.join(command)} ended with {os.waitstatus_to_exitcode(status)}")
        quickest = min(quickest, one_simulation(sim))
        told = json.loads((out / "diagnosis.json").read_text())
    cpu = used.ru_utime + used.ru_stime
    return {
        "seconds_recorded": MACHINES[machine][0], "wall_s": round(wall, 1), "cpu_s": round(cpu, 1),
        "peak_MB": round(used.ru_maxrss / 1024), "one_simulation_ms": round(1e3 * quickest, 2),
        "in_simulations": round(cpu / quickest), "verdict": told["verdict"],
        "names": [effect["name"] for effect in told["effects"]],
    }  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--machine", choices=(*MACHINES, "both"), default="both")
    parser.add_argument("--plain", action="store_true", help="recordings without missing physics")
    given = parser.parse_args()
    machines = tuple(MACHINES) if given.machine == "both" else (given.machine,)
    result = {machine: diagnosed(machine, given.plain) for machine in machines}
    if given.json:
        print(json.dumps(result))
        return 0
    for machine, r in result.items():
        told = " ".join([r["verdict"], *r["names"]])
        print(f"{machine}: {r['seconds_recorded']} s recorded, {told} in {r['wall_s']} s, {r['cpu_s']} s of CPU"
              f" or {r['in_simulations']} simulations, {r['peak_MB']} MB")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
