"""Figures of the frequency domain, at the width of a printed page.

Theory is drawn as lines, measurement as points with error bars. The colours are told apart with any kind
of colour vision, and every curve also differs by its line or marker. `ahrs_fmu.plots.save` writes a figure
as PNG and SVG.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from control import StateSpace
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.allan import AllanDeviation, AllanFit
from ahrs_fmu.analysis.design import ErrorCurve
from ahrs_fmu.analysis.equivalent import Equivalent
from ahrs_fmu.analysis.in_loop import InLoop
from ahrs_fmu.analysis.measure import FrequencyResponse, deviation
from ahrs_fmu.analysis.systems import Array, ComplexArray, zeros
from ahrs_fmu.analysis.theory import ComplementaryFilter, Responding, settling_time, step_error
from ahrs_fmu.cosim.loop_gain import LoopGain
from ahrs_fmu.plots import PAGE_WIDTH, STYLE

BLUE, VERMILION, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#666666"
_PALE = "#9A9A9A"
_GRID = "#E4E4E4"
_BACKGROUND = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0}
_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, GREY)
_DASHES = ("-", (0, (5, 1.5)), (0, (2, 1.2)), (0, (5, 1.5, 1, 1.5)), (0, (8, 2)))
_INPUTS = ("angle", "gyro")
_MARKERS = ("o", "s", "^", "D", "v")


def bode_figure(
    filter_: Responding,
    measured: Sequence[FrequencyResponse] = (),
    title: str = "",
    limits: tuple[float, float] | None = None,
) -> Figure:
    """Draw G_A, G_B and their sum, with measured points and their deviation when there are any.

    Parameters
    ----------
    filter_ : ComplementaryFilter or Equivalent
        The theory.
    measured : sequence of FrequencyResponse, optional
        Responses of the same filter.
    title : str, optional
        Heading.
    limits : tuple of float, optional
        Range of the frequency axis, rad/s; by default that of the measurement, or about the crossover.
    """
    wc = filter_.crossover
    low, high = limits or _frequency_range(filter_, measured)
    omega = np.geomspace(low, high, 600)
    theory = filter_.respond(omega)
    panels = _panels([2.4, 1.6, 0.9, 0.9] if measured else [2.4, 1.6])
    magnitude, phase = panels.axes[:2]
    with style.context(STYLE):
        for path, (name, colour, dashes) in enumerate(
            (("G_A", BLUE, "-"), ("G_B", VERMILION, (0, (6, 1.5))))
        ):
            label = f"${name}$ {_INPUTS[path]}"
            magnitude.semilogx(omega, _decibels(theory[path]), color=colour, linestyle=dashes, label=label)
            phase.semilogx(omega, _phase(theory[path], path), color=colour, linestyle=dashes)
        magnitude.semilogx(
            omega, _decibels(theory[0] + theory[1]), color=GREY, linestyle=(0, (1, 1.2)), label="$G_A + G_B$"
        )
        _asymptotes(magnitude, filter_, omega)
        for response in measured:
            _points(magnitude, phase, response, filter_)
        if measured:
            _deviations(panels.axes[2], panels.axes[3], filter_, measured)
        _mark_crossover(panels.axes[:2], magnitude, wc)
        magnitude.set_ylabel("magnitude [dB]")
        magnitude.set_ylim(max(-70.0, float(np.min(_decibels(np.array(theory)))) - 3.0), 8.0)
        phase.set_ylabel("phase [deg]")
        magnitude.yaxis.set_major_locator(MultipleLocator(10.0))
        phase.yaxis.set_major_locator(MultipleLocator(45.0))
        panels.finish("frequency [rad/s]", title, (low, high), columns=3)
    return panels.figure


def step_figure(filters: Mapping[str, ComplementaryFilter], duration: float | None = None) -> Figure:
    """Draw how an initial attitude error dies out, for filters by their names."""
    duration = duration or 1.3 * max(settling_time(f) for f in filters.values())
    panels = _panels([2.6])
    (panel,) = panels.axes
    with style.context(STYLE):
        panel.axhspan(-2.0, 2.0, color="#F3EFE0", linewidth=0, label="± 2 %")
        for (name, filter_), colour, dashes in zip(filters.items(), _COLOURS, _DASHES, strict=False):
            times, error = step_error(filter_, duration)
            panel.plot(times, 100.0 * error, color=colour, linestyle=dashes, label=name)
        panel.set_ylabel("error left [%]")
        panels.finish("time [s]", "", (0.0, duration), columns=5)
    return panels.figure


def pole_zero_figure(filter_: ComplementaryFilter) -> Figure:
    """Draw poles and zeros of G_A: in the s plane, or in the z plane with a view of the region about 1."""
    with style.context(STYLE):
        sampled = filter_.sample_time is not None
        figure = Figure(figsize=(PAGE_WIDTH, 3.3), layout="constrained")
        FigureCanvasAgg(figure)
        panels = list(figure.subplots(1, 2 if sampled else 1, squeeze=False)[0])
        found, where = filter_.poles, zeros(filter_.g_a)
        if sampled:
            reach = 1.35 * float(
                np.max(np.abs(np.concatenate((found, where[np.abs(where - 1.0) < 0.5])) - 1.0))
            )
            circle = np.exp(1j * np.linspace(0.0, 2.0 * math.pi, 2001))
            for panel in panels:
                panel.plot(circle.real, circle.imag, color=_PALE, linewidth=0.8)
            panels[0].set(xlim=(-1.15, 1.15), ylim=(-1.15, 1.15), title="z plane")
            panels[1].set(
                xlim=(1.0 - 1.6 * reach, 1.0 + 0.4 * reach), ylim=(-reach, reach), title="about z = 1"
            )
        else:
            reach = 1.3 * float(np.max(np.abs(np.concatenate((found, where)))))
            panels[0].set(xlim=(-1.6 * reach, 0.4 * reach), ylim=(-reach, reach), title="s plane")
        for panel in panels:
            panel.axhline(0.0, color=_GRID, linewidth=0.5, zorder=0)
            panel.axvline(1.0 if sampled else 0.0, color=_GRID, linewidth=0.5, zorder=0)
            panel.plot(
                found.real, found.imag, linestyle="none", marker="x", color=BLUE, markersize=6, label="poles"
            )
            panel.plot(
                where.real,
                where.imag,
                linestyle="none",
                marker="o",
                color=VERMILION,
                markersize=5,
                markerfacecolor="none",
                label="zeros of $G_A$",
            )
            panel.set_aspect("equal")
            panel.set_xlabel("real part" if sampled else "real part [1/s]")
            panel.xaxis.set_major_locator(MaxNLocator(5))
        panels[0].set_ylabel("imaginary part" if sampled else "imaginary part [1/s]")
        panels[-1].legend(frameon=False, loc="upper left")
    return figure


def error_figure(
    curve: ErrorCurve,
    simulated: tuple[Array, Array, Array] | None = None,
    chosen: float | None = None,
) -> Figure:
    """Draw the predicted RMS error against the crossover, by source, with the optimum.

    Parameters
    ----------
    curve : ErrorCurve
    simulated : tuple of arrays (M,), optional
        Crossovers (rad/s), RMS errors (rad) and their standard errors (rad) of a Monte Carlo run.
    chosen : float, optional
        The crossover that is used, rad/s.
    """
    panels = _panels([3.0])
    (panel,) = panels.axes
    sources = (
        ("gyro noise", curve.gyro),
        ("bias walk", curve.bias_walk),
        ("angle noise", curve.angle),
        ("motion", curve.motion),
    )
    with style.context(STYLE):
        for (name, values), colour, dashes in zip(
            sources, (VERMILION, PURPLE, BLUE, GREEN), _DASHES[1:], strict=True
        ):
            if np.any(values > 0.0):
                panel.loglog(curve.crossover, np.degrees(values), color=colour, linestyle=dashes, label=name)
        panel.loglog(curve.crossover, np.degrees(curve.total), color="#222222", linewidth=1.6, label="total")
        least = math.degrees(float(np.interp(curve.best, curve.crossover, curve.total)))
        panel.plot(
            curve.best, least, marker="*", color="#222222", markersize=9, linestyle="none", label="optimum"
        )
        panel.annotate(
            f"{curve.best:.3g} rad/s, {least:.3g}°",
            (curve.best, least),
            xytext=(0, 12),
            bbox=_BACKGROUND,
            textcoords="offset points",
            ha="center",
        )
        if chosen is not None:
            panel.axvline(chosen, color=GREY, linewidth=0.8, linestyle=(0, (2, 2)), label="gains in use")
        if simulated is not None:
            at, rms, spread = simulated
            _dots(panel, at, np.degrees(rms), np.degrees(2.0 * spread), (GREEN, "o"), "simulated, ± 2 sigma")
        panel.set_ylabel("RMS error [deg]")
        panel.set_ylim(0.3 * least, 30.0 * least)
        panels.finish("crossover [rad/s]", "", (curve.crossover[0], curve.crossover[-1]), columns=4)
    return panels.figure


def allan_figure(
    measured: Mapping[str, AllanDeviation],
    fits: Mapping[str, AllanFit],
    unit: str = "deg/s",
    factor: float = math.degrees(1.0),
) -> Figure:
    """Draw Allan deviations and the noise fitted to them.

    Parameters
    ----------
    measured : mapping of str to AllanDeviation
        By the name of the axis.
    fits : mapping of str to AllanFit
        Fits of some or all of them; the straight lines of N, B and K are those of the first.
    unit : str, optional
        Unit to show.
    factor : float, optional
        What makes this unit of the signal's.
    """
    panels = _panels([3.4])
    (panel,) = panels.axes
    with style.context(STYLE):
        for (name, allan), look, dashes in zip(
            measured.items(), zip(_COLOURS, _MARKERS, strict=True), _DASHES, strict=False
        ):
            deviation_ = factor * allan.deviation
            fit = fits.get(name)
            spread = np.zeros_like(deviation_) if fit is None else factor * fit.spread
            _dots(panel, allan.tau, deviation_, np.minimum(spread, 0.9 * deviation_), look, name)
            if fit is not None:
                panel.plot(
                    allan.tau, factor * fit.deviation(allan.tau), color=look[0], linestyle=dashes, zorder=3
                )
        panel.set_xscale("log")
        panel.set_yscale("log")
        tau = next(iter(measured.values())).tau
        for fit in list(fits.values())[:1]:
            _slopes(panel, fit, tau, factor)
        panel.set_ylabel(f"Allan deviation [{unit}]")
        limits = (tau[0] / 1.3, tau[-1] * 1.3)
        panels.finish("averaging time [s]", "points: record; lines: fit of N, B and K", limits, columns=5)
    return panels.figure


def loop_figure(cases: Mapping[str, InLoop], limits: tuple[float, float], at: float | None = None) -> Figure:
    """Draw gain and phase from the true attitude to the estimated one, for cases by their names.

    Parameters
    ----------
    cases : mapping of str to InLoop
    limits : tuple of float
        Range of the frequency axis, rad/s.
    at : float, optional
        Crossover of the control loop to mark, rad/s.
    """
    panels = _panels([1.7, 1.7])
    gain, phase = panels.axes
    omega = np.geomspace(*limits, 400)
    with style.context(STYLE):
        for (name, case), colour, dashes in zip(cases.items(), _COLOURS, _DASHES, strict=False):
            values = case.respond(omega)
            gain.semilogx(omega, _decibels(values), color=colour, linestyle=dashes, label=name)
            phase.semilogx(omega, np.degrees(np.angle(values)), color=colour, linestyle=dashes)
        for panel in panels.axes:
            panel.axhline(0.0, color=GREY, linewidth=0.6, zorder=1)
            if at is not None:
                panel.axvline(at, color=GREY, linewidth=0.7, linestyle=(0, (2, 2)), zorder=1)
        gain.set_ylabel("gain [dB]")
        phase.set_ylabel("phase [deg]")
        panels.finish("frequency [rad/s]", "", limits, columns=len(cases))
    return panels.figure


def equivalents_figure(found: Mapping[str, Equivalent]) -> Figure:
    """Draw the measured low-pass of estimators, each with its nearest complementary filter and corner."""
    columns = min(3, len(found))
    rows = math.ceil(len(found) / columns)
    with style.context(STYLE):
        figure = Figure(figsize=(PAGE_WIDTH, 1.75 * rows + 0.6), layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
        for panel, (name, equivalent) in zip(panels, found.items(), strict=False):
            response = equivalent.response
            omega = np.geomspace(response.omega[0], response.omega[-1], 300)
            expected = _decibels(equivalent.respond(omega)[int(response.path == "rate")])
            panel.semilogx(omega, expected, color=VERMILION, linestyle=_DASHES[1], label="nearest filter")
            _dots(panel, response.omega, _decibels(response.main), response.error_db, (BLUE, "o"), "measured")
            panel.axvline(equivalent.crossover, ymin=0.27, color=GREY, linewidth=0.7, linestyle=(0, (2, 2)))
            form = equivalent.form.replace(" and ", "\nand ")
            within = f"within {max(equivalent.mismatch_db, 1e-3):.1g} dB"
            text = f"{equivalent.crossover:.2f} rad/s, {form}\n{within}"
            panel.annotate(text, (0.04, 0.05), xycoords="axes fraction", fontsize=7.0, bbox=_BACKGROUND)
            panel.set_title(name, fontsize=8.5, loc="left")
            panel.grid(which="major", color=_GRID, linewidth=0.5)
            panel.xaxis.set_major_formatter(FuncFormatter(_plain))
        for panel in panels[len(found) :]:
            panel.set_visible(False)
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper right", ncols=2, frameon=False)
        figure.supxlabel("frequency [rad/s]", fontsize=8.0)
        figure.supylabel("$G_A$ [dB]", fontsize=8.0)
    return figure


def margin_figure(
    reference: str, predicted: Mapping[str, StateSpace], measured: Mapping[str, LoopGain]
) -> Figure:
    """Draw loop gains, and what each adds to the phase of one of them.

    Parameters
    ----------
    reference : str
        The name of that one.
    predicted : mapping of str to control.StateSpace
        Loop gains by name.
    measured : mapping of str to LoopGain
        Of the same names.
    """
    panels = _panels([2.0, 2.0, 1.4])
    magnitude, phase, added = panels.axes
    points = next(iter(measured.values())).frequency
    omega = np.geomspace(points[0] / 1.1, points[-1] * 1.1, 400)
    with style.context(STYLE):
        looks = zip(_COLOURS, _MARKERS, _DASHES, strict=True)
        base = systems.response(predicted[reference], omega)
        base_at = systems.response(predicted[reference], points)
        for (name, system), (colour, marker, dashes) in zip(predicted.items(), looks, strict=False):
            line, found = systems.response(system, omega), measured[name]
            degrees = np.degrees(np.unwrap(np.angle(line)))
            degrees -= 360.0 * np.ceil(degrees[0] / 360.0)
            margin = f"{name}, {math.degrees(found.phase_margin):.1f}° at {found.crossover:.1f} rad/s"
            magnitude.semilogx(omega, _decibels(line), color=colour, linestyle=dashes)
            phase.semilogx(omega, degrees, color=colour, linestyle=dashes)
            added.semilogx(omega, np.degrees(np.angle(line / base)), color=colour, linestyle=dashes)
            none, look = np.zeros_like(points), (colour, marker)
            about = np.interp(points, omega, degrees)
            off = np.degrees(np.angle(found.response / systems.response(system, points)))
            _dots(magnitude, points, _decibels(found.response), none, look, margin)
            _dots(phase, points, about + off, none, look)
            _dots(added, points, np.degrees(np.angle(found.response / base_at)), none, look)
        magnitude.axhline(0.0, color=GREY, linewidth=0.6)
        phase.axhline(-180.0, color=GREY, linewidth=0.6)
        magnitude.set_ylabel("loop gain [dB]")
        phase.set_ylabel("phase [deg]")
        phase.yaxis.set_major_locator(MultipleLocator(45.0))
        added.set_ylabel(f"phase against\n{reference} [deg]")
        for panel in panels.axes:
            panel.yaxis.set_major_formatter(FuncFormatter(_plain))
        limits = (float(omega[0]), float(omega[-1]))
        panels.finish("frequency [rad/s]", "points: measured; lines: theory", limits, columns=2)
    return panels.figure


@dataclass(frozen=True, slots=True)
class Spectrum:
    """A one-sided amplitude spectral density."""

    frequency: Array
    """Hz."""
    density: Array
    """rad/rtHz."""


def noise_figure(
    before: Spectrum, after: Spectrum, filter_: ComplementaryFilter, predicted: Spectrum | None = None
) -> Figure:
    """Draw the noise of the measured angle before the filter, and of the estimate after it."""
    panels = _panels([3.0])
    (panel,) = panels.axes
    with style.context(STYLE):
        panel.loglog(
            before.frequency,
            np.degrees(before.density),
            color=_PALE,
            linewidth=0.7,
            label="angle of the sensors",
        )
        panel.loglog(after.frequency, np.degrees(after.density), color=BLUE, linewidth=0.8, label="estimate")
        if predicted is not None:
            panel.loglog(
                predicted.frequency,
                np.degrees(predicted.density),
                color=VERMILION,
                linestyle=_DASHES[1],
                linewidth=1.4,
                label="estimate, predicted",
            )
        panel.axvline(
            filter_.crossover / (2.0 * math.pi),
            color=GREY,
            linewidth=0.8,
            linestyle=(0, (2, 2)),
            label="crossover",
        )
        panel.set_ylabel(r"noise density [deg/$\sqrt{\mathrm{Hz}}$]")
        panels.finish(
            "frequency [Hz]", "", (after.frequency[after.frequency > 0.0][0], after.frequency[-1]), columns=4
        )
    return panels.figure


@dataclass(frozen=True, slots=True)
class _Panels:
    figure: Figure
    axes: list[Axes]

    def finish(self, label: str, title: str, limits: tuple[float, float], columns: int) -> None:
        """Label what all panels share."""
        for panel in self.axes:
            panel.grid(which="major", color=_GRID, linewidth=0.5)
            panel.set_axisbelow(True)
        self.axes[-1].set_xlabel(label)
        self.axes[-1].set_xlim(*limits)
        if self.axes[-1].get_xscale() == "log":
            self.axes[-1].xaxis.set_major_formatter(FuncFormatter(_plain))
        self.figure.align_ylabels(self.axes)
        handles, names = self.axes[0].get_legend_handles_labels()
        self.figure.legend(handles, names, loc="outside upper right", ncols=columns, frameon=False)
        if title:
            self.figure.suptitle(title, fontsize=9.0, x=0.01, ha="left")


def _panels(heights: Sequence[float]) -> _Panels:
    with style.context(STYLE):
        figure = Figure(figsize=(PAGE_WIDTH, sum(heights) + 0.9), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=list(heights))[:, 0]
    return _Panels(figure, list(axes))


def _decibels(gain: ComplexArray) -> Array:
    return 20.0 * np.log10(np.maximum(np.abs(gain), 1e-12))


def _phase(gain: ComplexArray, path: int) -> Array:
    """Return the phase in degrees without jumps; G_A starts at zero, G_B ends there."""
    order = slice(None, None, -1 if path else 1)
    return np.degrees(np.unwrap(np.angle(gain[order])))[order]


def _frequency_range(filter_: Responding, measured: Sequence[FrequencyResponse]) -> tuple[float, float]:
    if measured:
        omega = np.concatenate([m.omega for m in measured])
        return float(omega.min()) / 1.3, float(omega.max()) * 1.3
    wc = filter_.crossover
    limit = math.inf if filter_.sample_time is None else math.pi / filter_.sample_time
    return 0.02 * wc, min(50.0 * wc, limit)


def _asymptotes(panel: Axes, filter_: Responding, omega: Array) -> None:
    """Draw the straight lines that |G_A| nears above and |G_B| below the crossover."""
    for path, end in ((0, -1), (1, 0)):
        two = filter_.respond(omega[[end, end - 1 if end else 1]])[path]
        steps = math.log(omega[end - 1 if end else 1] / omega[end])
        slope = round(float(np.log(np.abs(two[1] / two[0]))) / steps)
        line = np.abs(two[0]) * (omega / omega[end]) ** slope
        label = "asymptotes" if path else None
        panel.semilogx(
            omega, np.minimum(_decibels(line), 0.0), color=_PALE, linewidth=0.7, zorder=1, label=label
        )


def _mark_crossover(panels: Sequence[Axes], label: Axes, wc: float) -> None:
    if not math.isfinite(wc):
        return
    for panel in panels:
        panel.axvline(wc, color=GREY, linewidth=0.7, linestyle=(0, (2, 2)), zorder=1)
    label.annotate(
        f"crossover {wc:.3g} rad/s",
        (wc, 0.03),
        xycoords=("data", "axes fraction"),
        xytext=(4, 0),
        textcoords="offset points",
    )


def _dots(
    panel: Axes, x: Array, y: Array, spread: Array, look: tuple[str, str], label: str | None = None
) -> None:
    """Draw points with error bars in a colour and with a marker."""
    colour, marker = look
    panel.errorbar(
        x,
        y,
        spread,
        color=colour,
        marker=marker,
        label=label,
        linestyle="none",
        markersize=3.2,
        markerfacecolor="white",
        markeredgewidth=0.8,
        capsize=1.5,
    )


def _look(response: FrequencyResponse) -> tuple[str, str]:
    return (BLUE, "o") if response.path == "angle" else (VERMILION, "s")


def _points(magnitude: Axes, phase: Axes, response: FrequencyResponse, filter_: Responding) -> None:
    look, omega, path = _look(response), response.omega, int(response.path == "rate")
    expected = filter_.respond(omega)[path]
    about = _phase(expected, path) + np.degrees(deviation(response.main, expected).phase)
    label = f"measured, {_INPUTS[path]}"
    _dots(magnitude, omega, _decibels(response.main), response.error_db, look, label)
    _dots(phase, omega, about, np.degrees(response.error_phase), look)


def _deviations(
    decibels: Axes, degrees: Axes, filter_: Responding, measured: Sequence[FrequencyResponse]
) -> None:
    for response in measured:
        look, omega = _look(response), response.omega
        found = deviation(response.main, filter_.respond(omega)[int(response.path == "rate")])
        _dots(decibels, omega, found.magnitude_db, response.error_db, look)
        _dots(degrees, omega, np.degrees(found.phase), np.degrees(response.error_phase), look)
    for panel, name in ((decibels, "deviation\n[dB]"), (degrees, "deviation\n[deg]")):
        panel.axhline(0.0, color=GREY, linewidth=0.6)
        panel.set_ylabel(name)
        panel.yaxis.set_major_locator(MaxNLocator(3))
        panel.yaxis.set_major_formatter(FuncFormatter(_plain))
        panel.margins(y=0.2)


def _plain(value: float, _position: int) -> str:
    return f"{value:g}".replace("-", "\N{MINUS SIGN}")


def _slopes(panel: Axes, fit: AllanFit, tau: Array, factor: float) -> None:
    """Draw the straight lines of N, B and K of one axis, as far as they are not far below the curve."""
    n, b, k = (factor * e.value for e in (fit.white, fit.instability, fit.walk))
    lines = (
        ("N", n / np.sqrt(tau), -1),
        ("B", np.full_like(tau, b * math.sqrt(2.0 * math.log(2.0) / math.pi)), 0),
        ("K", k * np.sqrt(tau / 3.0), 0),
    )
    floor = 0.3 * factor * float(np.min(fit.deviation(tau)))
    for name, line, end in lines:
        seen = line > floor
        if np.count_nonzero(seen) > 1:
            panel.plot(tau[seen], line[seen], color=_PALE, linewidth=0.8, zorder=1)
            place = np.flatnonzero(seen)[end]
            shift = (6 if end else -11, -3) if name != "B" else (2, 3)
            panel.annotate(
                name, (tau[place], line[place]), xytext=shift, textcoords="offset points", color=GREY
            )
