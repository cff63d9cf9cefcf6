"""Tables of the published experiments: cells for every medium, Markdown and CSV files."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import scenarios, single_precision
from ahrs_fmu.experiments import MEANING, Outcome
from ahrs_fmu.published import Comparison, Figure
from ahrs_fmu.single_precision import Trial

Row = Sequence[object]

_TRIAL_HEADINGS = ("form", "alpha", "kappa", "other", "fails at", "RMS [deg]", "in double [deg]", "expected")
_COMPARED = ("roll", "pitch", "yaw")


def angles(values: NDArray[np.float64]) -> str:
    """Angles in radians as degrees, side by side."""
    return " ".join(f"{value:.2f}" for value in np.degrees(values))


def quantity(figure: Figure) -> str:
    """What a printed figure is of."""
    names = {"rms": "RMS", "largest": "largest", "last": "last"}
    axes = "all" if len(figure.axes) == len(_COMPARED) else ", ".join(figure.axes)
    return f"{names[figure.quantity]} {axes}"


def printed(figure: Figure) -> str:
    """The printed figure itself."""
    values = " ".join(f"{value:.2f}" for value in figure.printed)
    return f"at most {figure.printed[0]:g}" if figure.at_most else values


def trial_cells(trial: Trial) -> list[str]:
    """One row of the table on single precision."""
    w = trial.weighting
    other = [] if w.unit == "uT" else ["nT"]
    other += [] if w.symmetrised else ["unsymmetric"]
    other += [f"first std {w.attitude_std:g}"] if w.attitude_std >= 1.0 else []
    numbers = (trial.rms, trial.rms_double)
    return [
        *(trial.form, f"{w.alpha:g}", f"{w.kappa:g}", ", ".join(other)),
        "never" if trial.failed is None else str(trial.failed),
        *("" if np.isnan(x) else f"{np.degrees(x):.3f}" for x in numbers),
        "yes" if trial.as_expected else "no",
    ]


def write(
    folder: Path, outcomes: Sequence[Outcome], comparisons: Sequence[Comparison], trials: Sequence[Trial]
) -> list[Path]:
    """Write all tables as Markdown and each as CSV; return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    tables: dict[str, list[Row]] = {
        "computed.csv": [_COMPUTED_HEADINGS, *map(_computed_row, outcomes)],
        "printed.csv": [_PRINTED_HEADINGS, *(row for c in comparisons for row in _printed_rows(c))],
    }
    if trials:
        tables["single_precision.csv"] = [_TRIAL_HEADINGS, *map(trial_cells, trials)]
    for name, rows in tables.items():
        with (folder / name).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)
    markdown = folder / "reproduce.md"
    markdown.write_text("\n".join(_markdown(outcomes, comparisons, trials)), encoding="utf-8")
    return [markdown, *(folder / name for name in tables)]


_COMPUTED_HEADINGS = (
    *("scenario", "setting", *(f"{axis} [deg]" for axis in _COMPARED)),
    *(f"expected {axis} [deg]" for axis in _COMPARED),
    *("covariance resets", "verdict", "meaning"),
)
_PRINTED_HEADINGS = (
    "scenario",
    "setting",
    "quantity",
    "angle",
    "printed [deg]",
    "here [deg]",
    "verdict",
    "note",
)


def _computed_row(outcome: Outcome) -> Row:
    expected = ("",) * 3 if outcome.expected is None else _rounded(outcome.expected)
    verdict = outcome.verdict
    cells = (*_rounded(outcome.mean), *expected, outcome.resets, verdict, MEANING[verdict])
    return (outcome.scenario, outcome.setting, *cells)


def _printed_rows(c: Comparison) -> Iterable[Row]:
    for axis, value, here in zip(c.figure.axes, c.figure.printed, _rounded(c.here), strict=True):
        shown = f"at most {value:g}" if c.figure.at_most else f"{value:g}"
        yield (c.scenario, c.figure.setting, c.figure.quantity, axis, shown, here, c.verdict, c.figure.note)


def _rounded(values: NDArray[np.float64]) -> list[str]:
    return [f"{value:.3f}" for value in np.degrees(values)]


def _markdown(
    outcomes: Sequence[Outcome], comparisons: Sequence[Comparison], trials: Sequence[Trial]
) -> list[str]:
    lines = ["# The published experiments", ""]
    lines += ["RMS errors of roll, pitch and yaw in degrees, mean over the seeds."]
    lines += ["Expected is what an independent computation found.", ""]
    names = [*(o.scenario for o in outcomes), *(c.scenario for c in comparisons)]
    for name in [known for known in scenarios.names() if known in names]:
        lines += [f"## {name}", "", f"{scenarios.describe(name).description}.", ""]
        rows = [_computed_cells(o) for o in outcomes if o.scenario == name]
        lines += _table(("setting", "here", "expected", "covariance resets", "verdict"), rows)
        beside = [
            (
                c.figure.setting,
                quantity(c.figure),
                printed(c.figure),
                angles(c.here),
                c.verdict,
                c.figure.note,
            )
            for c in comparisons
            if c.scenario == name
        ]
        lines += _table(("the source prints", "of", "printed", "here", "verdict", "why"), beside)
    if trials:
        lines += [f"## Unscented filters in single precision, {single_precision.SCENARIO}", ""]
        lines += _table(_TRIAL_HEADINGS, [trial_cells(trial) for trial in trials])
    return lines


def _computed_cells(o: Outcome) -> Row:
    expected = "fails" if o.expected is None else angles(o.expected)
    return (o.setting, angles(o.mean), expected, o.resets, f"{o.verdict}: {MEANING[o.verdict]}")


def _table(headings: Sequence[str], rows: Sequence[Row]) -> list[str]:
    if not rows:
        return []
    cells = [headings, ["---"] * len(headings), *rows]
    return [*(f"| {' | '.join(map(str, row))} |" for row in cells), ""]
