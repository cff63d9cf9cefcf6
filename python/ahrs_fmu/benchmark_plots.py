"""Figures of the benchmark: a bar chart of the filters, and the error over time of every trial."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import style
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ahrs_fmu.benchmark import Outcome, Row
from ahrs_fmu.plots import PAGE_WIDTH, STYLE

_HEADING, _INCLINATION = "#D55E00", "#009E73"
_CURVES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_REST = "#D0D0D0"
WINDOW = 2.0
"""s, over which the curves are averaged."""
LEAST = 0.05
"""deg: smaller errors are not told apart by the optical system."""
_PARTS = ("total", "heading", "inclination")


def bar_chart(rows: Sequence[Row], title: str) -> Figure:
    """Draw the mean total, heading and inclination error of every filter.

    Parameters
    ----------
    rows : sequence of Row
        The filters, the best first.
    title : str
        Words above the bars.

    Returns
    -------
    Figure
        Bars of the total error with its parts; a number at the end of each.
    """
    with style.context(STYLE):
        figure = Figure(figsize=(PAGE_WIDTH, 0.35 * len(rows) + 1.0), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        place = np.arange(len(rows))
        totals = [row.total for row in rows]
        axes.barh(place, totals, height=0.7, color="#DDDDDD", label="total")
        axes.barh(place - 0.17, [row.heading for row in rows], height=0.22, color=_HEADING, label="heading")
        axes.barh(
            place + 0.17,
            [row.inclination for row in rows],
            height=0.22,
            color=_INCLINATION,
            label="inclination",
        )
        for k, total in enumerate(totals):
            axes.annotate(f"{total:.2f}", (total, k), xytext=(3, 0), textcoords="offset points", va="center")
        axes.set_yticks(place, [row.estimator for row in rows])
        axes.invert_yaxis()
        axes.set_xlabel("mean RMS error [deg]")
        figure.suptitle(title, fontsize=9.0, x=0.01, ha="left")
        axes.set_xlim(right=1.1 * max(totals))
        figure.legend(ncols=3, frameon=False, loc="upper right", borderaxespad=0.2)
    return figure


def trial_figure(outcomes: Sequence[Outcome]) -> Figure:
    """Draw the errors of several filters over the time of one trial.

    Parameters
    ----------
    outcomes : sequence of Outcome
        One per filter, of the same trial.

    Returns
    -------
    Figure
        Total, heading and inclination error below each other, as running RMS over `WINDOW`: the best filters
        in colours with their scores, the others in grey.
    """
    ranked = sorted(outcomes, key=lambda outcome: outcome.total)
    best, others = ranked[: len(_CURVES)], ranked[len(_CURVES) :]
    with style.context(STYLE):
        figure = Figure(figsize=(PAGE_WIDTH, 5.2), layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(len(_PARTS), 1, sharex=True)
        grey = [(o, _REST, 0.6, f"{len(others)} more" if o is others[0] else "_") for o in others]
        coloured = [
            (o, colour, 1.0, f"{o.job.label}, {o.total:.2f} deg")
            for o, colour in zip(best, _CURVES, strict=False)
        ]
        for outcome, colour, width, label in [*grey, *reversed(coloured)]:
            for panel, curve in zip(panels, _running_rms(outcome).T, strict=True):
                panel.plot(outcome.time, curve, color=colour, linewidth=width, label=label)
        for panel, part in zip(panels, _PARTS, strict=True):
            panel.set_ylabel(f"{part}\nerror [deg]")
            # Logarithmic: filters differ by factors.
            panel.set_yscale("log")
            panel.set_ylim(bottom=LEAST)
        panels[-1].set_xlabel("time [s]")
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(
            handles[::-1],
            names[::-1],
            loc="outside upper left",
            ncols=4,
            frameon=False,
            fontsize=7.5,
            title=f"{outcomes[0].job.trial.name}: score, and RMS over {WINDOW:g} s",
            title_fontsize=9.0,
            alignment="left",
        )
    return figure


def _running_rms(outcome: Outcome) -> NDArray[np.float64]:
    """RMS of the error curves over a moving window; NaN where the truth is unknown all through it."""
    width = max(1, round(WINDOW / (outcome.time[1] - outcome.time[0]))) if len(outcome.time) > 1 else 1
    known = np.isfinite(outcome.curves)
    squares = np.where(known, outcome.curves, 0.0) ** 2
    window = np.ones(min(width, len(squares)))
    sums, counts = (
        np.stack([np.convolve(column, window, mode="same") for column in x.T], axis=-1)
        for x in (squares, known.astype(np.float64))
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        rms: NDArray[np.float64] = np.sqrt(np.maximum(sums, 0.0) / np.where(counts > 0.5, counts, np.nan))
    return rms
