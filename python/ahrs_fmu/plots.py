"""Figures of a replayed recording.

They are built with matplotlib's object interface, so that they need no display and leave no state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from ahrs_fmu import quaternion
from ahrs_fmu.errors import RecordError
from ahrs_fmu.metrics import AttitudeError, attitude_error
from ahrs_fmu.records import Record

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Blue, vermilion and bluish green of Okabe and Ito are told apart with any kind of colour vision.
_ESTIMATE = "#0072B2"
_TRUTH = "#AAAAAA"
_SHADE = "#F3EFE0"
_ERRORS = (("total", "#333333"), ("heading", "#D55E00"), ("inclination", "#009E73"))
_ANGLES = ("roll", "pitch", "yaw")
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
"""Of estimates that are compared."""
# A broad pale line below a thin strong one: both stay visible where they agree.
_TRUE_LINE: Mapping[str, Any] = {"color": _TRUTH, "linewidth": 2.6, "label": "truth"}

PAGE_WIDTH = 7.1
_ROW_HEIGHT = 1.15
_DPI = 200
_BINS = 2000
"""Each line is drawn with two points per bin: finer than a printed page resolves."""
STYLE = {
    "font.size": 8.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 0.9,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "svg.hashsalt": "ahrs-fmu",
}
"""Look of every figure."""


def replay_figure(record: Record, q: FloatArray, label: str) -> Figure:
    """Draw roll, pitch and yaw of an estimate, with the truth and the error when it is known.

    Parameters
    ----------
    record : Record
        What was replayed.
    q : ndarray, shape (N, 4)
        Estimated attitude in the frame of the record.
    label : str
        Name of the estimate in the legend.

    Returns
    -------
    Figure
        At the width of a page (180 mm); the samples that count in the metric are shaded.
    """
    error = None if record.q_true is None else attitude_error(q, record.q_true)
    rows = len(_ANGLES) + (0 if error is None else len(_ERRORS))
    with style.context(STYLE):
        figure = Figure(figsize=(PAGE_WIDTH, _ROW_HEIGHT * rows + 0.7), layout="constrained")
        FigureCanvasAgg(figure)
        panels = list(figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0])
        _draw_angles(panels[:3], record, q, label)
        if error is not None:
            _draw_errors(panels[3:], record, error)
        for panel in panels:
            _shade(panel, record)
        panels[-1].set_xlabel("time [s]")
        panels[-1].set_xlim(0.0, record.duration)
        figure.align_ylabels(panels)
        figure.suptitle(record.name, fontsize=9.0, x=0.01, ha="left")
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="upper right", ncols=len(names), frameon=False, borderaxespad=0.2)
    return figure


def comparison_figure(record: Record, estimates: Mapping[str, FloatArray], title: str) -> Figure:
    """Draw the angles of several estimates over the truth, and their errors.

    Parameters
    ----------
    record : Record
        With a true attitude.
    estimates : mapping of str to ndarray, shape (N, 4)
        Attitudes by what to call them, in the frame of the record.
    title : str

    Returns
    -------
    Figure
        Roll, pitch and yaw on the left, their errors on the right, in degrees over seconds; the samples that
        count in the metric are shaded.

    Raises
    ------
    RecordError
        If the record has no true attitude.
    """
    if record.q_true is None:
        raise RecordError(f"{record.name} has no true attitude: there is no error to draw")
    time = record.time - record.time[0]
    truth = np.degrees(quaternion.to_euler(record.q_true))
    angles = {label: np.degrees(quaternion.to_euler(q)) for label, q in estimates.items()}
    errors = {label: np.degrees(attitude_error(q, record.q_true).euler) for label, q in estimates.items()}
    with style.context(STYLE):
        layout = ConstrainedLayoutEngine(wspace=0.06)
        figure = Figure(figsize=(PAGE_WIDTH, 4.4 * _ROW_HEIGHT), layout=layout)
        FigureCanvasAgg(figure)
        panels = figure.subplots(len(_ANGLES), 2, sharex=True)
        for axis, name in enumerate(_ANGLES):
            left, right = panels[axis]
            left.plot(*thinned(time, unwrapped_gaps(truth[:, axis])), **_TRUE_LINE)
            left.set_ylabel(f"{name} [deg]")
            right.set_ylabel(f"error of {name} [deg]")
            right.axhline(0.0, color=_TRUTH, linewidth=0.6, zorder=0)
            for label, colour in zip(estimates, _COLOURS, strict=False):
                line = {"color": colour, "linewidth": 0.8, "label": label}
                left.plot(*thinned(time, unwrapped_gaps(angles[label][:, axis])), **line)
                right.plot(*thinned(time, errors[label][:, axis]), **line)
            _shade(left, record)
            _shade(right, record)
        for panel in panels[-1]:
            panel.set_xlabel("time [s]")
            panel.set_xlim(0.0, record.duration)
        figure.align_ylabels()
        figure.suptitle(title, fontsize=9.0, x=0.01, ha="left")
        handles, names = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside lower center", ncols=len(names), frameon=False)
    return figure


def save(figure: Figure, stem: Path) -> list[Path]:
    """Write a figure as PNG and as SVG.

    Parameters
    ----------
    figure : Figure
        What to write.
    stem : Path
        Path without extension; missing folders are made.

    Returns
    -------
    list of Path
        The two files; the same figure gives the same bytes.
    """
    stem.parent.mkdir(parents=True, exist_ok=True)
    png, svg = (stem.with_name(f"{stem.name}.{extension}") for extension in ("png", "svg"))
    with style.context(STYLE):
        figure.savefig(png, dpi=_DPI, metadata={"Software": None})
        figure.savefig(svg, metadata={"Date": None, "Creator": None})
    return [png, svg]


def corner_note(panel: Axes, text: str) -> None:
    """Write words into the upper right corner of a panel."""
    panel.annotate(
        text,
        (1.0, 1.0),
        xycoords="axes fraction",
        xytext=(-3, -2),
        textcoords="offset points",
        ha="right",
        va="top",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5},
    )


def _draw_angles(panels: Sequence[Axes], record: Record, q: FloatArray, label: str) -> None:
    time = record.time - record.time[0]
    estimate = np.degrees(quaternion.to_euler(q))
    truth = None if record.q_true is None else np.degrees(quaternion.to_euler(record.q_true))
    for axis, (panel, name) in enumerate(zip(panels, _ANGLES, strict=True)):
        if truth is not None:
            panel.plot(*thinned(time, unwrapped_gaps(truth[:, axis])), **_TRUE_LINE)
        panel.plot(*thinned(time, unwrapped_gaps(estimate[:, axis])), color=_ESTIMATE, label=label)
        panel.set_ylabel(f"{name} [deg]")
        drawn = estimate[:, axis] if truth is None else np.concatenate((estimate[:, axis], truth[:, axis]))
        end = 90.0 if name == "pitch" else 180.0
        if np.nanmax(np.abs(drawn)) > 0.7 * end:
            panel.set_yticks(np.linspace(-end, end, 5))
            panel.set_ylim(-1.06 * end, 1.06 * end)


def _draw_errors(panels: Sequence[Axes], record: Record, error: AttitudeError) -> None:
    rms = error.rms(record.evaluate).degrees()
    for panel, (name, colour) in zip(panels, _ERRORS, strict=True):
        values = np.degrees(getattr(error, name))
        panel.plot(*thinned(record.time - record.time[0], values), color=colour)
        panel.set_ylabel(f"{name}\nerror [deg]")
        # Room at the top keeps the number off the curve.
        panel.set_ylim(0.0, max(1.25 * float(np.nanmax(values)), 1e-3))
        corner_note(panel, f"RMS {rms[name]:.2f}°")


def _shade(panel: Axes, record: Record) -> None:
    if record.evaluate is None or record.evaluate.all():
        return
    edges = np.flatnonzero(np.diff(record.evaluate.astype(int), prepend=0, append=0))
    time = np.append(record.time, record.time[-1]) - record.time[0]
    for start, stop in edges.reshape(-1, 2):
        panel.axvspan(
            time[start],
            time[stop],
            color=_SHADE,
            linewidth=0,
            zorder=0,
            label="counts in RMS" if start == edges[0] else None,
        )


def unwrapped_gaps(angle: FloatArray) -> FloatArray:
    """Lift the pen where an angle in degrees jumps from one end of its range to the other."""
    lifted = angle.copy()
    lifted[1:][np.abs(np.diff(angle)) > 180.0] = np.nan
    return lifted


def thinned(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Keep the smallest and the largest value of each bin, so that thinning hides no peak."""
    width = time.size // _BINS
    if width < 3:
        return time, values
    whole = time.size // width * width
    bins = values[:whole].reshape(-1, width)
    picks = np.sort(np.stack((bins.argmin(axis=1), bins.argmax(axis=1)), axis=1), axis=1)
    rows = (np.arange(0, whole, width)[:, None] + picks).ravel()
    return time[rows], values[rows]
