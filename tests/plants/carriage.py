"""Builds the FMU of carriage.c: its library and its description."""

import shutil
import subprocess
import zipfile
from pathlib import Path

SOURCE = Path(__file__).with_name("carriage.c")
VARIABLES = (  # name, causality, variability, unit, type
    ("u", "input", "continuous", "V", "Real"),
    ("x", "output", "continuous", "mm", "Real"),
    ("m", "parameter", "fixed", "kg", "Real"),
    ("K", "parameter", "fixed", "N/V", "Real"),
    ("d", "parameter", "fixed", "N.s/m", "Real"),
    ("fail_at", "parameter", "fixed", "s", "Real"),
    ("speed", "output", "continuous", "mm/s", "Real"),
    ("bare", "output", "continuous", None, "Real"),
    ("count", "output", "discrete", None, "Integer"),
)


def library(folder: Path, without: str = "") -> Path | None:
    """Shared library that exports only the functions of a run; None without a compiler.

    The function `without` is left out.
    """
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    out = folder / "carriage.so"
    hidden = [f"-D{without}=static_{without}"] if without else []
    subprocess.run(
        [compiler, "-O1", "-ffp-contract=off", "-shared", "-fPIC", *hidden, SOURCE, "-o", out, "-lm"], check=True
    )
    return out


def description(version: int, kind: str = "CoSimulation", inner: float | None = None) -> str:
    """modelDescription.xml for FMI 2 or 3."""
    rows = []
    for number, (name, causality, variability, unit, type_) in enumerate(VARIABLES):
        start = ' start="0"' if causality in ("input", "parameter") else ""
        of = f' unit="{unit}"' if unit else ""
        common = f'name="{name}" valueReference="{number}" causality="{causality}" variability="{variability}"'
        if version == 2:
            rows.append(f"<ScalarVariable {common}><{type_}{of if type_ == 'Real' else ''}{start}/></ScalarVariable>")
        elif type_ == "Real":
            rows.append(f"<Float64 {common}{of}{start}/>")
        else:
            rows.append(f"<Int32 {common}/>")
    if version == 3:
        rows.append('<Float64 name="time" valueReference="99" causality="independent" variability="continuous"/>')
    units = "".join(f'<Unit name="{u}"/>' for u in sorted({v[3] for v in VARIABLES if v[3]}))
    outputs = [n for n, v in enumerate(VARIABLES) if v[1] == "output"]
    if version == 2:
        structure = "<Outputs>" + "".join(f'<Unknown index="{n + 1}"/>' for n in outputs) + "</Outputs>"
        head = 'fmiVersion="2.0" modelName="carriage" guid="{c}"'
        step = ""
    else:
        structure = "".join(f'<Output valueReference="{n}"/>' for n in outputs)
        head = 'fmiVersion="3.0" modelName="carriage" instantiationToken="{c}"'
        step = f' fixedInternalStepSize="{inner}"' if inner else ""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription {head}>'
        f'<{kind} modelIdentifier="carriage"{step}/><UnitDefinitions>{units}</UnitDefinitions>'
        f"<ModelVariables>{''.join(rows)}</ModelVariables><ModelStructure>{structure}</ModelStructure>"
        "</fmiModelDescription>"
    )


def pack(out: Path, built: Path | None, version: int = 2, platform: str | None = None, **options: object) -> Path:
    """An .fmu file; `built` is its library, None for one without."""
    folder = platform or {2: "linux64", 3: "x86_64-linux"}[version]
    with zipfile.ZipFile(out, "w") as file:
        file.writestr("modelDescription.xml", description(version, **options))  # type: ignore[arg-type]
        if built is not None:
            file.write(built, f"binaries/{folder}/carriage.{'dll' if folder.startswith('win') else 'so'}")
    return out
