"""Scenario files as tests: what `ahrs_fmu.cosim.pytest_plugin` imports when it meets one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, get_args

import pytest

from ahrs_fmu.cosim import running, scenario
from ahrs_fmu.cosim.fmu import FmuStepper, Value
from ahrs_fmu.cosim.instances import Component, Instances, Via
from ahrs_fmu.cosim.plots import draw
from ahrs_fmu.cosim.running import Outcome
from ahrs_fmu.cosim.scenario import Case
from ahrs_fmu.cosim.system import System
from ahrs_fmu.errors import AhrsError, ScenarioError
from ahrs_fmu.export.variant import FMI_VIA

_VIA: Mapping[str, Via] = {FMI_VIA[via]: via for via in get_args(Via) if via in FMI_VIA}


class ExpectationError(AssertionError):
    """An expectation does not hold, or the run has stopped."""


class ScenarioCollector(pytest.File):
    """A scenario file; its cases are the tests."""

    def collect(self) -> Iterable[pytest.Item]:
        """Make one test of each case."""
        try:
            file = scenario.read(self.path)
        except AhrsError as error:
            raise self.CollectError(str(error)) from None
        for case in file.cases():
            # An equals sign could not stand in an expression of -k.
            item: CaseItem = CaseItem.from_parent(self, name=case.label.replace("=", ":"), case=case)
            yield item


class CaseItem(pytest.Item):
    """One case of a scenario file."""

    def __init__(self, *, case: Case, **rest: Any) -> None:
        super().__init__(**rest)
        self._case = case

    def runtest(self) -> None:
        """Run the case and judge it.

        Raises
        ------
        ExpectationError
            If an expectation does not hold or a component fails.
        """
        folder = self.path.parent
        outcome = running.run(self._case, instances_of(self.config), folder)
        if not outcome.passed:
            raise ExpectationError(_explained(outcome, self._draw(outcome)))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Show what is wrong without the way through this package."""
        error = excinfo.value
        if isinstance(error, ExpectationError):
            return str(error)
        if isinstance(error, AhrsError):
            return str(error)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Say which file and which case it is."""
        return self.path, 0, f"{self.path.name} {self.name}"

    def _draw(self, outcome: Outcome) -> Path | None:
        folder = self.config.rootpath / self.config.getoption("--cosim-output")
        return next(iter(draw(outcome, self.path.name.removesuffix(scenario.SUFFIX), folder)), None)


class Opener:
    """What the fixtures open; every call has components of its own, closed with the stack.

    Parameters
    ----------
    stack : ExitStack
    build : Path
        Where FMUs are built.
    """

    def __init__(self, stack: ExitStack, build: Path) -> None:
        self._stack, self._build = stack, build

    def system(self, path: Path, changes: Mapping[str, object], seed: int | None) -> System:
        """Assemble the system of a scenario file."""
        case = scenario.read(path).case(changes, seed)
        return running.assemble(case, self._instances(), path.parent)

    def fmu(self, folder: Path, source: str | Path, parameters: Mapping[str, Value], fmi: str) -> FmuStepper:
        """Open an FMU file, or build the FMU of a model."""
        if fmi not in _VIA:
            raise ScenarioError(f"fmi = '{fmi}': it must be one of {', '.join(_VIA)}")
        is_file = str(source).endswith(".fmu")
        component = Component(fmu=str(source)) if is_file else Component(model=str(source), via=_VIA[fmi])
        opened = self._instances().open(Path(source).stem, component, parameters, {}, folder)
        assert isinstance(opened, FmuStepper)
        return opened

    def _instances(self) -> Instances:
        return self._stack.enter_context(Instances(self._build))


@contextmanager
def opened(build: Path) -> Iterator[Opener]:
    """Give something that opens FMUs and systems; they are closed at the end."""
    with ExitStack() as stack:
        yield Opener(stack, build)


_INSTANCES = pytest.StashKey[Instances]()


def instances_of(config: pytest.Config) -> Instances:
    """Components shared by the scenarios of a test run."""
    if _INSTANCES not in config.stash:
        config.stash[_INSTANCES] = Instances()
        config.add_cleanup(config.stash[_INSTANCES].close)
    return config.stash[_INSTANCES]


def _explained(outcome: Outcome, plot: Path | None) -> str:
    lines = [f"stopped: {outcome.failure}"] if outcome.failure else []
    for verdict in outcome.verdicts:
        if not verdict.passed:
            when = "" if verdict.at is None else f", at {verdict.at:.2f} s"
            lines.append(f"{verdict.clause}: {verdict.value}; expected {verdict.limit}{when}")
    if plot is not None:
        lines.append(f"plot: {plot}")
    return "\n".join(lines)
