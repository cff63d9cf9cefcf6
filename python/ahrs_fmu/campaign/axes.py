"""What a campaign varies: lists of values, variants that change several fields at once, ranges."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from scipy.stats import qmc

from ahrs_fmu.trajectories import Data

Changes = Mapping[str, object]
"""Fields of a scenario that differ from its file, by their dotted names."""


class Range(Data, frozen=True, rename={"from_": "from"}):
    """Values between two bounds, drawn by Latin-hypercube sampling.

    Attributes
    ----------
    from_, to : float
        Bounds.
    log : bool
        Spread the logarithm of the value evenly instead of the value.
    """

    from_: float
    to: float
    log: bool = False

    def __post_init__(self) -> None:
        """Refuse bounds between which there is nothing."""
        if not self.from_ < self.to:
            raise ValueError(f"from = {self.from_:g} must be below to = {self.to:g}")
        if self.log and not self.from_ > 0.0:
            raise ValueError(f"from = {self.from_:g} must be positive where log = true")

    def value(self, part: float) -> float:
        """Value at a part, in [0, 1), of the way."""
        if self.log:
            return float(self.from_ * (self.to / self.from_) ** part)
        return float(self.from_ + part * (self.to - self.from_))


@dataclass(frozen=True, slots=True)
class Axis:
    """One thing that a campaign varies over a list.

    Attributes
    ----------
    name : str
        A dotted name of a field, or a name of its own for variants.
    levels : sequence of value
        What is shown of each value: itself, or the name of the variant.
    changes : sequence of Changes
        What each does to a scenario.
    """

    name: str
    levels: Sequence[object]
    changes: Sequence[Changes]

    @classmethod
    def of_values(cls, name: str, values: Sequence[object]) -> Axis:
        """Axis of a field."""
        return cls(name, tuple(values), tuple({name: value} for value in values))

    @classmethod
    def of_variants(cls, name: str, variants: Mapping[str, Mapping[str, Any]]) -> Axis:
        """Axis of named parts of a scenario file."""
        return cls(name, tuple(variants), tuple(dict(flat(part)) for part in variants.values()))


def flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Fields of a nested table by their dotted names; an empty table is a value."""
    for key, value in table.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping) and value:
            yield from flat(value, f"{name}.")
        else:
            yield name, value


def split(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, list[object] | Range]]:
    """Lists and ranges of a ``[vary]`` table by their dotted names, quoted or as nested tables.

    Raises
    ------
    msgspec.ValidationError
        If a value is neither.
    """
    for key, value in table.items():
        name = f"{prefix}{key}"
        if isinstance(value, list):
            if not value:
                raise msgspec.ValidationError(f"the list is empty - at `$.vary.{name}`")
            yield name, value
        elif not isinstance(value, Mapping):
            raise msgspec.ValidationError(
                f"give a list, or {{ from = ..., to = ... }}, and not {value!r} - at `$.vary.{name}`"
            )
        elif "from" in value or "to" in value:
            try:
                yield name, msgspec.convert(value, Range)
            except msgspec.ValidationError as error:
                text, _, where = str(error).partition(" - at `$")
                raise msgspec.ValidationError(f"{text} - at `$.vary.{name}{where or '`'}") from None
        else:
            yield from split(value, f"{name}.")


def level_in_words(level: object) -> str:
    """A level as short text; one that is not there is empty."""
    if level is None:
        return ""
    if isinstance(level, float):
        return f"{level:.6g}"
    return level if isinstance(level, str) else json.dumps(level, default=str)


def latin_hypercube(ranges: Mapping[str, Range], samples: int, seed: int) -> list[Changes]:
    """Draw points that cover every range evenly.

    Parameters
    ----------
    ranges : mapping of str to Range
        By dotted name; without any there is one point that changes nothing.
    samples : int
        Number of points: each of as many equal parts of a range holds one.
    seed : int
    """
    if not ranges:
        return [{}]
    sampler = qmc.LatinHypercube(len(ranges), rng=np.random.default_rng(seed))
    return [
        {name: bounds.value(part) for (name, bounds), part in zip(ranges.items(), row, strict=True)}
        for row in sampler.random(samples).tolist()
    ]
