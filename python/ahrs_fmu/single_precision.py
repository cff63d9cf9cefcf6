"""Which weights an unscented filter bears in single precision, and how the UKF here bears them.

A source reports that its UKF fails in single precision. Here such a filter runs in both precisions: as
textbooks write it, with a covariance and with a square root, in numpy's float32; and as the C code has it,
driven below the rule that refuses an alpha. What fails is the textbooks' alpha of 0.001, whose weights of a
million with both signs cancel, in either form. The C code sums up the same covariance in another way.
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
from ahrs_fmu.estimators.state import Mask
from ahrs_fmu.host_library import Precision
from ahrs_fmu.native import NativeModel
from ahrs_fmu.scenarios import Scenario, Simulation

Array = NDArray[np.float64]
"""In single precision the arrays are float32, whatever their annotation says."""

Form = Literal["covariance", "square root", "C code"]

SCENARIO = "gc/lin"
SAMPLES = 1200
FAILING_ALPHA = 0.001
"""With this one the textbook forms are expected to fail in single precision."""

_TYPES: dict[Precision, DTypeLike] = {"single": np.float32, "double": np.float64}


class Weighting(NamedTuple):
    """Sigma points of a filter, and what else may matter for rounding.

    Attributes
    ----------
    alpha, kappa : float
        Spread of the points.
    unit : {"uT", "nT"}
        Of the magnetometer inside the filter; the C code measures in units of the noise.
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
        Weighting(1.0),
        Weighting(1.0, kappa=-3.0),
    ),
    "C code": (
        Weighting(0.001),
        Weighting(0.01),
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
    form : {"covariance", "square root", "C code"}
        What is propagated, and who does it.
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
        """Whether double precision and the C code hold, and the rest but for `FAILING_ALPHA`."""
        fails = self.weighting.alpha <= FAILING_ALPHA and self.form != "C code"
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
    if form == "C code":
        return np.stack([c_code(simulation, w, precision) for w in weightings], axis=1)
    textbook = _SquareRootFilter if form == "square root" else _CovarianceFilter
    return _run(textbook(simulation.scenario, weightings, _TYPES[precision]), simulation)


def _outcome(simulation: Simulation, q: Array) -> tuple[int | None, float]:
    lost = np.flatnonzero(~np.isfinite(q).all(axis=-1))
    error = metrics.attitude_error(q, simulation.truth.q[:SAMPLES]).rms()
    return (int(lost[0]) if lost.size else None), error.total


def c_code(simulation: Simulation, weighting: Weighting, precision: Precision) -> Array:
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
    """Or its root."""


class _CovarianceFilter:
    """The unscented filter as textbooks write it, with a batch of weightings in one floating-point type."""

    def __init__(self, scenario: Scenario, weightings: Sequence[Weighting], real: DTypeLike) -> None:
        p = SimpleNamespace(**experiments.setting("UKF").values(SCENARIO, scenario))
        dt = scenario.sample_time
        self.units = np.array([1e9 if w.unit == "nT" else 1e6 for w in weightings])[:, None]
        points = [ukf.sigma_weights(SimpleNamespace(**w._asdict(), beta=0.0)) for w in weightings]
        self.spread = np.array([spread for spread, _, _ in points], dtype=real)[:, None, None]
        self._mean_weights = np.array([mean for _, mean, _ in points], dtype=real)
        self.weights = np.array([covariance for _, _, covariance in points], dtype=real)
        self._symmetrised = np.array([w.symmetrised for w in weightings])[:, None, None]
        self.stds = np.array([[w.attitude_std] * 3 + [w.bias_std] * 3 for w in weightings])
        turning = np.asarray(p.gyro_noise**2 * dt)
        self.growth = mekf.integrated_noise(turning, p.gyro_bias_noise**2, dt).astype(real)
        force, field = np.full_like(self.units, p.accel_noise), p.mag_noise * self.units
        variances = np.concatenate((force, force, force, field, field, field), axis=-1) ** 2 / dt
        self.noise = matrices.diagonal(variances).astype(real)
        self._field = (self.units * scenario.field).astype(real)[:, None, :]
        self._gravity = np.asarray(p.gravity, dtype=real)
        self._dt = np.asarray(dt, dtype=real)
        self.real = real

    def start(self, q0: Array) -> _State:
        """Begin from an attitude (4,)."""
        count = len(self.stds)
        first = (np.tile(q0, (count, 1)), np.zeros((count, 3)), self.initial())
        return _State(*(x.astype(self.real) for x in first))

    def predict(self, s: _State, rate: Array) -> _State:
        """Turn by the rate (3,) for one sample."""
        points = self.points(s.covariance)
        attitudes = quaternion.multiply(s.q[:, None], quaternion.exp(points[..., :3]))
        turn = (rate - (s.bias[:, None] + points[..., 3:])) * self._dt
        turned = quaternion.multiply(attitudes, quaternion.exp(turn))
        centre = turned[:, 0]
        turns = quaternion.log(quaternion.multiply(quaternion.conjugate(centre)[:, None], turned))
        points = np.concatenate((turns, points[..., 3:]), axis=-1)
        mean = ukf.mean_of(self._mean_weights, points)
        q = quaternion.multiply(centre, quaternion.exp(mean[:, :3]))
        return _State(q, s.bias + mean[:, 3:], self.summed(points - mean[:, None], self.growth))

    def correct(self, s: _State, measured: Array) -> _State:
        """Correct by specific force and field (weightings, 6)."""
        points = self.points(s.covariance)
        attitudes = quaternion.multiply(s.q[:, None], quaternion.exp(points[..., :3]))
        down, north = down_of(attitudes), north_of(attitudes)
        field = self._field[..., :1] * north + self._field[..., 2:] * down
        expected = np.concatenate((-self._gravity * down, field), axis=-1)
        mean = ukf.mean_of(self._mean_weights, expected)
        deviation = expected - mean[:, None]
        gain, covariance = self.corrected(s.covariance, points, deviation)
        change = matrices.apply(gain, measured - mean)
        q = quaternion.normalise(quaternion.multiply(s.q, quaternion.exp(change[:, :3])))
        return _State(q, s.bias + change[:, 3:], covariance)

    def initial(self) -> Array:
        """Covariance at the start."""
        return matrices.diagonal(self.stds**2)

    def points(self, covariance: Array) -> Array:
        """Deviations (..., 13, 6) of the sigma points."""
        return ukf.sigma_points(self.spread, covariance)

    def summed(self, deviation: Array, noise: Array) -> Array:
        """Covariance of deviations with noise."""
        return self._kept(ukf.moment(self.weights, deviation, deviation) + noise)

    def corrected(self, covariance: Array, points: Array, deviation: Array) -> tuple[Array, Array]:
        """Gain and the covariance after a measurement."""
        innovation = ukf.moment(self.weights, deviation, deviation) + self.noise
        gain = matrices.solve_right(ukf.moment(self.weights, points, deviation), innovation)
        return gain, self._kept(covariance - gain @ innovation @ matrices.transposed(gain))

    def is_lost(self, covariance: Array) -> Mask:
        """Where it is no covariance."""
        return ~matrices.all_finite(matrices.cholesky(covariance))

    def _kept(self, covariance: Array) -> Array:
        return np.where(self._symmetrised, matrices.symmetric(covariance), covariance)


class _SquareRootFilter(_CovarianceFilter):
    """The same with the root of the covariance: reflections, then one update by the estimate's own weight."""

    def initial(self) -> Array:
        return matrices.diagonal(self.stds)

    def points(self, covariance: Array) -> Array:
        columns = self.spread * matrices.transposed(covariance)
        return np.concatenate((np.zeros_like(columns[..., :1, :]), columns, -columns), axis=-2)

    def summed(self, deviation: Array, noise: Array) -> Array:
        own, others = self.weights[:, :1], self.weights[:, 1:]
        scaled = np.sqrt(others)[..., None] * deviation[..., 1:, :]
        roots = np.broadcast_to(matrices.cholesky(noise), (len(own), *noise.shape[-2:]))
        stacked = np.concatenate((scaled, matrices.transposed(roots)), axis=-2)
        triangle = matrices.transposed(np.asarray(np.linalg.qr(stacked, mode="r"), dtype=self.real))
        return updated(triangle, np.sqrt(np.abs(own)) * deviation[..., 0, :], np.sign(own[:, 0]))

    def corrected(self, covariance: Array, points: Array, deviation: Array) -> tuple[Array, Array]:
        innovation = self.summed(deviation, self.noise)
        squared = innovation @ matrices.transposed(innovation)
        gain = matrices.solve_right(ukf.moment(self.weights, points, deviation), squared)
        root, columns = covariance, gain @ innovation
        for j in range(columns.shape[-1]):
            root = updated(root, columns[..., j], np.full(len(root), -1.0, dtype=self.real))
        return gain, root

    def is_lost(self, covariance: Array) -> Mask:
        return ~matrices.all_finite(covariance)


def updated(root: Array, x: Array, sign: Array) -> Array:
    """Triangle (..., n, n) of L L' + sign x x', signs (...); NaN where that is not positive definite."""
    root, x = root.copy(), x.copy()
    for i in range(root.shape[-1]):
        old = root[..., i, i].copy()
        new = np.sqrt(old * old + sign * x[..., i] ** 2)
        c, s = (old / new)[..., None], (x[..., i] / new)[..., None]
        below, rest = root[..., i + 1 :, i].copy(), x[..., i + 1 :].copy()
        root[..., i, i] = new
        root[..., i + 1 :, i] = c * below + sign[..., None] * s * rest
        x[..., i + 1 :] = c * rest - s * below
    return root


def _run(filter_: _CovarianceFilter, simulation: Simulation) -> Array:
    """Attitudes (SAMPLES, weightings, 4); NaN from the sample at which the covariance is lost."""
    state = filter_.start(simulation.q0)
    count = len(state.q)
    record = simulation.record.rows(0, SAMPLES)
    rate, force, mag = record.gyro.astype(filter_.real), record.accel, record.mag
    found = np.empty((SAMPLES, count, 4))
    found[0] = state.q
    for k in range(1, SAMPLES):
        both = (np.broadcast_to(force[k], (count, 3)), filter_.units * mag[k])
        measured = np.concatenate(both, axis=-1).astype(filter_.real)
        # What is lost is NaN and stays it.
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            state = filter_.correct(filter_.predict(state, rate[k]), measured)
            lost = filter_.is_lost(state.covariance)
        state.q[lost] = np.nan
        found[k] = state.q
    return found
