"""Results as JUnit XML, which continuous integration reads: a suite per scenario, a test per case."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from ahrs_fmu.campaign.plan import PlannedCase
from ahrs_fmu.campaign.results import CaseResult, Results

# What XML 1.0 has no way to write.
_UNWRITABLE = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_junit(results: Results, path: Path) -> None:
    """Write the results; a violated clause is a failure, a component that failed an error."""
    campaign = results.campaign
    root = ElementTree.Element("testsuites", _counts(results.cases), name=campaign.name)
    both = list(zip(campaign.cases, results.cases, strict=True))
    for index, file in enumerate(campaign.scenarios):
        own = [(case, result) for case, result in both if case.file == index]
        suite = ElementTree.SubElement(root, "testsuite", _counts([r for _, r in own]), name=file.name)
        for case, result in own:
            _add(suite, f"{campaign.name}.{file.name}", case, result)
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _counts(cases: Sequence[CaseResult]) -> dict[str, str]:
    stopped = sum(bool(case.failure) for case in cases)
    return {
        "tests": str(len(cases)),
        "failures": str(sum(not case.passed for case in cases) - stopped),
        "errors": str(stopped),
        "skipped": "0",
        "time": f"{sum(case.runtime for case in cases):.3f}",
    }


def _add(suite: ElementTree.Element, group: str, case: PlannedCase, result: CaseResult) -> None:
    test = ElementTree.SubElement(
        suite, "testcase", classname=group, name=_written(case.label), time=f"{result.runtime:.3f}"
    )
    if result.failure:
        ElementTree.SubElement(test, "error", message=_written(result.failure), type="stopped")
    elif not result.passed:
        broken = [line for line, holds in result.told() if not holds]
        told = ElementTree.SubElement(test, "failure", message=_written("; ".join(broken)), type="violated")
        told.text = _written("\n".join(line for line, _ in result.told()))


def _written(text: str) -> str:
    return _UNWRITABLE.sub("\N{REPLACEMENT CHARACTER}", text)
