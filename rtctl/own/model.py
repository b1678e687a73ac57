"""Settings class of a machine whose config names user files, with the keys, units and bounds of those files.

    law: {position: {kind: ./my_law.py:MyLaw, gain: 31 V/rad}}     or short: law: ./my_law.py:MyLaw
    plant: {kind: ./my_plant.py:MyPlant, M: 2 kg}                  or short: plant: ./my_plant.py:MyPlant
    plant: {physics: [{term: ./windage.py:Windage, node: reel1, c: 1e-6}]}

The texts of the files go into the key `own` of the config, so that plain data of a config are complete: a child
process, a bundle and another computer build an equal class from them without the files.
"""

from functools import lru_cache, reduce
from operator import or_
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, create_model

from rtctl.own import law, mechanics, plant, term
from rtctl.own.files import OwnError, Source, is_own, is_trusted, read, split
from rtctl.own.parts import Parts, own
from rtctl.plants.physics.place import PLANTS

Key = tuple[Any, ...]
LAW, PLANT, PHYSICS = ("law", "position", "kind"), ("plant", "kind"), ("plant", "physics")
MECHANICS = ("machine", "mechanics", "kind")


class MisplacedError(OwnError):
    """OwnError with the key of the config that it concerns."""

    def __init__(self, key: Key, error: Exception):
        super().__init__(str(error))
        self.key = key


def widened(base: Any, data: Any, folder: Path | None = None, law: bool = True) -> tuple[Any, Any]:
    """Settings class for plain `data` of a machine, and the data with the texts of its user files.

    `base` is the machine's class, which is returned where no user file is named. A text that is not in the data is read
    from `folder`. Without `law` a user's law is not run, and its settings stay plain data.

    Raises MisplacedError, an OwnError with the key.
    """
    if not isinstance(data, dict):
        return base, data
    data = long_form(data)
    found = _named(data)
    if not law and LAW in found:
        del found[LAW]
        base = _with_any_law(base)
    if not found:
        return base, data
    if PLANT in found and isinstance(data.get("machine"), dict):
        why = "a machine that the config describes is its own plant; drop plant.kind, or name a machine"
        raise MisplacedError(PLANT, OwnError(why))
    given = data.get("own")
    texts = dict(given) if isinstance(given, dict) else {}
    sources = {}
    for key, word in found.items():
        try:
            sources[key] = _source(word, texts, folder)
            model = _model(base, tuple(sources.items()))
        except OwnError as error:
            raise MisplacedError(key, error) from error
    term.register([source for key, source in sources.items() if key[:2] == PHYSICS])
    if MECHANICS in sources:
        data = _with_mechanics(data, sources[MECHANICS], folder)
    return model, {**data, "own": {file: texts[file] for file in sorted({s.file for s in sources.values()})}}


def long_form(data: Any) -> Any:
    """Data in long form: `law`, `position` and `plant` as ./my_law.py:MyLaw become keys with `kind`."""
    if not isinstance(data, dict):
        return data
    found = data.get("law")
    if is_own(found):
        found = {"position": found}
    if isinstance(found, dict) and is_own(found.get("position")):
        found = {**found, "position": {"kind": found["position"]}}
    changed = {"law": found} if found is not data.get("law") else {}
    machine = data.get("machine")
    if isinstance(machine, dict) and machine.get("mechanics") is not None:
        given = machine["mechanics"]
        given = {"kind": given} if isinstance(given, str) else given
        if isinstance(given, dict) and isinstance(given.get("kind"), str):
            given = {**given, "kind": mechanics.long_kind(given["kind"])}
        changed["machine"] = {**machine, "mechanics": given}
    if is_own(data.get("plant")):
        changed["plant"] = {"kind": data["plant"]}
    return {**data, **changed}


def _with_mechanics(data: dict[str, Any], source: Source, folder: Path | None) -> dict[str, Any]:
    """Data with the hash of the mechanics' text; registers the code of the mechanics. Raises MisplacedError."""
    try:
        path = (folder / source.file).resolve() if folder is not None else None
        found = mechanics.register(source, path)
    except OwnError as error:
        raise MisplacedError(MECHANICS, error) from error
    machine = data["machine"]
    return {**data, "machine": {**machine, "mechanics": {**machine["mechanics"], "sha256": found.sha256}}}


def without_code(base: Any, data: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    """Settings class and plain data of a recorded machine for analysis, which runs no user file.

    The settings of a user's law stay plain data, user terms are left out. Raises MisplacedError for a user's plant,
    since its equations are code.
    """
    data = long_form(data)
    found = _named(data)
    if PLANT in found:
        why = f"{found[PLANT]}: rtctl knows the equations of the {data.get('machine')}, and nothing of an own plant's"
        raise MisplacedError(PLANT, OwnError(why))
    if LAW in found:
        base = _with_any_law(base)
    terms = [key for key in found if key[:2] == PHYSICS]
    if terms:
        kept = [entry for i, entry in enumerate(data["plant"]["physics"]) if (*PHYSICS, i, "term") not in terms]
        data = {**data, "plant": {**data["plant"], "physics": kept}}
    return base, data


def _named(data: dict[str, Any]) -> dict[Key, str]:
    """Key -> ./file.py:Name of all user files that the data name."""
    found: dict[Key, str] = {}
    for key in (LAW, PLANT, MECHANICS):
        node: Any = data
        for part in key:
            node = node.get(part) if isinstance(node, dict) else None
        if is_own(node):
            found[key] = node
    machine = data.get("plant")
    terms = machine.get("physics") if isinstance(machine, dict) else None
    for i, entry in enumerate(terms if isinstance(terms, list) else []):
        if isinstance(entry, dict) and is_own(entry.get("term")):
            found[(*PHYSICS, i, "term")] = entry["term"]
    return found


def _source(kind: str, texts: dict[str, str], folder: Path | None) -> Source:
    file, name = split(kind)
    if file not in texts:
        if folder is None:
            raise OwnError(f"{file}: its text is not in the config's `own`, and nobody knows the config's folder")
        texts[file] = read(file, folder)
    elif folder is not None and not is_trusted(texts[file]) and read(file, folder) != texts[file]:
        raise OwnError(f"{file}: the file and the text in the config's `own` differ; remove `own` to run the file")
    return Source(file, name, texts[file])


@lru_cache(maxsize=64)
def _model(base: Any, sources: tuple[tuple[Key, Source], ...]) -> Any:
    """Machine's class with the settings of these user files; equal texts give one class."""
    model = base
    for key, source in sources:
        if key == LAW:
            laws = _replaced(base.model_fields["law"].annotation, "position", _law(source))
            model = _replaced(model, "law", laws)
        elif key == PLANT:
            model = _replaced(model, "plant", _plant(source, base.model_fields["plant"].annotation, _kind(base)))
    terms = tuple(source for key, source in sources if key[:2] == PHYSICS)
    if terms:
        model = _with_terms(model, terms)
    return model


def _with_any_law(base: Any) -> Any:
    """Machine's class whose position law may be any plain data."""
    return _replaced(base, "law", _replaced(base.model_fields["law"].annotation, "position", Any))


def _kind(base: Any) -> str:
    return str(get_args(base.model_fields["machine"].annotation)[0])


@lru_cache(maxsize=64)
def _law(source: Source) -> Any:
    parts = own(source, law.FUNCTIONS, law.RESULT)
    settings = _kinded(parts)
    law.own_laws[settings] = parts
    return settings


@lru_cache(maxsize=64)
def _plant(source: Source, base: Any, machine: str) -> Any:
    """The file's settings with the keys of every plant's config: rate, substep, an empty list of terms, no FMU."""
    parts = own(source, plant.FUNCTIONS)
    plant.check_sensors(parts, machine)
    parts.call("step", "own", PLANTS[machine].OWN.inputs)
    kept: dict[str, Any] = {n: (base.model_fields[n].annotation, base.model_fields[n]) for n in ("rate", "substep")}
    none: Any = Field(
        default=[], max_length=0, description="an own plant has no nodes for terms: write them into its step"
    )
    kept["physics"] = (list[Any], none)
    kept["fmu"] = (None, Field(default=None, description="an own plant is no FMU"))
    settings = create_model(parts.settings.__name__, __base__=_kinded(parts), **kept)
    plant.own_plants[settings] = parts
    return settings


def _kinded(parts: Parts) -> Any:
    """The file's settings with the key `kind`, which names the file."""
    assert parts.source is not None
    word = Literal[parts.source.spec]  # type: ignore[name-defined]
    return create_model(parts.settings.__name__, __base__=parts.settings, kind=(word, ...))


def _with_terms(base: Any, sources: tuple[Source, ...]) -> Any:
    """Machine's class whose list `physics` accepts these terms beside those of the library."""
    plants = base.model_fields["plant"].annotation
    field = plants.model_fields["physics"]
    items = get_args(get_args(field.annotation)[0])[0]  # list[Annotated[A | B | ..., ...]]
    members = [*get_args(items), *(term.own_term(source).settings for source in dict.fromkeys(sources))]
    one: Any = Annotated[reduce(or_, members), Field(discriminator="term")]
    wide: Any = create_model(plants.__name__, __base__=plants, physics=(list[one], field))
    return _replaced(base, "plant", wide, wide())


def _replaced(model: Any, field: str, annotation: Any, default: Any = ...) -> Any:
    """Settings class with another type for one of its keys."""
    fields: dict[str, Any] = {field: (annotation, default)}
    return create_model(model.__name__, __base__=model, **fields)
