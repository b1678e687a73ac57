"""Messages for refusals of the computer: a full disk, a missing right, a killed process.

A refusal is no mistake of the program. `words` returns a message with what to do, or None for an internal error.
"""

import errno
import os
import traceback
from typing import Any

# errno -> what to do. Everything here comes from the computer or from a path that the user gave.
ADVICE = {
    errno.ENOSPC: "free space on that file system, or write elsewhere with -o",
    errno.EDQUOT: "the quota of this account is used up: free space, or write elsewhere with -o",
    errno.EROFS: "that file system is read-only; write elsewhere with -o",
    errno.EFBIG: "the file system takes no file of this size; write elsewhere with -o",
    errno.EMFILE: "raise the limit of open files: `ulimit -n 4096`, LimitNOFILE= in a service",
    errno.ENFILE: "the computer has no file descriptor left; end other programs",
    errno.ENOMEM: "memory is used up; end other programs, or take a shorter recording",
    errno.EACCES: "this account may not do that; look at the owner and the mode of the path",
    errno.EPERM: "this account may not do that; look at the owner and the mode of the path",
    errno.EISDIR: "that is a folder where a file is needed; name another path",
    errno.ENOTDIR: "a part of that path is a file and no folder; name another path",
    errno.ENOENT: "no such file or folder; was it removed or renamed meanwhile?",
    errno.EEXIST: "it exists already; name another path, or remove it",
    errno.ENAMETOOLONG: "use a shorter name or path",
    errno.ELOOP: "too many links follow one another; name the file itself",
    errno.EIO: "the device reports an error; look at the kernel's log (dmesg)",
    errno.ENXIO: "nobody is at the other end of that device or pipe",
    errno.ETXTBSY: "another program runs or writes that file",
    errno.EAGAIN: "a limit of this account is reached (processes, locked memory); see `ulimit -a`",
    errno.ENOTEMPTY: "that folder is not empty; name another",
    errno.EXDEV: "the two paths lie on different file systems; choose both on one",
    errno.EADDRINUSE: "another program listens there; stop it, or choose another endpoint or port",
    errno.EADDRNOTAVAIL: "this computer has no such address",
    errno.ESTALE: "the network file system has lost that file; open it again",
    errno.ENOTSUP: "that file system cannot do this; write elsewhere with -o",
}
LOADING = "memory or open files may be limited (`ulimit -v`, `ulimit -n`), or a package be damaged: install it again"
NUMBA_SETTINGS = ".numba_config.yaml"


def told(error: BaseException) -> tuple[int, str]:
    """Exit code and message of any exception: 2 for a refusal of the computer, 1 for an internal error."""
    if (said := words(error)) is not None:
        return 2, said
    if os.environ.get("RTCTL_TRACEBACK"):
        traceback.print_exception(error)
    return 1, f"internal error: {error!r}; RTCTL_TRACEBACK=1 shows where"


def words(error: BaseException) -> str | None:
    """Message for a refusal of the computer, in `error` or one of its causes; None for an internal error."""
    seen: set[int] = set()
    cause: BaseException | None = error
    while cause is not None and id(cause) not in seen:
        seen.add(id(cause))
        if (said := _one(cause)) is not None:
            return said
        cause = cause.__cause__
    return None


def _one(error: BaseException) -> str | None:
    number = getattr(error, "errno", None)
    if isinstance(number, int) and number in ADVICE and (isinstance(error, OSError) or _is_zmq(error)):
        where = getattr(error, "filename", None)
        what = os.strerror(number)
        place = f"{os.fsdecode(where)}: " if isinstance(where, str | bytes | os.PathLike) else ""
        return f"{place}{what[:1].lower()}{what[1:]}; {ADVICE[number]}"
    if isinstance(error, MemoryError):
        return f"not enough memory; {ADVICE[errno.ENOMEM]}"
    if isinstance(error, ImportError | OSError) and "shared object" in str(error):
        why = next(line for line in str(error).splitlines() if "shared object" in line)
        return f"a library cannot be loaded: {why.strip().rstrip('.')}; {LOADING}"
    if type(error).__name__ == "BrokenProcessPool":
        return "a worker process was killed, most likely by the kernel for want of memory; try --jobs 1, look at dmesg"
    if type(error).__module__.partition(".")[0] == "yaml" and NUMBA_SETTINGS in str(error):
        return f"{NUMBA_SETTINGS} in this folder is read by numba, and is no YAML; run rtctl in another folder"
    return None


def _is_zmq(error: Any) -> bool:
    return type(error).__module__.partition(".")[0] == "zmq"
