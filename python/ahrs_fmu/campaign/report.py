"""Report of a campaign: one HTML file that needs nothing else, and JUnit XML.

What is chosen in the page is drawn by report.js with plotly; library and data are in the file, compressed.
"""

from __future__ import annotations

import base64
import datetime
import gzip
import html
import json
import math
import platform
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

from ahrs_fmu.campaign import requirements
from ahrs_fmu.campaign.axes import flat, level_in_words
from ahrs_fmu.campaign.clauses import Clause, clauses
from ahrs_fmu.campaign.junit import write_junit
from ahrs_fmu.campaign.plan import SCENARIO, SEED, Campaign
from ahrs_fmu.campaign.results import CaseResult, Results
from ahrs_fmu.campaign.worst import WorstCase, run_again
from ahrs_fmu.cosim.scenario import changes_in_words
from ahrs_fmu.version import __version__

REPORT = "report.html"
JUNIT = "junit.xml"

_PASSES, _VIOLATES, _STOPPED = range(3)
_MISSING = "none"
_DIGITS = 6
_SHARE = 100.0


def write_report(results: Results, folder: str | Path, *, worst: int = 6) -> Path:
    """Write ``report.html`` and ``junit.xml``.

    Parameters
    ----------
    results : Results
    folder : path
        Made if it is not there.
    worst : int
        How many of the worst cases are run again and drawn.

    Returns
    -------
    Path
        The HTML file.

    Raises
    ------
    MissingExtraError
        If plotly is not installed.
    """
    # First what may be missing.
    library = requirements.require("plotly.offline").get_plotlyjs()
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_junit(results, folder / JUNIT)
    path = folder / REPORT
    path.write_text(_page(results, library, run_again(results, worst)), encoding="utf-8")
    return path


def _page(results: Results, library: str, worst: Sequence[WorstCase]) -> str:
    campaign = results.campaign
    text = html.escape
    return Template(_resource("report.html")).substitute(
        name=text(campaign.name),
        description=text(campaign.description),
        verdict="pass" if results.passed else "fail",
        state="pass" if results.passed else "violate",
        style=_resource("report.css"),
        tiles="".join(_tiles(results)),
        worst="".join(map(_worst, worst)) or '<p class="note">None was drawn.</p>',
        hide_failures="" if results.stopped else " hidden",
        failures="".join(_failures(results)),
        axes="".join(_axes(campaign)),
        file=text(campaign.text),
        scenarios="".join(_scenarios(campaign)),
        footer=text(
            f"Written {datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M} UTC by ahrs-fmu {__version__}, "
            f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"
        ),
        data=_packed(json.dumps(_data(results), separators=(",", ":"), allow_nan=False)),
        plotly=_packed(library),
        script=_resource("report.js"),
    )


def _data(results: Results) -> dict[str, Any]:
    """Everything that the page draws, as columns with an entry per case."""
    cases = results.cases
    failures = list(dict.fromkeys(case.failure for case in cases if case.failure))
    return {
        "name": results.campaign.name,
        "axes": list(_columns_of_axes(results.campaign)),
        "label": [case.label for case in results.campaign.cases],
        "state": [_state(case) for case in cases],
        "used": [_number(case.limit_used) for case in cases],
        "failures": failures,
        "failure": [failures.index(case.failure) if case.failure else -1 for case in cases],
        "clauses": [_clause(clause, len(cases)) for clause in clauses(results)],
    }


def _columns_of_axes(campaign: Campaign) -> Iterator[dict[str, Any]]:
    names = dict.fromkeys(name for case in campaign.cases for name in case.levels)
    titles = titles_of(names)
    for name in names:
        at = [case.levels.get(name) for case in campaign.cases]
        if name in campaign.ranges:
            bounds = campaign.ranges[name]
            ends = [bounds.from_, bounds.to]
            numbers = [_number(value) for value in at]
            yield {"title": titles[name], "range": ends, "log": bounds.log, "at": numbers}
        else:
            yield _levels(titles[name], [level_in_words(value) or _MISSING for value in at])
    yield _levels(SEED, [str(case.seed) for case in campaign.cases])


def _levels(title: str, at: Sequence[str]) -> dict[str, Any]:
    place = {level: k for k, level in enumerate(dict.fromkeys(at))}
    return {"title": title, "levels": list(place), "at": [place[level] for level in at]}


def titles_of(names: Iterable[str]) -> dict[str, str]:
    """Short names of axes: the last part of a dotted name, where that is enough."""
    shown = changes_in_words(dict.fromkeys(names, 0))
    return {name: words.removesuffix("=0") for name, words in zip(names, shown, strict=True)}


def _clause(clause: Clause, count: int) -> dict[str, Any]:
    finite = clause.finite()
    return {
        "text": clause.expectation.text,
        "limit": clause.expectation.limit,
        "unit": clause.unit,
        "bounds": [_number(bound) for bound in clause.bounds],
        "measured": [_number(finite.get(at)) for at in range(count)],
        "violated": sorted(clause.violated),
    }


def _number(value: object) -> float | None:
    """Number with as many digits as a page needs; nothing where there is none."""
    if not isinstance(value, float | int) or not math.isfinite(value):
        return None
    return float(f"{value:.{_DIGITS}g}")


def _state(case: CaseResult) -> int:
    return _STOPPED if case.failure else _PASSES if case.passed else _VIOLATES


def _tiles(results: Results) -> Iterator[str]:
    count = len(results.cases)
    passed = sum(case.passed for case in results.cases)
    tiles = [
        ("", f"{count:,}", "cases"),
        ("pass", f"{passed:,}", f"pass, {_SHARE * passed / count:.3g} %"),
        ("violate" if results.violating else "", f"{results.violating:,}", "violate a clause"),
        ("stop" if results.stopped else "", f"{results.stopped:,}", "stopped"),
        ("", _duration(sum(case.runtime for case in results.cases)), "run time of all cases"),
    ]
    for kind, number, words in tiles:
        yield f'<div class="{kind}"><b>{number}</b><span>{words}</span></div>'


def _duration(seconds: float) -> str:
    for size, unit in ((3600.0, "h"), (60.0, "min")):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


def _worst(worst: WorstCase) -> str:
    text = html.escape
    result = worst.result
    words = "stopped" if result.failure else f"{result.limit_used:.3g} times its limit"
    told = [(result.failure, False)] if result.failure else result.told()
    state = _state(result)
    return "".join(
        (
            "<details open>" if worst.rank == 1 else "<details>",
            f'<summary>{text(worst.case.label)} <span class="mark s{state}">{text(words)}</span></summary>',
            *(f'<p class="note{"" if holds else " over"}">{text(line)}</p>' for line, holds in told),
            f"<pre>{text(worst.command)}</pre>" if worst.command else "",
            f'<img alt="{text(worst.case.label)}" src="data:image/png;base64,{_base64(worst.picture)}">'
            if worst.picture
            else "",
            "</details>",
        )
    )


def _failures(results: Results) -> Iterator[str]:
    counted = Counter(case.failure for case in results.cases if case.failure)
    example = {r.failure: c.label for c, r in zip(results.campaign.cases, results.cases, strict=True)}
    for failure, count in counted.most_common():
        cells = (html.escape(failure), html.escape(example[failure]))
        yield f'<tr><td>{cells[0]}</td><td class="n">{count}</td><td>{cells[1]}</td></tr>'


def _axes(campaign: Campaign) -> Iterator[str]:
    if len(campaign.scenarios) > 1:
        yield _axis(SCENARIO, ", ".join(file.name for file in campaign.scenarios))
    named = {axis.name for axis in campaign.axes} | set(campaign.ranges)
    for axis in campaign.axes:
        yield _axis(axis.name, ", ".join(map(level_in_words, axis.levels)))
    for name, bounds in campaign.ranges.items():
        way = "logarithmically" if bounds.log else "evenly"
        yield _axis(name, f"{bounds.from_:g} to {bounds.to:g}, {way}, Latin hypercube")
    for file in campaign.scenarios:
        for name, values in file.vary.items():
            if name not in named:
                yield _axis(name, ", ".join(map(level_in_words, values)))
    seeds = list(dict.fromkeys(case.seed for case in campaign.cases))
    whole = len(seeds) > 2 and seeds == list(range(seeds[0], seeds[-1] + 1))
    yield _axis(SEED, f"{seeds[0]} to {seeds[-1]}" if whole else ", ".join(map(str, seeds)))


def _axis(name: str, values: str) -> str:
    return f"<tr><td><code>{html.escape(name)}</code></td><td>{html.escape(values)}</td></tr>"


def _scenarios(campaign: Campaign) -> Iterator[str]:
    for file in campaign.scenarios:
        lines = (f"{name} = {json.dumps(value, default=str)}" for name, value in flat(_named(file.table)))
        yield (
            f"<details><summary>Scenario {html.escape(file.name)}, with its template</summary>"
            f"<pre>{html.escape(chr(10).join(lines))}</pre></details>"
        )


def _named(table: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of a scenario, those with something in them."""
    return {name: value for name, value in table.items() if value not in ([], "")}


def _packed(text: str) -> str:
    # Without a time inside, the same text is the same bytes.
    return _base64(gzip.compress(text.encode(), mtime=0))


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _resource(name: str) -> str:
    return resources.files("ahrs_fmu.campaign").joinpath(name).read_text(encoding="utf-8")
