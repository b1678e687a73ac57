"""The file of a co-simulation FMU: its description, the checks before anything of it is unpacked, and its library.

Only the functions of the FMI that a run calls are bound, so that a library may lack all others.

Source: FMI 2.0.4 and 3.0.1, the FMU distribution (fmi-standard.org).
"""

import contextlib
import stat
import zipfile
from pathlib import Path, PurePosixPath
from typing import Any

from rtctl.config.errors import UserError

UNPACKED_LIMIT = 4 << 30  # bytes of all files in an FMU
DESCRIPTION_LIMIT = 64 << 20  # bytes of modelDescription.xml
DESCRIPTION = "modelDescription.xml"
CALLED = {  # major version of FMI -> functions that a run calls
    2: frozenset(
        f"fmi2{name}"
        for name in ("Instantiate", "SetupExperiment", "EnterInitializationMode", "ExitInitializationMode", "SetReal",
                     "GetReal", "DoStep", "FreeInstance")
    ),
    3: frozenset(
        f"fmi3{name}"
        for name in ("InstantiateCoSimulation", "EnterInitializationMode", "ExitInitializationMode", "SetFloat64",
                     "GetFloat64", "DoStep", "FreeInstance")
    ),
}  # fmt: skip


def describe(file: str) -> Any:
    """Model description of the file, by FMPy. Raises UserError where it is no co-simulation FMU for this platform."""
    try:
        import fmpy
    except ImportError as error:
        raise UserError("plant.fmu: FMPy is not installed here; `pip install 'rtctl[fmu]'`") from error
    where = f"plant.fmu.file: {file}"
    if not Path(file).is_file():
        raise UserError(f"{where}: there is no such file in {Path.cwd()}; give its path")
    names = _checked_names(file, where)
    try:
        model = fmpy.read_model_description(file)
    except (zipfile.BadZipFile, EOFError, OSError) as error:
        raise UserError(f"{where}: the file is damaged ({error}); export it again") from error
    except Exception as error:  # FMPy raises plain exceptions for what its validation finds
        why = " ".join(str(error).split())
        raise UserError(f"{where}: its modelDescription.xml is not valid: {why}") from error
    if major(model) not in CALLED:
        raise UserError(f"{where}: it is of FMI {model.fmiVersion}; 2.0 and 3.0 are taken")
    if model.coSimulation is None:
        kind = "scheduled execution" if getattr(model, "scheduledExecution", None) else "model exchange"
        raise UserError(f"{where}: it is for {kind} only; export it for co-simulation")
    library_of(model, names, where)
    return model


def major(model: Any) -> int:
    """Major version of FMI: 1, 2 or 3; 0 where the version is no number."""
    head = str(model.fmiVersion).partition(".")[0]
    return int(head) if head.isdigit() else 0


def library_of(model: Any, names: list[str], where: str) -> str:
    """Name in the archive of the library for this platform. Raises UserError that lists the platforms it holds."""
    from fmpy import platform, platform_tuple, sharedLibraryExtension

    folders = (platform_tuple,) if major(model) == 3 else (platform, platform_tuple)
    name = model.coSimulation.modelIdentifier + sharedLibraryExtension
    for folder in folders:
        if f"binaries/{folder}/{name}" in names:
            return f"binaries/{folder}/{name}"
    held = sorted({parts[1] for n in names if len(parts := n.split("/")) > 2 and parts[0] == "binaries" and parts[2]})
    ours = next((folder for folder in folders if folder in held), None)
    if ours:
        there = ", ".join(n.rpartition("/")[2] for n in names if n.startswith(f"binaries/{ours}/") and n[-1] != "/")
        raise UserError(f"{where}: binaries/{ours} holds {there}, not {name}; export it again")
    sources = any(n.startswith("sources/") and n.endswith(".c") for n in names)
    only = ", ".join(held) or ("C sources" if sources else "none")
    raise UserError(
        f"{where}: it has no library for {folders[0]}, only {only}; "
        + ("compile them into it" if not held and sources else "export it for this platform")
    )


def unpack(file: str, folder: Path) -> None:
    """All files of the archive, into `folder`. Raises UserError."""
    where = f"plant.fmu.file: {file}"
    _checked_names(file, where)
    try:
        with zipfile.ZipFile(file) as archive:
            archive.extractall(folder)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError) as error:
        raise UserError(f"{where}: the file is damaged ({error}); export it again") from error
    except OSError as error:
        raise UserError(f"{where}: it cannot be unpacked into {folder} ({error.strerror or error})") from error


def instance(folder: Path, model: Any) -> Any:
    """Instance of the unpacked FMU, an object of FMPy. Raises UserError where its library lacks a function."""
    from fmpy.fmi2 import FMU2Slave
    from fmpy.fmi3 import FMU3Slave

    called = CALLED[major(model)]
    base = FMU3Slave if major(model) == 3 else FMU2Slave

    def listed(self: Any) -> list[str]:
        there = {name for name in called if hasattr(self, "dll") and hasattr(self.dll, name)}
        return [name for name in base.__dir__(self) if not name.startswith("fmi") or name in there]

    # FMPy binds every function that dir() lists, by the first letters of the class's name
    kind = type(f"FMU{major(model)}CoSimulation", (base,), {"__dir__": listed})
    names = [str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()]
    library = folder / library_of(model, names, f"plant.fmu.file: {folder}")
    given = {
        "guid": model.guid,
        "unzipDirectory": str(folder),
        "modelIdentifier": model.coSimulation.modelIdentifier,
        "libraryPath": str(library),
        "requireFunctions": False,  # older FMPy binds in its constructor
    }
    with contextlib.chdir(Path.cwd()):  # FMPy changes into the folder, and stays there where a library fails
        made = kind(**given)
    missing = sorted(name for name in called if not hasattr(made.dll, name))
    if missing:
        raise UserError(f"its library lacks {', '.join(missing)}; export it again for co-simulation")
    made.instantiate(visible=False, loggingOn=False)
    return made


def _checked_names(file: str, where: str) -> list[str]:
    """Names in the archive. Raises UserError where it is damaged, locked, too large or would leave its folder."""
    try:
        with zipfile.ZipFile(file) as archive:
            infos = archive.infolist()
    except (zipfile.BadZipFile, EOFError, ValueError) as error:
        raise UserError(f"{where}: it is no FMU: a zip with a {DESCRIPTION} ({error})") from error
    except OSError as error:
        raise UserError(f"{where}: it cannot be read ({error.strerror or error})") from error
    names = [info.filename for info in infos]
    if DESCRIPTION not in names:
        raise UserError(f"{where}: it is no FMU: a zip with a {DESCRIPTION} (there is none in it)")
    for info in infos:
        name = info.filename
        if "\\" in name or ":" in name or name.startswith("/") or ".." in PurePosixPath(name).parts:
            raise UserError(f"{where}: it holds the path {name!r}, which leads out of its folder; nothing is unpacked")
        if stat.S_ISLNK(info.external_attr >> 16):
            raise UserError(f"{where}: it holds the link {name!r}; an FMU holds plain files; nothing is unpacked")
        if info.flag_bits & 1:
            raise UserError(f"{where}: {name} in it is encrypted; export it without a password")
        if name == DESCRIPTION and info.file_size > DESCRIPTION_LIMIT:
            raise UserError(f"{where}: its {DESCRIPTION} is {info.file_size >> 20} MiB; {DESCRIPTION_LIMIT >> 20} MiB "
                            "are read at most")  # fmt: skip
    whole = sum(info.file_size for info in infos)
    if whole > UNPACKED_LIMIT:
        raise UserError(f"{where}: its files are {whole / 2**30:.1f} GiB when unpacked; {UNPACKED_LIMIT >> 30} GiB are "
                        "unpacked at most")  # fmt: skip
    return names
