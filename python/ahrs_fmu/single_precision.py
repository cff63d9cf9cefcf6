"""Which weights an unscented filter bears in single precision: the experiment behind a rule of the UKF.

A source reports that its UKF fails in single precision. Here such a filter runs in both precisions, in the
covariance form, which is that of the numpy back-end computed in numpy's float32, and in the square-root form,
which is that of the C code, driven below the rule that refuses it. What fails is the alpha of the textbooks,
0.001, whose weights of a million with both signs cancel; the root bears less of that than the covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ahrs_fmu import descriptors, experiments, metrics, quaternion, scenarios
from ahrs_fmu.estimators import matrices, mekf, ukf
from ahrs_fmu.estimators.geometry import down_of, north_of
from ahrs_fmu.host_library import Precision
from ahrs_fmu.native import NativeModel
from ahrs_fmu.scenarios import Scenario, Simulation

Array = NDArray[np.float64]
"""In single precision the arrays are float32, whatever their annotation says."""

Form = Literal["covariance", "square root"]

SCENARIO = "gc/lin"
SAMPLES = 1200
FAILING_ALPHA = 0.001
"""With this one single precision is expected to fail."""

_TYPES: dict[Precision, DTypeLike] = {"single": np.float32, "double": np.float64}


class Weighting(NamedTuple):
    """Sigma points of a filter, and what else may matter for rounding.

    Attributes
    ----------
    alpha, kappa : float
        Spread of the points.
    unit : {"uT", "nT"}
        Of the magnetometer inside the filter; the square-root form measures in units of the noise.
    symmetrised : bool
        Whether the covariance is made symmetric after each step; a root always is.
    attitude_std, bias_std : float
        Initial standard deviations, rad and rad/s.
    """

    alpha: float
    kappa: float = 0.0
    unit: Literal["uT", "nT"] = "uT"
    symmetrised: bool = True
    attitude_std: float = 0.1
    bias_std: float = 0.02


WEIGHTINGS: dict[Form, tuple[Weighting, ...]] = {
    "covariance": (
        Weighting(0.001),
        Weighting(0.001, unit="nT"),
        Weighting(0.001, symmetrised=False),
        Weighting(0.01),
        Weighting(0.1),
        Weighting(0.1, kappa=-3.0),
        Weighting(1.0),
        Weighting(1.0, kappa=-3.0),
        Weighting(1.0, unit="nT"),
        Weighting(1.0, symmetrised=False),
        Weighting(1.0, attitude_std=1.0, bias_std=1.0),
    ),
    "square root": (
        Weighting(0.001),
        Weighting(0.1),
        Weighting(0.1, kappa=-3.0),
        Weighting(1.0),
        Weighting(1.0, kappa=-3.0),
        Weighting(1.0, attitude_std=1.0, bias_std=1.0),
    ),
}


@dataclass(frozen=True, slots=True)
class Trial:
    """One weighting in both precisions.

    Attributes
    ----------
    form : {"covariance", "square root"}
        What is propagated.
    weighting : Weighting
        The points.
    failed : int or None
        Sample at which single precision loses the covariance; None: never.
    failed_double : int or None
        The same for double precision.
    rms, rms_double : float
        RMS of the total error, rad; NaN for a filter that failed.
    """

    form: Form
    weighting: Weighting
    failed: int | None
    failed_double: int | None
    rms: float
    rms_double: float

    @property
    def as_expected(self) -> bool:
        """Whether double precision holds, and single precision but for `FAILING_ALPHA`."""
        fails = self.weighting.alpha <= FAILING_ALPHA
        return self.failed_double is None and (self.failed is not None) == fails


def trials(seed: int = 1) -> list[Trial]:
    """Run all weightings in both forms and precisions on the bursts of straight acceleration."""
    simulation = scenarios.simulate(SCENARIO, seed)
    found = []
    for form, weightings in WEIGHTINGS.items():
        single, double = (_attitudes(form, simulation, weightings, precision) for precision in _TYPES)
        for i, weighting in enumerate(weightings):
            outcomes = (_outcome(simulation, q[:, i]) for q in (single, double))
            (failed, rms), (failed_double, rms_double) = outcomes
            found.append(Trial(form, weighting, failed, failed_double, rms, rms_double))
    return found


def _attitudes(
    form: Form, simulation: Simulation, weightings: Sequence[Weighting], precision: Precision
) -> Array:
    if form == "covariance":
        return covariance_form(simulation, weightings, precision)
    return np.stack([square_root_form(simulation, w, precision) for w in weightings], axis=1)


def _outcome(simulation: Simulation, q: Array) -> tuple[int | None, float]:
    lost = np.flatnonzero(~np.isfinite(q).all(axis=-1))
    error = metrics.attitude_error(q, simulation.truth.q[:SAMPLES]).rms()
    return (int(lost[0]) if lost.size else None), error.total


def square_root_form(simulation: Simulation, weighting: Weighting, precision: Precision) -> Array:
    """Attitudes (SAMPLES, 4) of the C code, which is not asked whether it allows the weighting.

    NaN from the sample at which the covariance is lost.
    """
    descriptor = descriptors.load("ukf")
    values: dict[str, object] = dict(experiments.setting("UKF").values(SCENARIO, simulation.scenario))
    values |= {"q0": simulation.q0, "alpha": weighting.alpha, "kappa": weighting.kappa}
    values["initial_attitude_std"], values["initial_bias_std"] = weighting.attitude_std, weighting.bias_std
    model = NativeModel(descriptor, precision)
    for name, value in values.items():
        model.set(name, descriptor.numbers(descriptor.parameter(name), value))
    model.reset()
    record = simulation.record.rows(0, SAMPLES)
    columns = {"gyro": record.gyro, "accel": record.accel, "mag": record.mag}
    y = model.run(record.steps, columns, ("q", "covariance_reset"))
    lost = np.maximum.accumulate(y["covariance_reset"])
    return np.where(lost[:, None], np.nan, y["q"])


class _State(NamedTuple):
    q: Array
    bias: Array
    covariance: Array


class _CovarianceFilter:
    """The unscented filter as textbooks write it, with a batch of weightings in one floating-point type."""

    def __init__(self, scenario: Scenario, weightings: Sequence[Weighting], real: DTypeLike) -> None:
        def column(values: Sequence[object]) -> Array:
            return np.array(values, dtype=real)[:, None, None]

        p = SimpleNamespace(**experiments.setting("UKF").values(SCENARIO, scenario))
        dt = scenario.sample_time
        self.units = np.array([1e9 if w.unit == "nT" else 1e6 for w in weightings])[:, None]
        points = [ukf.sigma_weights(SimpleNamespace(**w._asdict(), beta=0.0)) for w in weightings]
        self._spread = column([spread for spread, _, _ in points])
        self._mean_weights = np.array([mean for _, mean, _ in points], dtype=real)
        self._weights = np.array([covariance for _, _, covariance in points], dtype=real)
        self._symmetrised = np.array([w.symmetrised for w in weightings])[:, None, None]
        self._stds = np.array([[w.attitude_std] * 3 + [w.bias_std] * 3 for w in weightings])
        turning = np.asarray(p.gyro_noise**2 * dt)
        self._growth = mekf.integrated_noise(turning, p.gyro_bias_noise**2, dt).astype(real)
        force, field = np.full_like(self.units, p.accel_noise), p.mag_noise * self.units
        variances = np.concatenate((force, force, force, field, field, field), axis=-1) ** 2 / dt
        self._noise = matrices.diagonal(variances).astype(real)
        self._field = (self.units * scenario.field).astype(real)[:, None, :]
        self._gravity = np.asarray(p.gravity, dtype=real)
        self._dt = np.asarray(dt, dtype=real)
        self._real = real

    def start(self, q0: Array) -> _State:
        """Begin from an attitude (4,)."""
        count = len(self._stds)
        first = (np.tile(q0, (count, 1)), np.zeros((count, 3)), matrices.diagonal(self._stds**2))
        return _State(*(x.astype(self._real) for x in first))

    def predict(self, s: _State, rate: Array) -> _State:
        """Turn by the rate (3,) for one sample."""
        points = ukf.sigma_points(self._spread, s.covariance)
        attitudes = quaternion.multiply(s.q[:, None], quaternion.exp(points[..., :3]))
        turn = (rate - (s.bias[:, None] + points[..., 3:])) * self._dt
        turned = quaternion.multiply(attitudes, quaternion.exp(turn))
        centre = turned[:, 0]
        turns = quaternion.log(quaternion.multiply(quaternion.conjugate(centre)[:, None], turned))
        points = np.concatenate((turns, points[..., 3:]), axis=-1)
        mean = ukf.mean_of(self._mean_weights, points)
        deviation = points - mean[:, None]
        covariance = self._kept(ukf.moment(self._weights, deviation, deviation) + self._growth)
        q = quaternion.multiply(centre, quaternion.exp(mean[:, :3]))
        return _State(q, s.bias + mean[:, 3:], covariance)

    def correct(self, s: _State, measured: Array) -> _State:
        """Correct by specific force and field (weightings, 6)."""
        points = ukf.sigma_points(self._spread, s.covariance)
        attitudes = quaternion.multiply(s.q[:, None], quaternion.exp(points[..., :3]))
        down, north = down_of(attitudes), north_of(attitudes)
        field = self._field[..., :1] * north + self._field[..., 2:] * down
        expected = np.concatenate((-self._gravity * down, field), axis=-1)
        mean = ukf.mean_of(self._mean_weights, expected)
        deviation = expected - mean[:, None]
        innovation = ukf.moment(self._weights, deviation, deviation) + self._noise
        gain = matrices.solve_right(ukf.moment(self._weights, points, deviation), innovation)
        covariance = self._kept(s.covariance - gain @ innovation @ matrices.transposed(gain))
        change = matrices.apply(gain, measured - mean)
        q = quaternion.normalise(quaternion.multiply(s.q, quaternion.exp(change[:, :3])))
        return _State(q, s.bias + change[:, 3:], covariance)

    def _kept(self, covariance: Array) -> Array:
        return np.where(self._symmetrised, matrices.symmetric(covariance), covariance)


def covariance_form(simulation: Simulation, weightings: Sequence[Weighting], precision: Precision) -> Array:
    """Attitudes (SAMPLES, weightings, 4) of the numpy back-end's equations.

    NaN from the sample at which the covariance is lost.
    """
    real = _TYPES[precision]
    filter_ = _CovarianceFilter(simulation.scenario, weightings, real)
    state = filter_.start(simulation.q0)
    record = simulation.record.rows(0, SAMPLES)
    rate, force, mag = record.gyro.astype(real), record.accel, record.mag
    found = np.empty((SAMPLES, len(weightings), 4))
    found[0] = state.q
    for k in range(1, SAMPLES):
        both = (np.broadcast_to(force[k], (len(weightings), 3)), filter_.units * mag[k])
        measured = np.concatenate(both, axis=-1).astype(real)
        # What is lost is NaN and stays it.
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            state = filter_.correct(filter_.predict(state, rate[k]), measured)
            lost = ~matrices.all_finite(matrices.cholesky(state.covariance))
        state.q[lost] = np.nan
        found[k] = state.q
    return found
