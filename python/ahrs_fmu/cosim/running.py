"""Running a case of a scenario: components made and connected, signals recorded, expectations judged."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ahrs_fmu.cosim import faults, loop_gain
from ahrs_fmu.cosim import scenario as scenarios
from ahrs_fmu.cosim.derived import source_of, with_derived
from ahrs_fmu.cosim.expectations import MARGINS, Verdict, judge
from ahrs_fmu.cosim.instances import Instances
from ahrs_fmu.cosim.recording import Recording
from ahrs_fmu.cosim.scenario import Case, Scenario
from ahrs_fmu.cosim.stepper import Stepper
from ahrs_fmu.cosim.system import System
from ahrs_fmu.errors import ScenarioError, SimulationError

_SAMPLE_TIME = "sample_time"
_SEED = "seed"


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What came out of a case.

    Attributes
    ----------
    case : Case
    recording : Recording
        With the derived signals, up to the failure if there was one.
    verdicts : sequence of Verdict
        One for each clause; none after a failure.
    order : sequence of str
        Components as they were stepped.
    delayed : sequence of str
        Connections that hand over the value of the step before.
    failure : str
        Why the run stopped; empty if it did not.
    items : mapping of str to mapping of str to int
        By recorded signal: what its numbers are called, empty unless it is an enumeration.
    """

    case: Case
    recording: Recording
    verdicts: Sequence[Verdict]
    order: Sequence[str]
    delayed: Sequence[str]
    failure: str = ""
    items: Mapping[str, Mapping[str, int]] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether the run came to its end and every clause holds."""
        return not self.failure and all(verdict.passed for verdict in self.verdicts)


def assemble(case: Case, instances: Instances, folder: Path) -> System:
    """Connect the components of a case.

    Parameters
    ----------
    case : Case
    instances : Instances
        Where the components come from; they are in use until it hands them out again.
    folder : Path
        What file names are relative to.

    Raises
    ------
    ScenarioError
        If the components do not fit together; the message names the file.
    """
    with _naming(case.file):
        return _assembled(case, instances, folder)


@contextmanager
def _naming(file: str) -> Iterator[None]:
    """Put the name of the file before what is wrong with it."""
    try:
        yield
    except ScenarioError as error:
        raise ScenarioError(f"{file}: {error}") from error


def _assembled(case: Case, instances: Instances, folder: Path) -> System:
    scenario = case.scenario
    components = _played(scenario, case.seed)
    common = {_SAMPLE_TIME: scenario.step, _SEED: case.seed}
    for name, component in scenario.components.items():
        if name in components:
            raise ScenarioError(
                f"components.{name}: the table [{name}] already makes a component of this name"
            )
        parameters = component.parameters
        if name == scenario.sensor_of:
            parameters = scenario.sensor_parameters() | parameters
        components[name] = instances.open(name, component, parameters, common, folder)

    ports = {
        f"{name}.{output}": port
        for name, component in components.items()
        for output, port in component.outputs.items()
    }
    return System(
        components,
        scenario.connections,
        step=scenario.step,
        drives=scenario.drives,
        start_values=scenario.start_values,
        taps=faults.taps(scenario.faults, ports, scenario.step, case.seed),
        method=scenario.method,
    )


def run(
    case: Case,
    instances: Instances,
    folder: Path,
    progress: Callable[[int], None] | None = None,
) -> Outcome:
    """Run a case and judge it.

    Parameters
    ----------
    case : Case
    instances : Instances
    folder : Path
        What file names are relative to.
    progress : callable, optional
        Called with the number of steps done since the last call.

    Raises
    ------
    ScenarioError
        If the scenario is wrong: nothing of it depends on what a component does.
    """
    with _naming(case.file):
        return _run(case, _assembled(case, instances, folder), progress)


def _run(case: Case, system: System, progress: Callable[[int], None] | None) -> Outcome:
    scenario = case.scenario
    wanted = signals_of(scenario)
    flow = system.order, [str(connection) for connection in system.delayed]
    try:
        recording = system.run(scenario.duration, wanted, progress)
    except SimulationError as error:
        if not isinstance(error.recording, Recording):
            raise
        return Outcome(case, with_derived(error.recording, scenario.signals), (), *flow, str(error))
    recording = with_derived(recording, scenario.signals)
    items = {name: system.port(name).items for name in wanted}
    margins = _margins(scenario, system)
    verdicts = [
        judge(e, recording, items, scenario.fault_end, margins.get((e.signal, e.direction), {}))
        for e in scenario.expect
    ]
    return Outcome(case, recording, verdicts, *flow, items=items)


def run_file(
    path: str | Path,
    changes: Mapping[str, object] = MappingProxyType({}),
    seeds: Sequence[int] | None = None,
) -> list[Outcome]:
    """Run all cases of a scenario file.

    Parameters
    ----------
    path : str or Path
    changes : mapping of str to value, optional
        Fields by their dotted names, such as ``components.estimator.model``.
    seeds : sequence of int, optional
        Instead of those of the file.

    Raises
    ------
    ScenarioError
        If the file or a change is wrong.
    """
    file = scenarios.read(path)
    with Instances() as instances:
        return [run(case, instances, file.path.parent) for case in file.cases(changes, seeds)]


def signals_of(scenario: Scenario) -> list[str]:
    """Outputs that have to be recorded: those asked for, and what expectations and derived signals need.

    Raises
    ------
    ScenarioError
        If an expectation names a derived signal or a part of one that there is not.
    """
    names = list(scenario.record)
    for derived in scenario.signals.values():
        names += derived.sources
    for expectation in scenario.expect:
        source = source_of(expectation.signal)
        if source.partition(".")[0] not in scenario.signals:
            names.append(source)
    return list(dict.fromkeys(names))


def _margins(
    scenario: Scenario, system: System
) -> Mapping[tuple[str, tuple[float, ...]], Mapping[str, float]]:
    """Both margins by signal and direction, measured once for all clauses that ask for one of them."""
    loops = dict.fromkeys((e.signal, e.direction) for e in scenario.expect if e.measure in MARGINS)
    found = {loop: loop_gain.margins(system, *loop) for loop in loops}
    return {
        loop: {"phase_margin": gain.phase_margin, "gain_margin": gain.gain_margin}
        for loop, gain in found.items()
    }


def _played(scenario: Scenario, seed: int) -> dict[str, Stepper]:
    """Components made of tables; a manoeuvre may be looked at a step beyond the end."""
    duration = scenario.duration
    if any(expectation.measure in MARGINS for expectation in scenario.expect):
        duration = max(duration, loop_gain.LONGEST)
    rows = int(np.ceil(duration / scenario.step)) + 1
    found: dict[str, Stepper] = {}
    if scenario.manoeuvre is not None:
        found["manoeuvre"] = scenario.manoeuvre.playback(scenario.step, rows)
    if scenario.motion is not None:
        found["motion"] = scenario.motion.playback(scenario.step, rows)
    if scenario.wind is not None:
        found["wind"] = scenario.wind.playback(scenario.step, rows, seed)
    return found
