"""``ahrs-fmu campaign``."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from statistics import median
from typing import Annotated

import typer

from ahrs_fmu import campaign as campaigns
from ahrs_fmu.campaign import Campaign, Progress, Results, requirements
from ahrs_fmu.campaign.clauses import clauses
from ahrs_fmu.campaign.store import Store
from ahrs_fmu.commands import terminal

EXAMPLES = """
Examples:
  ahrs-fmu campaign gains.campaign.toml --workers 4
  ahrs-fmu campaign gains.campaign.toml --scheduler tcp://host:8786
  ahrs-fmu campaign gains.campaign.toml --open      look at the report

A campaign that was interrupted goes on with the same command. docs/campaign.md describes the files.
"""

_SHOWN = 5


def campaign(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Campaign file, NAME.campaign.toml.")],
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes to start; default: one per processor.")
    ] = None,
    threads: Annotated[
        bool, typer.Option("--threads", help="Threads instead: they start faster and scale less.")
    ] = False,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Use the workers of a running Dask scheduler.")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Remove the results that are there and begin anew.")
    ] = False,
    worst: Annotated[int, typer.Option(min=0, help="How many of the worst cases the report draws.")] = 6,
    show: Annotated[bool, typer.Option("--open", help="Open the report.")] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder; default: build/campaign/NAME.")
    ] = None,
) -> int:
    """Run many variations of scenarios and report on them.

    Writes report.html, junit.xml and results.parquet. Returns 1 when a case does not pass.
    """
    if scheduler is not None and (workers is not None or threads):
        raise typer.BadParameter("a running cluster has its own workers", param_hint="--scheduler")
    requirements.check()
    plan = campaigns.read(file)
    folder = output or Path("build") / "campaign" / plan.name
    with terminal.progress() as bar:
        task = bar.add_task(plan.name, total=len(plan.cases))
        seen = Progress(0, 0, len(plan.cases), 0)

        def tell(at: Progress) -> None:
            nonlocal seen
            if not at.done:
                _announce(at)
            elif not seen.done:
                bar.reset(task, completed=at.known)
            seen = at
            bar.update(task, completed=at.known + at.done, description=_words(plan, at))

        try:
            results = campaigns.run(
                plan,
                folder,
                workers=workers or os.cpu_count() or 1,
                threads=threads,
                scheduler=scheduler,
                fresh=fresh,
                progress=tell,
            )
        except KeyboardInterrupt:
            bar.stop()
            # What was stored last may not have been told any more.
            stored = len(Store(folder).known(case.key for case in plan.cases))
            terminal.ERR.print(
                f"interrupted: {stored} of {seen.total} results are in {folder}; "
                "the same command goes on from there"
            )
            raise
    _print(results)
    report = campaigns.write_report(results, folder, worst=worst)
    for path in (report, folder / campaigns.JUNIT, folder / campaigns.RESULTS):
        terminal.OUT.print(f"written: {path}")
    if show:
        typer.launch(str(report))
    return int(not results.passed)


def _announce(at: Progress) -> None:
    if at.known:
        rest = at.total - at.known
        terminal.OUT.print(f"{at.known} of {at.total} results are there from before; {rest} to run")


def _words(plan: Campaign, at: Progress) -> str:
    failed = at.known + at.done - at.passed
    return f"{plan.name}: {at.known + at.done} of {at.total}, {failed} not passed"


def _print(results: Results) -> None:
    plan = results.campaign
    passed = sum(case.passed for case in results.cases)
    terminal.OUT.print(
        f"{plan.name}: {passed} of {len(results.cases)} cases pass; {results.violating} violate a clause, "
        f"{results.stopped} stopped"
    )
    _print_clauses(results)
    _print_failures(results)
    if not results.passed:
        terminal.OUT.print("worst:")
        for case, result in results.worst(_SHOWN):
            used = "stopped" if result.failure else f"{result.limit_used:.3g} times its limit"
            terminal.OUT.print(f"  {case.label}: {used}")


def _print_clauses(results: Results) -> None:
    table = terminal.table(["expectation"], ["limit", "median", "largest", "violated"])
    for clause in clauses(results):
        values = sorted(clause.finite().values())
        middle, largest = (
            (f"{v:.3g} {clause.unit}" for v in (median(values), values[-1])) if values else ("", "")
        )
        table.add_row(
            clause.expectation.text, clause.expectation.limit, middle, largest, str(len(clause.violated))
        )
    if table.row_count:
        terminal.OUT.print(table)


def _print_failures(results: Results) -> None:
    counted = Counter(case.failure for case in results.cases if case.failure)
    for failure, count in counted.most_common(_SHOWN):
        terminal.OUT.print(f"stopped, {count} {'case' if count == 1 else 'cases'}: {failure}")
    if len(counted) > _SHOWN:
        terminal.OUT.print(f"stopped for {len(counted) - _SHOWN} other reasons: see the report")
