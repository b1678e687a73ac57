"""Files in folders that others may write to: written under a random name and renamed, read only inside the folder.

A writer never writes through a link, a FIFO or a device, and never into an existing file: the new file replaces the
name. A reader takes plain files inside the folder that it was given.
"""

import errno
import os
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from rtctl.config.errors import UserError

MODE = 0o666  # mode of a new file, before the umask


@contextmanager
def replaced(path: Path | str, mode: str = "w", sync: bool = False) -> Iterator[IO[Any]]:
    """A new file, open for writing as text (`w`, UTF-8) or bytes (`wb`, readable too), that becomes `path` at the end.

    `path` holds the old file or the new one at any moment; after an exception the old one. With `sync` file and rename
    are on the disk at the end. Raises OSError, also where `path` is a folder, a FIFO or a device.
    """
    path = Path(path)
    _replaceable(path)
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        name, fd = _created(folder, path.name)
        try:
            with os.fdopen(fd, "w+b") if "b" in mode else os.fdopen(fd, "w", encoding="utf-8") as file:
                yield file
                file.flush()
                if sync:
                    os.fsync(file.fileno())
            os.replace(name, path.name, src_dir_fd=folder, dst_dir_fd=folder)
            if sync:
                os.fsync(folder)
        except BaseException as error:
            with suppress(OSError):
                os.unlink(name, dir_fd=folder)
            _name(error, path)
            raise
    finally:
        os.close(folder)


@contextmanager
def replaced_path(path: Path | str, suffix: str | None = None) -> Iterator[Path]:
    """Path of a draft that becomes `path` at the end, for packages that open a file by its name; see `replaced`.

    The draft has the ending `suffix` and lies in a folder of mode 0700. Raises OSError, FileNotFoundError where nothing
    was written.
    """
    path = Path(path)
    _replaceable(path)
    private = Path(tempfile.mkdtemp(prefix=".", suffix=".tmp", dir=path.parent))
    try:
        draft = private / f"draft{path.suffix if suffix is None else suffix}"
        yield draft
        draft.replace(path)
    except OSError as error:
        _name(error, path)
        raise
    finally:
        shutil.rmtree(private, ignore_errors=True)


def write_text(path: Path | str, text: str, sync: bool = False) -> None:
    """Write a text file in UTF-8; see `replaced`. Raises OSError."""
    with replaced(path, sync=sync) as file:
        file.write(text)


def open_stream(path: Path | str, flags: int = 0) -> int:
    """File descriptor for writing into a file that is read while it grows; an existing plain file is not truncated.

    `flags` are further flags of os.open. Raises OSError for a link, a FIFO, and a file that has a second name.
    """
    flags |= os.O_WRONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK  # a FIFO is refused, not waited for
    with suppress(FileExistsError):
        return os.open(path, flags | os.O_CREAT | os.O_EXCL, 0o644)
    if Path(path).is_symlink():
        raise FileExistsError(errno.EEXIST, "is a link; rtctl does not write through it", str(path))
    fd = os.open(path, flags)
    found = os.fstat(fd)
    if stat.S_ISFIFO(found.st_mode) or (stat.S_ISREG(found.st_mode) and found.st_nlink > 1):
        os.close(fd)
        what = "is a FIFO" if stat.S_ISFIFO(found.st_mode) else "has another name besides (a hard link)"
        raise FileExistsError(errno.EEXIST, f"{what}; remove it", str(path))
    return fd


def inside(path: Path, folder: Path) -> Path:
    """The path, if it may be read: a file or folder inside `folder`. Raises UserError for any other existing path.

    The caller reports a path that does not exist.
    """
    try:
        real, base = path.resolve(strict=True), folder.resolve()
        kind = real.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return path
    except (OSError, RuntimeError) as error:  # a loop of links, a folder that may not be looked into
        raise UserError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not real.is_relative_to(base):
        raise UserError(
            f"{path} leads to {real}, outside of {folder}; rtctl reads no file that a bundle only points to: "
            "copy it into the folder"
        )
    if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
        raise UserError(f"{path} is a {_kind(kind)}; it should be a plain file")
    return path


def made_in(base: Path, *names: str) -> Path:
    """The folder base/name/..., made if it is missing.

    Raises OSError, and UserError where a link leads out of `base`.
    """
    folder = base.joinpath(*names)
    there = next(path for path in (folder, *folder.parents) if path.exists() or path.is_symlink() or path == base)
    real = there.resolve()
    if not real.is_relative_to(base.resolve()):
        raise UserError(f"{there} leads to {real}, outside of {base}, and nothing is written there; remove the link")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _created(folder: int, name: str) -> tuple[str, int]:
    """Name and descriptor of a new file in an open folder."""
    draft = f".{name[:200]}.{secrets.token_hex(8)}.tmp"
    return draft, os.open(draft, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, MODE, dir_fd=folder)


def _name(error: BaseException, path: Path) -> None:
    """Add the path to an error of a write by descriptor."""
    if isinstance(error, OSError) and error.errno is not None and error.filename is None:
        error.filename = str(path)


def _replaceable(path: Path) -> None:
    """Raise OSError for a name that a rename must not take: a folder, a FIFO, a device."""
    try:
        kind = path.stat().st_mode
    except OSError:
        return  # nothing there, or a link that leads nowhere
    if stat.S_ISDIR(kind) and not path.is_symlink():
        raise IsADirectoryError(errno.EISDIR, "is a folder", str(path))
    if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
        raise FileExistsError(errno.EEXIST, f"is a {_kind(kind)}, no plain file", str(path))


def _kind(mode: int) -> str:
    names = {stat.S_IFIFO: "FIFO", stat.S_IFSOCK: "socket", stat.S_IFCHR: "device", stat.S_IFBLK: "device"}
    return names.get(stat.S_IFMT(mode), "special file")
