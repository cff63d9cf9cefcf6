"""Scenario files: what is connected, what happens to it, and what is expected of it.

A file NAME.cosim.toml holds the fields of `Scenario`. With ``template = "quadrotor-attitude"`` or
``"estimation"`` it only says what differs: tables are merged, lists of connections and records are joined,
and a connection replaces that of the template to the same input. A template may also be another scenario
file, ``template = "hover.cosim.toml"``, whose seeds and variations are not taken. ``[vary]`` gives lists of
values for dotted names of fields, such as ``components.estimator.parameters.kp``; a table is merged with
that of the file, so that ``components.estimator`` varies the model together with its parameters. Every
combination with every seed is one case.
"""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import resources
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, get_args

import msgspec
import numpy as np

from ahrs_fmu import sensors
from ahrs_fmu.cosim.derived import Derived
from ahrs_fmu.cosim.excitation import Manoeuvre, Motion, Wind
from ahrs_fmu.cosim.expectations import Expectation
from ahrs_fmu.cosim.faults import AnyFault
from ahrs_fmu.cosim.instances import SOURCES, Component, Via
from ahrs_fmu.cosim.system import Connection, Method
from ahrs_fmu.errors import ScenarioError
from ahrs_fmu.estimators.model import FILTERS
from ahrs_fmu.trajectories import Data, Positive

SUFFIX = ".cosim.toml"

_TEMPLATES = "templates"
_LONGEST_VALUE = 24
"""Of a label, characters."""
_JOINED = ("connections", "start_values", "record")
_NAME_OF_FILE_ONLY = ("template", "vary", "seeds")
_NAMED: Mapping[str, Any] = {"components": Component, "faults": AnyFault, "signals": Derived}
"""Tables whose keys are names that a user gives."""


class Scenario(Data, frozen=True):
    """One case of a scenario file, merged with its template.

    Attributes
    ----------
    description : str
    duration : float
        s.
    step : float
        Communication step, s; also the `sample_time` of components that say nothing else.
    method : {"gauss-seidel", "jacobi"}
    components : mapping of str to Component
    connections, start_values : sequence of str
        As for `ahrs_fmu.cosim.system.System`.
    drives : mapping of str to value
        Constant inputs by ``component.input``.
    manoeuvre, wind, motion : optional
        Components of these names (`ahrs_fmu.cosim.excitation`).
    sensor : str, optional
        A named sensor (`ahrs_fmu.sensors`) that gives the component `sensor_of` its errors.
    sensor_of : str
    faults : mapping of str to fault
        See `ahrs_fmu.cosim.faults`.
    signals : mapping of str to derived signal
        See `ahrs_fmu.cosim.derived`.
    record : sequence of str
        Signals to record beside those that are needed.
    expect : sequence of Expectation
        See `ahrs_fmu.cosim.expectations`.
    """

    duration: Positive
    step: Positive
    components: dict[str, Component]
    description: str = ""
    method: Method = "gauss-seidel"
    connections: tuple[str, ...] = ()
    start_values: tuple[str, ...] = ()
    drives: dict[str, float | list[float]] = msgspec.field(default_factory=dict)
    manoeuvre: Manoeuvre | None = None
    wind: Wind | None = None
    motion: Motion | None = None
    sensor: str | None = None
    sensor_of: str = ""
    faults: dict[str, AnyFault] = msgspec.field(default_factory=dict)
    signals: dict[str, Derived] = msgspec.field(default_factory=dict)
    record: tuple[str, ...] = ()
    expect: tuple[Expectation, ...] = ()

    @property
    def fault_end(self) -> float:
        """When the last fault is over that ends within the run, s; -infinity when there is none."""
        ends = (fault.end for fault in self.faults.values() if fault.end < self.duration)
        return max(ends, default=float("-inf"))

    @property
    def rows(self) -> int:
        """Number of communication steps."""
        return round(self.duration / self.step)

    def sensor_parameters(self) -> dict[str, Any]:
        """Parameters of the component `sensor_of` that make it the named sensor.

        Raises
        ------
        ScenarioError
            If there is no sensor of that name.
        """
        if self.sensor is None:
            return {}
        imu = sensors.load(self.sensor)
        found: dict[str, Any] = {"hard_iron": imu.hard_iron, "soft_iron": sum(imu.soft_iron, ())}
        for name in ("gyro", "accel", "mag"):
            for key, value in msgspec.structs.asdict(getattr(imu, name)).items():
                # What has no bound here is switched off by zero there.
                found[f"{name}_{key}"] = 0.0 if value == float("inf") else value
        return found


@dataclass(frozen=True, slots=True)
class Case:
    """One run of a scenario.

    Attributes
    ----------
    scenario : Scenario
    seed : int
    changes : mapping of str to value
        What differs from the file, by dotted name.
    file : str
        Name of the file, for messages.
    """

    scenario: Scenario
    seed: int
    changes: Mapping[str, object] = field(default_factory=dict)
    file: str = "scenario"

    @property
    def label(self) -> str:
        """Short name: the changes, then the seed."""
        return "-".join((*changes_in_words(self.changes), f"seed={self.seed}"))


@dataclass(frozen=True, slots=True)
class ScenarioFile:
    """A scenario file as it is written, before its cases are made.

    Attributes
    ----------
    path : Path
    table : mapping
        The file, merged with its template.
    seeds : sequence of int
    vary : mapping of str to sequence of values
    """

    path: Path
    table: Mapping[str, Any]
    seeds: Sequence[int]
    vary: Mapping[str, Sequence[object]]

    @property
    def name(self) -> str:
        """Name of the file without its suffix."""
        return self.path.name.removesuffix(SUFFIX)

    def cases(
        self, changes: Mapping[str, object] = MappingProxyType({}), seeds: Sequence[int] | None = None
    ) -> Iterator[Case]:
        """Every combination of values with every seed.

        Parameters
        ----------
        changes : mapping of str to value, optional
            Fields of all cases by their dotted names; one that the file varies is not varied.
        seeds : sequence of int, optional
            Instead of those of the file.

        Raises
        ------
        ScenarioError
            If a value does not fit.
        """
        varied = {name: values for name, values in self.vary.items() if name not in changes}
        for values in product(*varied.values()):
            differing = {**changes, **dict(zip(varied, values, strict=True))}
            scenario = self.scenario(differing)
            for seed in self.seeds if seeds is None else seeds:
                yield Case(scenario, seed, differing, self.path.name)

    def case(self, changes: Mapping[str, object] = MappingProxyType({}), seed: int | None = None) -> Case:
        """One case; the seed is the first of the file unless it is given.

        Raises
        ------
        ScenarioError
            If a change does not fit.
        """
        seed = self.seeds[0] if seed is None else seed
        return Case(self.scenario(changes), seed, dict(changes), self.path.name)

    def computed_by(self, via: Via) -> ScenarioFile:
        """Return the same file with the models of this package computed by something else.

        Models without a numpy back-end, such as those of the vehicle, stay what they are when it is "numpy".
        """
        table = copy.deepcopy(dict(self.table))
        for component in table.get("components", {}).values():
            if "model" in component and (via != "numpy" or component["model"] in FILTERS):
                component["via"] = via
        return replace(self, table=table)

    def scenario(self, changes: Mapping[str, object]) -> Scenario:
        """Scenario with fields changed by their dotted names.

        Raises
        ------
        ScenarioError
            If there is no such field, or a value does not fit.
        """
        table = copy.deepcopy(dict(self.table))
        for name, value in changes.items():
            _put(table, name, value, self.path.name)
        try:
            return msgspec.convert(table, Scenario)
        except msgspec.ValidationError as error:
            raise ScenarioError(f"{self.path.name}: {_entry_error(table) or in_words(str(error))}") from None


class _Head(msgspec.Struct, frozen=True):
    """What a file says of its cases and not of one of them."""

    template: str | None = None
    seeds: Annotated[tuple[Annotated[int, msgspec.Meta(ge=0)], ...], msgspec.Meta(min_length=1)] = (1,)
    vary: dict[str, Annotated[list[Any], msgspec.Meta(min_length=1)]] = {}


def read(path: str | Path) -> ScenarioFile:
    """Read a scenario file.

    Raises
    ------
    ScenarioError
        If it is no TOML or no scenario; the message names the file and the key.
    OSError
        If it cannot be read.
    """
    path = Path(path)
    made = parse(path.read_text(encoding="utf-8"), path)
    # What does not fit is told now and not case by case.
    labels = [case.label for case in made.cases()]
    if twice := [label for label in labels if labels.count(label) > 1]:
        raise ScenarioError(
            f"{path.name}: vary: two cases are called {twice[0]}: vary what differs by its own name"
        )
    return made


def parse(text: str, path: Path) -> ScenarioFile:
    """Read the text of a scenario file; `path` names it and is where its FMUs are looked for.

    Raises
    ------
    ScenarioError
        If it is no TOML, or its template, seeds or variations make no sense.
    """
    try:
        return from_table(tomllib.loads(text), path)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{path.name}: this is no TOML: {error}") from None


def from_table(table: Mapping[str, Any], path: Path) -> ScenarioFile:
    """Make a scenario file of what its text would be; see `parse`.

    Raises
    ------
    ScenarioError
        If its template, seeds or variations make no sense.
    """
    try:
        head = msgspec.convert(table, _Head)
    except msgspec.ValidationError as error:
        raise ScenarioError(f"{path.name}: {in_words(str(error))}") from None
    own = {name: value for name, value in table.items() if name not in _NAME_OF_FILE_ONLY}
    merged = own if head.template is None else _merged(_template(head.template, path), own)
    return ScenarioFile(path, merged, head.seeds, head.vary)


def template_names() -> list[str]:
    """Names of the templates."""
    folder = resources.files("ahrs_fmu.cosim").joinpath(_TEMPLATES)
    return sorted(file.name.removesuffix(".toml") for file in folder.iterdir() if file.name.endswith(".toml"))


def in_words(message: str) -> str:
    """Turn the message of an error of msgspec, with its `$.a.b`, into the names of a file."""
    text, _, where = message.partition(" - at `$")
    return f"{where.rstrip('`').lstrip('.')}: {text}" if where.strip("`") else text


def changes_in_words(changes: Mapping[str, object]) -> list[str]:
    """Changes with the last part of their names only, such as ``kp=0.5``."""
    return [f"{_short(name, changes)}={_value_in_words(value)}" for name, value in changes.items()]


def _short(name: str, among: Mapping[str, object]) -> str:
    last = name.rpartition(".")[2]
    if sum(other.rpartition(".")[2] == last for other in among) == 1 and last not in ("model", "severity"):
        return last
    parts = [part for part in name.split(".") if part not in ("components", "parameters", "faults")]
    return parts[0] if parts[-1] == "model" else ".".join(parts)


def _value_in_words(value: object) -> str:
    if isinstance(value, Mapping):
        named = [str(value[key]) for key in SOURCES if key in value]
        return ",".join(named or [f"{key}={_value_in_words(v)}" for key, v in value.items()])
    if isinstance(value, float):
        return f"{value:.6g}"
    text = str(value).replace(" ", "")
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}…"


def _template(name: str, path: Path) -> Mapping[str, Any]:
    if name.endswith(SUFFIX):
        other = path.parent / name
        if not other.is_file():
            raise ScenarioError(f"{path.name}: template = '{name}': there is no such file beside it")
        return parse(other.read_text(encoding="utf-8"), other).table
    if name not in template_names():
        raise ScenarioError(
            f"{path.name}: template = '{name}' is unknown; there are {', '.join(template_names())}, "
            f"or another file NAME{SUFFIX}"
        )
    text = resources.files("ahrs_fmu.cosim").joinpath(_TEMPLATES, f"{name}.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def _merged(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    components = own.get("components", {})
    if isinstance(components, Mapping):
        left = {
            name: _without_source(component, components.get(name))
            for name, component in base.get("components", {}).items()
        }
        base = {**base, "components": left}
    merged = _overlaid(base, own)
    for name in _JOINED:
        merged[name] = [*base.get(name, []), *own.get(name, [])]
    targets = {_target(text) for text in own.get("connections", [])}
    kept = [text for text in base.get("connections", []) if _target(text) not in targets]
    merged["connections"] = [*kept, *own.get("connections", [])]
    return merged


def _target(connection: object) -> str:
    return Connection.parse(str(connection)).target


def _overlaid(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    both = {
        name: _overlaid(base[name], own[name])
        for name in base.keys() & own.keys()
        if isinstance(base[name], Mapping) and isinstance(own[name], Mapping)
    }
    return {**base, **own, **both}


def _without_source(component: Mapping[str, Any], own: object) -> dict[str, Any]:
    """Component of a template without what it is, where the file says what it is."""
    replaced = isinstance(own, Mapping) and any(key in own for key in SOURCES)
    return {key: value for key, value in component.items() if not (replaced and key in SOURCES)}


def _put(table: dict[str, Any], name: str, value: object, file: str) -> None:
    *way, last = name.split(".")
    place: Any = table
    for i, part in enumerate(way):
        if isinstance(place, dict):
            place = place.setdefault(part, {})
        if not isinstance(place, dict):
            raise ScenarioError(f"{file}: there is no field '{name}': '{'.'.join(way[: i + 1])}' is no table")
    old = place.get(last)
    if isinstance(old, Mapping) and isinstance(value, Mapping):
        place[last] = _overlaid(old, value)
    else:
        # Numbers of a script may be numpy's.
        place[last] = value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _entry_error(table: Mapping[str, Any]) -> str | None:
    """What is wrong with the first bad entry of a table of named things, with its name.

    msgspec's messages do not name keys of mappings, and not what a `kind` may be.
    """
    for key, of in _NAMED.items():
        entries = table.get(key)
        for name, entry in entries.items() if isinstance(entries, dict) else ():
            try:
                msgspec.convert(entry, of)
            except msgspec.ValidationError as error:
                kinds = [str(cls.__struct_config__.tag) for cls in get_args(of)]
                hint = f"; the kinds are {', '.join(kinds)}" if kinds and "kind`" in str(error) else ""
                words = in_words(str(error))
                joint = "." if "`$" in str(error) else ": "
                return f"{key}.{name}{joint}{words}{hint}"
    return None
