"""Margins of a loop, measured: an integrator whose gain and delay are known."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec
import numpy as np
import pytest

from ahrs_fmu.cosim.faults import AnyFault, taps
from ahrs_fmu.cosim.loop_gain import margins
from ahrs_fmu.cosim.stepper import Array, Port
from ahrs_fmu.cosim.system import System
from ahrs_fmu.errors import ScenarioError

STEP = 0.01


class Integrator:
    """x' = -gain u, from one step to the next."""

    inputs: Mapping[str, Port] = {"u": Port()}
    outputs: Mapping[str, Port] = {"x": Port()}

    def __init__(self, gain: float) -> None:
        self.gain = gain
        self.reset()

    def reset(self) -> None:
        self.u, self.x = 0.0, 1e-3

    def set(self, name: str, value: object) -> None:  # noqa: ARG002
        self.u = float(np.asarray(value))

    def get(self, name: str) -> Array:
        return np.asarray({"x": self.x}[name])

    def step(self, dt: float) -> None:
        self.x -= self.gain * dt * self.u

    def save(self) -> object:
        return self.u, self.x

    def restore(self, state: tuple[float, float]) -> None:
        self.u, self.x = state


def loop(gain: float, delay: float = 0.0) -> System:
    late = {"kind": "delay", "signal": "plant.x", "time": delay}
    faults = {"late": msgspec.convert(late, AnyFault)} if delay else {}
    made = taps(faults, {"plant.x": Port()}, STEP, 1)
    return System({"plant": Integrator(gain)}, ["plant.x -> plant.u"], step=STEP, taps=made)


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


def test_an_unstable_loop_has_no_margin() -> None:
    # 90 deg are used up by 20 rad/s times 78.5 ms.
    found = margins(loop(20.0, 0.12), "plant.x", [1.0])
    assert found.phase_margin == -np.inf
    assert found.gain_margin == 0.0


def test_a_direction_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"direction \[1.0, 2.0\] does not fit plant.x"):
        margins(loop(1.0), "plant.x", [1.0, 2.0])
