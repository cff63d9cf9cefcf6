"""What everything that steps has in common: an FMU, the C core, a numpy class.

A stepper is a sampled device. Inputs set before ``step(dt)`` are the ones the step uses; outputs read
after it belong to the end of the step and hold until the next one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Port:
    """What is known of one input or output."""

    unit: str = ""
    """Unit in the notation of FMI, empty for a pure number."""
    shape: tuple[int, ...] = ()
    """Shape of the value; empty for a scalar."""
    items: Mapping[str, int] = field(default_factory=dict)
    """Numbers of an enumeration's items by name."""
    boolean: bool = False
    """Whether it is a truth value."""


class Stepper(Protocol):
    """A component that can be driven step by step.

    Booleans and enumerations travel as numbers, so that every value is a float64 array.
    """

    @property
    def inputs(self) -> Mapping[str, Port]:
        """The variables `set` accepts."""

    @property
    def outputs(self) -> Mapping[str, Port]:
        """The variables `get` returns."""

    def set(self, name: str, value: ArrayLike) -> None:
        """Give an input the value that the next steps use."""

    def get(self, name: str) -> Array:
        """Return an output as it is now."""

    def step(self, dt: float) -> None:
        """Advance the time by `dt` seconds."""

    def save(self) -> object:
        """Return the complete state, opaque to the caller."""

    def restore(self, state: Any) -> None:
        """Continue from a state that `save` returned."""

    def reset(self) -> None:
        """Return to the state of a fresh instance with the same parameters."""


@runtime_checkable
class Grouping(Protocol):
    """A stepper that takes or gives several variables in one call, faster than one after the other."""

    def set_all(self, values: Mapping[str, Array]) -> None:
        """Do what `Stepper.set` does for each of the inputs."""

    def get_all(self, names: Sequence[str]) -> Mapping[str, Array]:
        """Return what `Stepper.get` returns for each of the variables."""


@runtime_checkable
class Replayer(Protocol):
    """A stepper that also takes a whole record in one call, much faster than step by step."""

    never_fails: bool
    """Whether no step can fail, so that nothing is lost when a record is taken as a whole."""

    def replay(
        self, inputs: Mapping[str, Array], outputs: Sequence[str], dt: float, rows: int | None = None
    ) -> dict[str, Array]:
        """Do what `ahrs_fmu.cosim.stepper.replay` does; without inputs `rows` is the number of steps."""


def replay(
    stepper: Stepper, inputs: Mapping[str, Array], outputs: Sequence[str], dt: float
) -> dict[str, Array]:
    """Step through a record from the stepper's present state.

    Parameters
    ----------
    stepper : Stepper
        The component; one that is a `Replayer` gets the record as a whole.
    inputs : mapping of str to array (N, ...)
        Row k is set before the step that ends at tick k.
    outputs : sequence of str
        The outputs to record.
    dt : float
        Length of a step in seconds.

    Returns
    -------
    dict of str to array (N, ...)
        Row k holds the outputs after step k.
    """
    if isinstance(stepper, Replayer):
        return stepper.replay(inputs, outputs, dt)
    rows: dict[str, list[Array]] = {name: [] for name in outputs}
    for k in range(len(next(iter(inputs.values())))):
        for name, values in inputs.items():
            stepper.set(name, values[k])
        stepper.step(dt)
        for name in outputs:
            rows[name].append(np.array(stepper.get(name), dtype=np.float64))
    return {name: np.array(values) for name, values in rows.items()}
