"""Figures of a run: attitudes, the signals that something is expected of, and the faults."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ahrs_fmu import quaternion, units
from ahrs_fmu.cosim.derived import AttitudeDifference, magnitude
from ahrs_fmu.cosim.expectations import LAST, MARGINS, Expectation, Verdict
from ahrs_fmu.cosim.recording import Recording
from ahrs_fmu.cosim.running import Outcome
from ahrs_fmu.cosim.scenario import Scenario
from ahrs_fmu.cosim.stepper import Array
from ahrs_fmu.plots import PAGE_WIDTH, STYLE, corner_note, save, thinned, unwrapped_gaps

_ANGLES = ("roll", "pitch", "yaw")
_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": "#AAAAAA", "linewidth": 2.6},
    {"color": "#0072B2", "linewidth": 0.9},
    {"color": "#D55E00", "linewidth": 0.8, "linestyle": "--"},
    {"color": "#009E73", "linewidth": 0.8, "linestyle": ":"},
)
"""Of the attitudes: what is true broad and pale, so that it stays visible under what is estimated."""
_SIGNAL, _BOUND, _FAULT = "#333333", "#D55E00", "#E69F66"
_ROW_HEIGHT = 1.05
_MOST_SIGNALS = 6
_NO_SIGN = 0.2
_DISPLAY = {"rad": "deg", "rad/s": "deg/s", "T": "uT"}


def run_figure(outcome: Outcome, title: str) -> Figure:
    """Draw a run.

    Parameters
    ----------
    outcome : Outcome
        Its recording must hold at least two rows.
    title : str
        Words above.

    Returns
    -------
    Figure
        At the width of a page (180 mm): Euler angles of all attitudes that are compared, then each signal
        with an expectation and its bound. The time of faults is shaded.
    """
    scenario, recording = outcome.case.scenario, outcome.recording
    attitudes = _attitudes(scenario)
    signals = _judged(scenario)
    rows = (len(_ANGLES) if attitudes else 0) + len(signals)
    with style.context(STYLE):
        figure = Figure(figsize=(PAGE_WIDTH, _ROW_HEIGHT * max(rows, 1) + 0.8), layout="constrained")
        FigureCanvasAgg(figure)
        panels = list(figure.subplots(max(rows, 1), 1, sharex=True, squeeze=False)[:, 0])
        if attitudes:
            _draw_attitudes(panels[:3], recording, attitudes)
        for panel, (signal, expectations) in zip(panels[rows - len(signals) :], signals, strict=True):
            _draw_signal(panel, outcome, signal, expectations)
            _annotate(panel, [v for v in outcome.verdicts if v.signal == signal])
        for panel in panels:
            _shade(panel, scenario, float(recording.time[-1]))
        panels[-1].set_xlabel("time [s]")
        panels[-1].set_xlim(0.0, float(recording.time[-1]))
        figure.align_ylabels(panels)
        figure.suptitle(title, fontsize=9.0, x=0.01, ha="left")
        handles, names = panels[0].get_legend_handles_labels()
        if handles:
            figure.legend(
                handles, names, loc="upper right", ncols=len(names), frameon=False, borderaxespad=0.2
            )
    return figure


def draw(outcome: Outcome, name: str, folder: Path) -> list[Path]:
    """Draw a run of the scenario `name` into a folder, as PNG and SVG; nothing of a run that never began."""
    if len(outcome.recording) < 2:
        return []
    stem = re.sub(r"[^\w.=-]+", "_", f"{name}-{outcome.case.label}")
    return save(run_figure(outcome, f"{name}, {outcome.case.label}"), folder / stem)


def _attitudes(scenario: Scenario) -> list[str]:
    """Quaternions that are compared: truths first."""
    compared = [d for d in scenario.signals.values() if isinstance(d, AttitudeDifference)]
    names = [d.truth for d in compared] + [d.estimate for d in compared]
    return list(dict.fromkeys(names))[: len(_LOOKS)]


def _judged(scenario: Scenario) -> list[tuple[str, list[Expectation]]]:
    """Signals with expectations, in the order of the file."""
    found: dict[str, list[Expectation]] = {}
    for expectation in scenario.expect:
        if expectation.measure not in MARGINS:
            found.setdefault(expectation.signal, []).append(expectation)
    return list(found.items())[:_MOST_SIGNALS]


def _draw_attitudes(panels: Sequence[Axes], recording: Recording, names: Sequence[str]) -> None:
    for name, look in zip(names, _LOOKS, strict=False):
        euler = np.degrees(quaternion.to_euler(recording[name]))
        for axis, panel in enumerate(panels):
            panel.plot(*thinned(recording.time, unwrapped_gaps(euler[:, axis])), label=name, **look)
    for panel, name in zip(panels, _ANGLES, strict=True):
        panel.set_ylabel(f"{name} [deg]")


def _draw_signal(panel: Axes, outcome: Outcome, signal: str, expectations: Sequence[Expectation]) -> None:
    recording = outcome.recording
    unit = recording.units.get(signal.partition("[")[0], "")
    shown = _DISPLAY.get(unit, unit)
    factor = units.factor(unit, shown)
    values = factor * magnitude(recording, signal)
    if unit in ("", "1") and (values == np.rint(values)).all():
        _draw_states(panel, recording.time, values, outcome.items.get(signal, {}))
    else:
        panel.plot(*thinned(recording.time, values), color=_SIGNAL)
    fault_end = outcome.case.scenario.fault_end
    for low, high, bound in _bounds(expectations, unit, fault_end, float(recording.time[-1])):
        # The size of a signal counts; of one that has no sign to speak of, one bound says all.
        both = values.min() < -_NO_SIGN * factor * bound
        for level in (factor * bound, -factor * bound) if both else (factor * bound,):
            panel.plot((low, high), (level, level), color=_BOUND, linewidth=0.8, linestyle="--")
    name = signal.replace("_", " ").replace(".", "\n")
    panel.set_ylabel(f"{name} [{shown}]" if shown not in ("", "1") else name)


def _draw_states(panel: Axes, time: Array, values: Array, items: Mapping[str, int]) -> None:
    """Draw whole numbers by their names; a line between them would mean nothing."""
    called = {value: name.replace("_", " ") for name, value in items.items()}
    seen = np.unique(values)
    if not items and set(seen) <= {0.0, 1.0}:
        seen, called = np.array([0.0, 1.0]), {0: "false", 1: "true"}
    if all(value in called for value in seen):
        # States that never occur take no room.
        values = np.searchsorted(seen, values).astype(np.float64)
        panel.set_yticks(range(len(seen)), [called[value] for value in seen])
    panel.plot(time, values, ".", markersize=1.5, color=_SIGNAL)


def _annotate(panel: Axes, verdicts: Sequence[Verdict]) -> None:
    words = [
        f"{v.clause.replace(f' of {v.signal}', '')}: {v.value} ({v.limit}){'' if v.passed else ' FAILS'}"
        for v in verdicts
    ]
    low, high = panel.get_ylim()
    # Room at the top keeps the words off the curve.
    panel.set_ylim(low, high + 0.25 * len(words) * (high - low))
    corner_note(panel, "\n".join(words))


def _bounds(
    expectations: Sequence[Expectation], unit: str, fault_end: float, end: float
) -> Iterator[tuple[float, float, float]]:
    """Where a bound begins and ends, and at what height it is, for those that are a size of the signal."""
    for expectation in expectations:
        start, stop = expectation.from_, min(expectation.until, end)
        bounds = [expectation.band if expectation.band is not None else expectation.above]
        if expectation.measure in ("max", "p95", "final"):
            bounds = [expectation.at_most, expectation.at_least]
        if expectation.measure == "final":
            start = stop - LAST * (stop - start)
        elif expectation.measure == "recovery":
            start = max(start, fault_end)
        for bound in bounds:
            if bound is not None:
                yield start, stop, units.quantity(bound, unit)


def _shade(panel: Axes, scenario: Scenario, end: float) -> None:
    for fault in scenario.faults.values():
        if fault.severity > 0.0 and fault.start < end:
            # Where two faults overlap it is darker.
            panel.axvspan(fault.start, min(fault.end, end), color=_FAULT, alpha=0.3, linewidth=0, zorder=0)
