"""Figures of the benchmark: a bar chart of the filters, and the error over time of every trial."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import style
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ahrs_fmu.benchmark import Outcome, Row
from ahrs_fmu.plots import PAGE_WIDTH, STYLE

_HEADING, _INCLINATION = "#D55E00", "#009E73"
_CURVES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#333333")
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
        Total, heading and inclination error below each other.
    """
    with style.context(STYLE):
        figure = Figure(figsize=(PAGE_WIDTH, 4.6), layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(len(_PARTS), 1, sharex=True)
        for k, outcome in enumerate(outcomes):
            for panel, column in zip(panels, outcome.curves.T, strict=True):
                colour = _CURVES[k % len(_CURVES)]
                panel.plot(outcome.time, column, color=colour, linewidth=0.7, label=outcome.job.label)
        for panel, part in zip(panels, _PARTS, strict=True):
            panel.set_ylabel(f"{part}\nerror [deg]")
            # Logarithmic: filters differ by factors.
            panel.set_yscale("log")
            panel.set_ylim(bottom=LEAST)
        panels[-1].set_xlabel("time [s]")
        figure.suptitle(outcomes[0].job.trial.name, fontsize=9.0, x=0.01, ha="left")
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="upper right", ncols=4, frameon=False, borderaxespad=0.2)
    return figure
