"""The figures that the sources print, beside what comes out here.

The file published.toml holds them, with the reason where one is not met (docs/reproduction.md).
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import experiments, metrics, scenarios
from ahrs_fmu.estimator import Backend
from ahrs_fmu.host_library import Precision
from ahrs_fmu.scenarios import Simulation

Array = NDArray[np.float64]

_AXES = ("roll", "pitch", "yaw")
_LAST = 1.0
"""s: what the mean at the end is taken over, so that noise does not count."""


class Figure(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a source prints about one filter.

    Attributes
    ----------
    setting : str
        Name in `experiments.settings`.
    quantity : {"rms", "largest", "last"}
        RMS error, largest magnitude of the error, or mean error over the last second.
    axes : tuple of str
        Angles: roll, pitch, yaw.
    printed : tuple of float
        Degrees, one for each axis.
    at_most : bool
        Whether the source prints a bound.
    note : str
        Why it is not met, or on what it depends.
    """

    setting: str
    quantity: Literal["rms", "largest", "last"]
    axes: tuple[Literal["roll", "pitch", "yaw"], ...]
    printed: tuple[float, ...]
    at_most: bool = False
    note: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """A printed figure beside the mean over several seeds.

    Attributes
    ----------
    scenario : str
        Name of the scenario.
    figure : Figure
        What is printed.
    here : ndarray, shape (axes,)
        What comes out here, rad.
    """

    scenario: str
    figure: Figure
    here: Array

    @property
    def agrees(self) -> bool:
        """Whether a bound is kept, or every angle within 30 % or 0.05 deg of what is printed."""
        printed = np.radians(self.figure.printed)
        if self.figure.at_most:
            return bool((np.abs(self.here) <= printed).all())
        return experiments.within_tolerance(self.here, printed)

    @property
    def verdict(self) -> str:
        """``agrees`` or ``differs``."""
        return "agrees" if self.agrees else "differs"


@cache
def figures() -> dict[str, list[Figure]]:
    """All printed figures by scenario."""
    text = resources.files("ahrs_fmu").joinpath("published.toml").read_text(encoding="utf-8")
    return msgspec.convert(tomllib.loads(text), dict[str, list[Figure]])


def compare(
    scenario: str,
    seeds: Iterable[int] = range(1, 11),
    backend: Backend = "c",
    precision: Precision = "double",
) -> list[Comparison]:
    """Run what the sources print about a scenario; nothing for one that they print nothing about.

    Raises
    ------
    ScenarioError
        If there is no scenario of that name.
    """
    printed = figures().get(scenario, [])
    simulations = [scenarios.simulate(scenario, seed) for seed in seeds] if printed else []
    errors = {
        name: [_error(name, scenario, simulation, backend, precision) for simulation in simulations]
        for name in dict.fromkeys(figure.setting for figure in printed)
    }
    return [
        Comparison(scenario, figure, _mean(figure, simulations, errors[figure.setting])) for figure in printed
    ]


def _error(
    setting: str, scenario: str, simulation: Simulation, backend: Backend, precision: Precision
) -> Array:
    """Errors of roll, pitch and yaw (N, 3), rad."""
    estimator = experiments.setting(setting).estimator(scenario, simulation, backend, precision)
    return metrics.attitude_error(estimator.run(simulation.record).q, simulation.truth.q).euler


def _mean(figure: Figure, simulations: Sequence[Simulation], errors: Sequence[Array]) -> Array:
    columns = [_AXES.index(axis) for axis in figure.axes]
    found = [_reduced(figure, s, e[:, columns]) for s, e in zip(simulations, errors, strict=True)]
    return np.asarray(np.mean(found, axis=0), dtype=np.float64)


def _reduced(figure: Figure, simulation: Simulation, error: Array) -> Array:
    record = simulation.record
    if figure.quantity == "last":
        return np.asarray(error[record.time >= record.time[-1] - _LAST].mean(axis=0))
    counted = error if record.evaluate is None else error[record.evaluate]
    if figure.quantity == "largest":
        return np.asarray(np.abs(counted).max(axis=0))
    return np.asarray(np.sqrt(np.mean(counted**2, axis=0)))
