"""Feeds inputs to a target in a separate process: a crash, a hang or memory growth is a finding with its input.

The child writes every input into shared memory before it is taken. The parent looks whether the number of the input
moves: a child that stands still is killed, one that died is replaced, and the input that it left is reported.
"""

import contextlib
import json
import mmap
import os
import re
import resource
import select
import signal
import struct
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

from target import Kind

SHM = Path("/dev/shm")
LONGEST = 1 << 20  # bytes kept of an input
HEAD = struct.Struct("<qq")  # number of the input, its length
ROOM = 2 << 30  # bytes, additional address space of a target
GROWTH = 256 << 20  # bytes, additional memory of one input
MOST = 10  # findings per target, each of a different kind


class Finding(NamedTuple):
    target: str
    what: str
    input: bytes

    def as_dict(self) -> dict[str, Any]:
        return {"target": self.target, "what": self.what, "input": self.input[:4000].hex()}


class Outcome(NamedTuple):
    target: str
    inputs: int
    seconds: float
    slowest_s: float
    findings: list[Finding]


def run(name: str, kind: Kind, inputs: int, seed: int = 1, patience: float = 5.0) -> Outcome:
    """Feed `inputs` mutants to a target. An input that takes more than `patience` s is a hang."""
    began = time.monotonic()
    findings: list[Finding] = []
    done, slowest, attempt = 0, 0.0, 0
    while done < inputs and len(findings) < MOST:
        with tempfile.TemporaryDirectory(prefix="rtf-", dir=SHM if SHM.is_dir() else None) as folder:
            fed, slow, found = _one_child(name, kind, inputs - done, f"{seed}-{name}-{attempt}", folder, patience)
        done, slowest, attempt = done + fed, max(slowest, slow), attempt + 1
        findings += found
    return Outcome(name, done, round(time.monotonic() - began, 2), slowest, findings)


def _one_child(
    name: str, kind: Kind, inputs: int, seed: str, folder: str, patience: float
) -> tuple[int, float, list[Finding]]:
    shared = mmap.mmap(-1, HEAD.size + LONGEST)
    HEAD.pack_into(shared, 0, -1, 0)
    read_end, write_end = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(read_end)
        code = 1
        try:
            _child(kind, inputs, seed, folder, shared, os.fdopen(write_end, "w", buffering=1))
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    os.close(write_end)
    findings, slowest, hung = [], 0.0, False
    last, since = -1, time.monotonic()
    told = b""
    while True:
        ready, _, _ = select.select([read_end], [], [], 0.2)
        if ready:
            more = os.read(read_end, 65536)
            if not more:
                break
            told += more
        number = HEAD.unpack_from(shared)[0]
        if number != last:
            last, since = number, time.monotonic()
        elif number >= 0 and time.monotonic() - since > patience:  # before the first input it may have to compile
            hung = True
            os.kill(pid, signal.SIGKILL)
            break
    os.close(read_end)
    status = os.waitpid(pid, 0)[1]
    number, length = HEAD.unpack_from(shared)
    if number < 0:
        raise RuntimeError(f"the target {name} could not be set up")
    at = bytes(shared[HEAD.size : HEAD.size + length])
    for line in told.decode().splitlines():
        with contextlib.suppress(ValueError):  # cut off by its death
            entry = json.loads(line)
            slowest = max(slowest, entry.get("slowest", 0.0))
            if "what" in entry:
                findings.append(Finding(name, entry["what"], bytes.fromhex(entry["input"])))
    if hung:
        findings.append(Finding(name, f"no end within {patience:g} s", at))
    elif os.WIFSIGNALED(status):
        findings.append(Finding(name, f"died by {signal.Signals(os.WTERMSIG(status)).name}", at))
    elif os.WEXITSTATUS(status):
        findings.append(Finding(name, "ended by itself", at))
    return number + 1, slowest, findings


def _child(kind: Kind, inputs: int, seed: str, folder: str, shared: mmap.mmap, tell: Any) -> None:
    os.chdir(folder)
    target = kind.make(Path(folder))
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + ROOM, held + ROOM))
    warnings.simplefilter("error")  # on somebody's terminal it is a finding as well
    warnings.simplefilter("ignore", ResourceWarning)
    rng, kinds, slowest = Random(seed), set[str](), 0.0
    peak = _peak()
    for number in range(inputs):
        data = target.mutant(rng)
        kept = data[:LONGEST]
        shared[HEAD.size : HEAD.size + len(kept)] = kept
        HEAD.pack_into(shared, 0, number, len(kept))
        began = time.thread_time()
        what = _tried(target.feed, data)
        slowest = max(slowest, time.thread_time() - began)
        now = _peak()
        if not what and now - peak > GROWTH:
            what = f"took {(now - peak) >> 20} MiB"
        peak = max(peak, now)
        if what and (sort := re.sub("'.*'|[0-9]", "", what)) not in kinds:
            kinds.add(sort)
            tell.write(json.dumps({"what": what, "input": kept.hex()}) + "\n")
            if len(kinds) >= MOST:
                break
    tell.write(json.dumps({"slowest": slowest}) + "\n")


def _tried(feed: Callable[[bytes], None], data: bytes) -> str:
    """Failure of the target for an input; empty if there is none."""
    try:
        feed(data)
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:300]} ({Path(where.filename).name}:{where.lineno})"
    return ""


def _peak() -> int:
    """Peak memory, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
