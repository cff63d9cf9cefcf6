"""The exceptions of the package.

Everything raised on purpose derives from `AhrsError` and from the built-in exception it
resembles, so that a program can catch either::

    AhrsError
     ├── DescriptorError  (ValueError)    a model's TOML is wrong
     ├── ParameterError   (ValueError)    a parameter's name or value is refused
     ├── RecordError      (ValueError)    a recording cannot be used
     ├── DesignError      (ValueError)    gains or noise levels make no sense
     ├── CalibrationError (ValueError)    readings are unfit for a calibration
     ├── ScenarioError    (ValueError)    a scenario or a co-simulation file is wrong
     ├── UnitError        (ValueError)    a unit is unknown or measures something else
     ├── MissingExtraError (ImportError)  an optional dependency is not installed
     ├── BuildError       (RuntimeError)  compiling or packaging failed
     ├── SimulationError  (RuntimeError)  a component failed during a co-simulation
     └── FmuError         (RuntimeError)  an FMU refused a call

The message is one line that names the thing, the value, the limit and the way out.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

_MOST_LISTED = 15


class AhrsError(Exception):
    """Base of every exception the package raises on purpose."""


class DescriptorError(AhrsError, ValueError):
    """A model's descriptor breaks the rules of `ahrs_fmu.descriptors`."""


class ParameterError(AhrsError, ValueError):
    """A parameter's name is unknown or its value is outside its limits."""


class RecordError(AhrsError, ValueError):
    """A recording is incomplete, in the wrong unit or not in time order."""


class DesignError(AhrsError, ValueError):
    """Gains, noise densities or frequencies are outside what a design can use."""


class CalibrationError(AhrsError, ValueError):
    """Readings are unfit for a calibration: the vehicle moved, or an axis was not covered."""


class ScenarioError(AhrsError, ValueError):
    """A scenario, a sensor or a co-simulation file is wrong."""


class UnitError(AhrsError, ValueError):
    """A unit is unknown, or measures something else than it should."""


class MissingExtraError(AhrsError, ImportError):
    """An optional dependency is needed and not installed."""


class BuildError(AhrsError, RuntimeError):
    """Compiling or packaging failed."""


class FmuError(AhrsError, RuntimeError):
    """An FMU refused a call."""


class SimulationError(AhrsError, RuntimeError):
    """A component failed during a co-simulation.

    Attributes
    ----------
    recording : object or None
        What was recorded before, as `ahrs_fmu.cosim.recording.Recording`.
    """

    recording: object = None


def known_names(name: str, known: Iterable[str]) -> str:
    """Words for the names that would have been right, to stand behind "it has": all of them, or like ones.

    Parameters
    ----------
    name : str
        What was asked for.
    known : iterable of str
        What there is.
    """
    names = list(known)
    if len(names) <= _MOST_LISTED:
        return ", ".join(names) or "none"
    like = get_close_matches(name.lower(), names, n=3, cutoff=0.5)
    return f"{' or '.join(like)} among {len(names)}" if like else f"{', '.join(names[:_MOST_LISTED])} ..."
