"""Every estimator on every published experiment, beside the errors of an independent computation.

The file experiments.toml says with which settings (docs/algorithms.md sections 8 and 9).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ahrs_fmu import metrics, models, scenarios
from ahrs_fmu.errors import ScenarioError
from ahrs_fmu.estimator import Backend, Estimator
from ahrs_fmu.host_library import Precision
from ahrs_fmu.scenarios import Scenario, Simulation

Array = NDArray[np.float64]

RELATIVE_TOLERANCE = 0.3
ABSOLUTE_TOLERANCE = math.radians(0.05)
EXPECTED_SEEDS = 2
"""How many seeds the independent computation averaged over."""
CONFIDENCE = 0.99
"""Of the interval in which the difference of two means of an error that wanders may be."""

Values = dict[str, bool | float | str]
Verdict = Literal["agrees", "seeds differ", "fails likewise", "holds here", "differs"]

MEANING: dict[Verdict, str] = {
    "agrees": "within 30 % or 0.05 deg",
    "seeds differ": "the error wanders; the means differ as those of so few seeds do",
    "fails likewise": "there the covariance was lost; here it is reset",
    "holds here": "there the covariance was lost; here it is not",
    "differs": "neither",
}
"""What the verdicts say."""


class Variant(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Other parameters for the scenarios whose names begin with `scenarios`."""

    scenarios: str
    parameters: Values


class Setting(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An estimator with the parameters of an experiment.

    Attributes
    ----------
    model : str
        Name of the descriptor.
    parameters : dict
        Values by name.
    per_sample, per_step : dict
        Noise given as a standard deviation v per sample: the density is v sqrt(T) for white noise and
        v/sqrt(T) for the steps of a random walk.
    scenario_noise : bool
        Whether the noise is the scenario's `FilterNoise`.
    kept_motion : float or None
        Motion compensation that keeps this part of the motion acceleration from one sample to the next.
    variants : list of Variant
        Exceptions.
    unsettled : list of str
        Beginnings of the names of scenarios in which seeds differ by more than any tolerance.
    expected : dict
        RMS of roll, pitch and yaw in degrees by scenario; none where the independent computation failed.
    """

    model: str
    parameters: Values = {}
    per_sample: dict[str, float] = {}
    per_step: dict[str, float] = {}
    scenario_noise: bool = False
    kept_motion: float | None = None
    variants: list[Variant] = []
    unsettled: list[str] = []
    expected: dict[str, tuple[float, float, float]] = {}

    def values(self, name: str, scenario: Scenario) -> Values:
        """Parameters by name for a scenario, without the initial attitude."""
        root = math.sqrt(scenario.sample_time)
        field = np.asarray(scenario.field)
        values: Values = {
            "sample_time": scenario.sample_time,
            "gravity": scenario.gravity,
            "field_reference": "given",
            "field_magnitude": float(np.linalg.norm(field)),
            "field_dip": math.atan2(field[2], math.hypot(field[0], field[1])),
            "initialisation": "given",
        }
        if self.scenario_noise:
            noise = scenario.filter_noise
            values["gyro_noise"] = noise.gyro_std * root
            values["gyro_bias_noise"] = noise.gyro_bias_walk
            values["accel_noise"] = noise.accel_std * root
            values["mag_noise"] = noise.mag_std * root
        values |= self.parameters
        values |= {key: value * root for key, value in self.per_sample.items()}
        values |= {key: value / root for key, value in self.per_step.items()}
        if self.kept_motion is not None:
            decay = -math.log(self.kept_motion)
            values["motion_compensation"] = True
            values["motion_time_constant"] = scenario.sample_time / decay if decay > 0.0 else math.inf
        for variant in self.variants:
            if name.startswith(variant.scenarios):
                values |= variant.parameters
        return values

    def estimator(
        self, name: str, simulation: Simulation, backend: Backend = "c", precision: Precision = "double"
    ) -> Estimator:
        """Make the estimator for one simulation of the scenario `name`."""
        values: dict[str, object] = dict(self.values(name, simulation.scenario))
        values["q0"] = simulation.q0.tolist()
        return models.BY_NAME[self.model](**values, backend=backend, precision=precision)  # type: ignore[arg-type]

    def is_settled(self, name: str) -> bool:
        """Whether errors in the scenario `name` can be compared at all."""
        return not any(name.startswith(beginning) for beginning in self.unsettled)


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """One setting on one scenario.

    Attributes
    ----------
    setting, scenario : str
        Names.
    rms : ndarray, shape (seeds, 3)
        RMS errors of roll, pitch and yaw, rad; NaN where an output was not finite.
    resets : int
        Samples at which the covariance was reset, in all seeds.
    expected : ndarray, shape (3,), or None
        RMS errors of the independent computation, rad; None where it failed.
    settled : bool
        Whether these errors can be compared.
    """

    setting: str
    scenario: str
    rms: Array
    resets: int
    expected: Array | None
    settled: bool

    @property
    def mean(self) -> Array:
        """Mean over the seeds (3,), rad."""
        return np.asarray(self.rms.mean(axis=0))

    @property
    def agrees(self) -> bool:
        """Whether the mean is within 30 % or 0.05 deg of the expected errors; false without any."""
        return self.expected is not None and within_tolerance(self.mean, self.expected)

    @property
    def is_of_the_same_spread(self) -> bool:
        """Whether the two means can be those of the same wandering error, by Student's t.

        A single seed cannot tell, and passes.
        """
        if self.expected is None:
            return False
        count = len(self.rms)
        if count < 2:
            return True
        error = self.rms.std(axis=0, ddof=1) * math.sqrt(1.0 / EXPECTED_SEEDS + 1.0 / count)
        limit = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1)) * error
        return bool((np.abs(self.mean - self.expected) <= limit).all())

    @property
    def verdict(self) -> Verdict:
        """What the comparison says."""
        if self.expected is None:
            failed = self.resets > 0 or not np.isfinite(self.rms).all()
            return "fails likewise" if failed else "holds here"
        if self.agrees:
            return "agrees"
        # One seed shows no spread: nothing can be said against it.
        wanders = not self.settled or len(self.rms) < 2
        return "seeds differ" if wanders and self.is_of_the_same_spread else "differs"


def within_tolerance(found: Array, expected: Array) -> bool:
    """Whether angles in radians are within 30 % or 0.05 deg of what is expected."""
    limit = np.maximum(RELATIVE_TOLERANCE * np.abs(expected), ABSOLUTE_TOLERANCE)
    return bool((np.abs(found - expected) <= limit).all())


@cache
def settings() -> dict[str, Setting]:
    """All settings by name."""
    text = resources.files("ahrs_fmu").joinpath("experiments.toml").read_text(encoding="utf-8")
    return msgspec.convert(tomllib.loads(text), dict[str, Setting])


def scenario_names(source: str = "all") -> list[str]:
    """Scenarios of one source (ME, AC, CG, GC) or of all that have expected errors.

    Raises
    ------
    ScenarioError
        If there is no such source.
    """
    compared = {name for setting in settings().values() for name in setting.expected}
    return of_source(source, [name for name in scenarios.names() if name in compared])


def of_source(source: str, known: Sequence[str]) -> list[str]:
    """Those of some scenarios that are of one source; ``all`` means all sources.

    Raises
    ------
    ScenarioError
        If there is none.
    """
    chosen = [name for name in known if source == "all" or name.startswith(f"{source.lower()}/")]
    if not chosen:
        sources = ", ".join(dict.fromkeys(name.partition("/")[0].upper() for name in known))
        raise ScenarioError(f"source {source!r} is unknown; known are {sources} and all")
    return chosen


def run(
    scenario: str,
    chosen: Sequence[str],
    seeds: Iterable[int] = range(1, 11),
    backend: Backend = "c",
    precision: Precision = "double",
    done: Callable[[], object] = lambda: None,
) -> list[Outcome]:
    """Run settings, given by name, on a scenario with several seeds; `done` is called after each setting.

    Raises
    ------
    ScenarioError
        If there is no scenario or no setting of a name.
    """
    simulations = [scenarios.simulate(scenario, seed) for seed in seeds]
    outcomes = []
    for name in chosen:
        outcomes.append(_outcome(name, scenario, simulations, backend, precision))
        done()
    return outcomes


def setting(name: str) -> Setting:
    """Setting by name.

    Raises
    ------
    ScenarioError
        If there is none of that name.
    """
    known = settings()
    if name not in known:
        raise ScenarioError(f"setting {name!r} is unknown; known are {', '.join(known)}")
    return known[name]


def _outcome(
    name: str, scenario: str, simulations: Sequence[Simulation], backend: Backend, precision: Precision
) -> Outcome:
    chosen = setting(name)
    rms = np.empty((len(simulations), 3))
    resets = 0
    for i, simulation in enumerate(simulations):
        result = chosen.estimator(scenario, simulation, backend, precision).run(simulation.record)
        error = metrics.attitude_error(result.q, simulation.truth.q).rms(simulation.record.evaluate)
        rms[i] = error.roll, error.pitch, error.yaw
        resets += int(np.count_nonzero(result.covariance_reset))
    expected = chosen.expected.get(scenario)
    return Outcome(
        setting=name,
        scenario=scenario,
        rms=rms,
        resets=resets,
        expected=None if expected is None else np.radians(expected),
        settled=chosen.is_settled(scenario),
    )
