"""Margins of a loop, measured: an integrator whose gain and delay are known."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec
import numpy as np
import pytest

from ahrs_fmu.cosim.faults import AnyFault, taps
from ahrs_fmu.cosim.loop_gain import margins, with_margins
from ahrs_fmu.cosim.stepper import Array, Port
from ahrs_fmu.cosim.system import System
from ahrs_fmu.errors import ScenarioError

STEP = 0.01


class Integrator:
    """x' = -gain u, from one step to the next, read with noise that is a function of the sample number."""

    inputs: Mapping[str, Port] = {"u": Port()}
    outputs: Mapping[str, Port] = {"x": Port()}

    def __init__(self, gain: float, noise: float = 0.0) -> None:
        self.gain, self.noise = gain, noise
        self.reset()

    def reset(self) -> None:
        self.u, self.x, self.k = 0.0, 1e-3, 0

    def set(self, name: str, value: object) -> None:  # noqa: ARG002
        self.u = float(np.asarray(value))

    def get(self, name: str) -> Array:
        noise = self.noise * np.random.default_rng(self.k).standard_normal()
        return np.asarray({"x": self.x + noise}[name])

    def step(self, dt: float) -> None:
        self.x -= self.gain * dt * self.u
        self.k += 1

    def save(self) -> object:
        return self.u, self.x, self.k

    def restore(self, state: tuple[float, float, int]) -> None:
        self.u, self.x, self.k = state


def loop(gain: float, delay: float = 0.0, noise: float = 0.0) -> System:
    late = {"kind": "delay", "signal": "plant.x", "time": delay}
    faults = {"late": msgspec.convert(late, AnyFault)} if delay else {}
    made = taps(faults, {"plant.x": Port()}, STEP, 1)
    return System({"plant": Integrator(gain, noise)}, ["plant.x -> plant.u"], step=STEP, taps=made)


@pytest.mark.parametrize(("gain", "delay"), [(10.0, 0.0), (10.0, 0.04), (20.0, 0.02)])
def test_the_margins_are_those_of_an_integrator_with_a_delay(gain: float, delay: float) -> None:
    found = margins(loop(gain, delay), "plant.x", [1.0])
    # L = gain T e^(-jw delay)/(e^(jwT) - 1): one at sin(wT/2) = gain T/2, its phase -90 deg - w(T/2 + delay).
    crossover = 2.0 / STEP * np.arcsin(0.5 * gain * STEP)
    assert found.crossover == pytest.approx(crossover, rel=2e-3)
    assert found.phase_margin == pytest.approx(0.5 * np.pi - crossover * (0.5 * STEP + delay), abs=2e-3)
    opposite = 0.5 * np.pi / (0.5 * STEP + delay)
    if opposite < found.frequency[-1]:
        limit = 2.0 / STEP * np.sin(0.5 * opposite * STEP) / gain
        assert found.gain_margin == pytest.approx(limit, rel=5e-3)
        assert found.phase_crossover == pytest.approx(opposite, rel=5e-3)
    else:
        assert found.gain_margin == np.inf


def test_noise_cancels() -> None:
    """The noise is a thousand times the disturbance, and the same with and without it."""
    quiet, noisy = (
        margins(loop(10.0, 0.04, noise), "plant.x", [1.0], amplitude=1e-3) for noise in (0.0, 1.0)
    )
    np.testing.assert_allclose(noisy.response, quiet.response, rtol=1e-6)


def test_the_smallest_of_several_margins_counts() -> None:
    """An integrator with a resonance, which takes the gain over one twice more."""
    frequency = np.geomspace(1.0, 100.0, 200)
    resonance = 1.0 / (1.0 - (frequency / 50.0) ** 2 + 0.02j * frequency / 50.0)
    found = with_margins(frequency, 10.0 / (1j * frequency) * resonance)
    assert found.crossover > 45.0
    assert found.phase_margin < np.radians(90.0)


def test_without_a_crossing_there_is_no_phase_margin() -> None:
    found = margins(loop(0.5), "plant.x", [1.0])
    assert np.isnan(found.phase_margin)
    assert np.isnan(found.crossover)


# 90 deg are used up by 20 rad/s times 78.5 ms; without a delay by a gain of two per sample.
@pytest.mark.parametrize(("gain", "delay"), [(20.0, 0.12), (201.0, 0.0), (220.0, 0.0)])
def test_an_unstable_loop_has_no_margin(gain: float, delay: float) -> None:
    found = margins(loop(gain, delay), "plant.x", [1.0], amplitude=0.1)
    assert found.phase_margin == -np.inf
    assert found.gain_margin == 0.0


def test_a_direction_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"direction \[1.0, 2.0\] does not fit plant.x"):
        margins(loop(1.0), "plant.x", [1.0, 2.0])


def test_frequencies_beyond_half_the_sampling_rate_are_refused() -> None:
    with pytest.raises(ScenarioError, match="half the sampling rate"):
        margins(loop(1.0), "plant.x", [1.0], np.array([10.0, 400.0]))
