"""Campaign files: which scenarios, what varies, which seeds.

A file NAME.campaign.toml::

    scenario = "hover.cosim.toml"      # or a list of files, or a table with the scenario itself
    seeds = 20                         # 1 to 20, or a list; by default those of the scenario
    samples = 50                       # points of the ranges

    [vary]
    components.estimator.model = ["gcf", "mekf", "kcf"]
    components.estimator.parameters.kp = { from = 0.1, to = 3.0, log = true }

    [variants.fault]                   # parts of a scenario file by a name of their own
    none = {}
    iron.faults.iron = { kind = "bias", signal = "imu.mag", amount = ["20 uT", 0, 0], start = 20 }

Every combination of variants and lists, each with all points of the ranges and all seeds, is a case.
Variants are applied before lists and ranges, so that these may change what a variant brings. What a
scenario file varies itself is varied as well.
"""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import msgspec

from ahrs_fmu.campaign.axes import Axis, Changes, Range, latin_hypercube, split
from ahrs_fmu.cosim import scenario
from ahrs_fmu.cosim.scenario import Scenario, ScenarioFile, changes_in_words, in_words
from ahrs_fmu.errors import ScenarioError
from ahrs_fmu.host_library import library_fingerprint
from ahrs_fmu.trajectories import Data
from ahrs_fmu.version import __version__

SUFFIX = ".campaign.toml"

SCENARIO = "scenario"
SEED = "seed"
"""Axes that are there without being named."""

_Count = Annotated[int, msgspec.Meta(ge=1)]
_Seed = Annotated[int, msgspec.Meta(ge=0)]


@dataclass(frozen=True, slots=True)
class PlannedCase:
    """One run of a campaign.

    Attributes
    ----------
    key : str
        Hash of the scenario with all that it refers to, the changes and the seed: two cases of the same key
        have the same outcome.
    file : int
        Index of its scenario in the campaign.
    levels : mapping of str to value
        Where it is on every axis, by the axis' name.
    changes : mapping of str to value
        What differs from the scenario file, by dotted name.
    seed : int
    """

    key: str
    file: int
    levels: Mapping[str, object]
    changes: Changes
    seed: int

    @property
    def label(self) -> str:
        """Short name: where it is on every axis, then the seed."""
        return ", ".join((*changes_in_words(self.levels), f"seed={self.seed}"))


@dataclass(frozen=True, slots=True)
class Campaign:
    """A campaign file with its cases.

    Attributes
    ----------
    path : Path
    text : str
        The file.
    description : str
    scenarios : sequence of ScenarioFile
    axes : sequence of Axis
        Variants, then lists.
    ranges : mapping of str to Range
    cases : sequence of PlannedCase
        In the order of the file; the seed changes fastest.
    """

    path: Path
    text: str
    description: str
    scenarios: Sequence[ScenarioFile]
    axes: Sequence[Axis]
    ranges: Mapping[str, Range]
    cases: Sequence[PlannedCase]

    @property
    def name(self) -> str:
        """Name of the file without its suffix."""
        return self.path.name.removesuffix(SUFFIX)


class _File(Data, frozen=True):
    """The fields of a campaign file."""

    scenario: str | Annotated[list[str], msgspec.Meta(min_length=1)] | dict[str, Any]
    description: str = ""
    seeds: _Count | Annotated[list[_Seed], msgspec.Meta(min_length=1)] | None = None
    vary: dict[str, Any] = msgspec.field(default_factory=dict)
    variants: dict[str, Annotated[dict[str, dict[str, Any]], msgspec.Meta(min_length=1)]] = msgspec.field(
        default_factory=dict
    )
    samples: _Count | None = None
    sampling_seed: _Seed = 1


class _Digest:
    """Hashes the cases of one scenario file, and each file that it refers to once."""

    def __init__(self, file: ScenarioFile) -> None:
        self._folder = file.path.parent
        self._start = _hash(__version__, library_fingerprint("double"), _canonical(file.table))
        self._files: dict[str, str] = {}

    def key(self, what: Scenario, changes: Changes, seed: int) -> str:
        sources = [component.fmu or component.class_ for component in what.components.values()]
        files = [self._content(source) for source in sources if source is not None]
        return _hash(self._start, *files, _canonical(changes), str(seed))[:16]

    def _content(self, source: str) -> str:
        if source not in self._files:
            path = self._folder / source
            # Of FILE:CLASS the file; one that is missing is told of when it is needed.
            path = path if path.is_file() else self._folder / source.rpartition(":")[0]
            self._files[source] = hashlib.sha256(path.read_bytes() if path.is_file() else b"").hexdigest()
        return self._files[source]


def read(path: str | Path) -> Campaign:
    """Read a campaign file and the scenarios that it names.

    Raises
    ------
    ScenarioError
        If one of them is no TOML or makes no sense; the message names the file and the key.
    OSError
        If one cannot be read.
    """
    path = Path(path)
    return parse(path.read_text(encoding="utf-8"), path)


def parse(text: str, path: Path) -> Campaign:
    """Read the text of a campaign file; `path` names it and is where its scenarios are looked for.

    Raises
    ------
    ScenarioError
        As `read`.
    OSError
        If a scenario file cannot be read.
    """
    try:
        given = msgspec.convert(tomllib.loads(text), _File)
        varied = dict(split(given.vary))
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{path.name}: this is no TOML: {error}") from None
    except msgspec.ValidationError as error:
        raise ScenarioError(f"{path.name}: {in_words(str(error))}") from None
    ranges = {name: what for name, what in varied.items() if isinstance(what, Range)}
    lists = {name: what for name, what in varied.items() if not isinstance(what, Range)}
    if ranges and given.samples is None:
        raise ScenarioError(f"{path.name}: vary.{next(iter(ranges))} is a range: say samples = N as well")
    if given.samples is not None and not ranges:
        raise ScenarioError(f"{path.name}: samples = {given.samples}, but no field has a range")
    axes = [Axis.of_variants(name, parts) for name, parts in given.variants.items()]
    axes += [Axis.of_values(name, values) for name, values in lists.items()]
    _check_names(path, [axis.name for axis in axes])
    points = latin_hypercube(ranges, given.samples or 1, given.sampling_seed)
    seeds = range(1, given.seeds + 1) if isinstance(given.seeds, int) else given.seeds
    files = _scenarios(given, path)
    cases = [
        case
        for index, file in enumerate(files)
        for case in _cases(index, file, {SCENARIO: file.name} if len(files) > 1 else {}, axes, points, seeds)
    ]
    if same := len(cases) - len({case.key for case in cases}):
        raise ScenarioError(
            f"{path.name}: {same} cases are the same as others: a value or a seed is there twice, "
            "or two variants change nothing"
        )
    return Campaign(path, text, given.description, files, axes, ranges, cases)


def _cases(
    index: int,
    file: ScenarioFile,
    here: Mapping[str, object],
    axes: Sequence[Axis],
    points: Sequence[Changes],
    seeds: Sequence[int] | None,
) -> Iterator[PlannedCase]:
    digest = _Digest(file)
    for levels, changes in _combinations(axes, points):
        for case in file.cases(changes, seeds):
            own = {name: value for name, value in case.changes.items() if name not in changes}
            key = digest.key(case.scenario, case.changes, case.seed)
            yield PlannedCase(key, index, {**here, **levels, **own}, case.changes, case.seed)


def _combinations(
    axes: Sequence[Axis], points: Sequence[Changes]
) -> Iterator[tuple[Mapping[str, object], Changes]]:
    choices = [list(zip(axis.levels, axis.changes, strict=True)) for axis in axes]
    for chosen in product(*choices):
        levels = {axis.name: level for axis, (level, _) in zip(axes, chosen, strict=True)}
        changes = {name: value for _, part in chosen for name, value in part.items()}
        for point in points:
            yield {**levels, **point}, {**changes, **point}


def _scenarios(given: _File, path: Path) -> list[ScenarioFile]:
    if isinstance(given.scenario, dict):
        inline = path.with_name(path.name.removesuffix(SUFFIX) + scenario.SUFFIX)
        try:
            return [scenario.from_table(given.scenario, inline)]
        except ScenarioError as error:
            raise ScenarioError(str(error).replace(inline.name, f"{path.name}: scenario", 1)) from None
    names = [given.scenario] if isinstance(given.scenario, str) else given.scenario
    if twice := {name for name in names if names.count(name) > 1}:
        raise ScenarioError(f"{path.name}: scenario: {sorted(twice)[0]} is named twice")
    return [_read_scenario(path.parent / name) for name in names]


def _read_scenario(path: Path) -> ScenarioFile:
    # Its cases are checked with the changes of the campaign.
    return scenario.parse(path.read_text(encoding="utf-8"), path)


def _check_names(path: Path, names: Sequence[str]) -> None:
    for name in names:
        if name in (SCENARIO, SEED):
            raise ScenarioError(
                f"{path.name}: variants.{name}: '{name}' is an axis already: choose another name"
            )
        if names.count(name) > 1:
            raise ScenarioError(f"{path.name}: '{name}' is among the variants and in [vary]")


def _canonical(what: object) -> str:
    return json.dumps(what, sort_keys=True, default=str)


def _hash(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
