"""Figures of the frequency domain: what is drawn is what was computed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ahrs_fmu import descriptors, plots
from ahrs_fmu.analysis.allan import allan_deviation, fit_allan
from ahrs_fmu.analysis.design import error_against_crossover, motion_band, noise_of_samples
from ahrs_fmu.analysis.in_loop import InLoop, thrust_borne
from ahrs_fmu.analysis.measure import multisine, plan
from ahrs_fmu.analysis.plots import (
    Spectrum,
    allan_figure,
    bode_figure,
    error_figure,
    loop_figure,
    noise_figure,
    pole_zero_figure,
    step_figure,
)
from ahrs_fmu.analysis.theory import Gains, crossover, filter_of
from ahrs_fmu.cosim.core import CoreStepper

T = 0.02
FILTER = filter_of(Gains(0.5, 0.1), T)
NOISE = noise_of_samples(1e-3, 2e-5, 1e-3, T)


def line(panel: Axes, label: str) -> tuple[np.ndarray, np.ndarray]:
    found = next(drawn for drawn in panel.lines if drawn.get_label() == label)
    return np.asarray(found.get_xdata()), np.asarray(found.get_ydata())


def labels(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def test_bode_lines_are_the_responses_in_decibels_and_their_sum_is_flat() -> None:
    magnitude = bode_figure(FILTER).axes[0]
    omega, decibels = line(magnitude, "$G_A$ angle")
    np.testing.assert_allclose(decibels, 20.0 * np.log10(np.abs(FILTER.respond(omega)[0])))
    np.testing.assert_allclose(line(magnitude, "$G_A + G_B$")[1], 0.0, atol=1e-9)
    assert f"crossover {crossover(FILTER):.3g} rad/s" in [t.get_text() for t in magnitude.texts]


def test_measured_points_come_with_a_deviation_below() -> None:
    core = CoreStepper(descriptors.load("gcf"), {"sample_time": T})
    responses = [multisine(core, plan(path, [0.1, 1.0, 10.0], FILTER), T) for path in ("angle", "rate")]
    figure = bode_figure(FILTER, responses, "measured")
    assert [panel.get_ylabel() for panel in figure.axes] == [
        "magnitude [dB]",
        "phase [deg]",
        "deviation\n[dB]",
        "deviation\n[deg]",
    ]
    assert {"measured, angle", "measured, gyro"} <= set(labels(figure))
    drawn = [np.asarray(drawn.get_ydata()) for drawn in figure.axes[2].lines]
    assert any(y.size == 3 and np.max(np.abs(y)) < 0.1 for y in drawn)


def test_phase_of_a_third_order_filter_has_no_jumps() -> None:
    phase = bode_figure(filter_of(Gains(1.0, 0.3, 0.05), T)).axes[1]
    for drawn in phase.lines[:2]:
        assert np.max(np.abs(np.diff(np.asarray(drawn.get_ydata())))) < 10.0


def test_poles_are_drawn_where_they_are() -> None:
    for filter_, panels in ((FILTER, 2), (filter_of(Gains(1.0, 0.3, 0.05)), 1)):
        figure = pole_zero_figure(filter_)
        assert len(figure.axes) == panels
        real, imaginary = line(figure.axes[-1], "poles")
        np.testing.assert_allclose(np.sort(real), np.sort(filter_.poles.real))
        np.testing.assert_allclose(np.sort(imaginary), np.sort(filter_.poles.imag))


def test_the_error_curve_marks_its_optimum() -> None:
    curve = error_against_crossover(NOISE, np.geomspace(0.05, 50.0, 30), motion=motion_band(0.1, 0.5, 2.0))
    simulated = (np.array([1.0]), np.array([1e-3]), np.array([1e-4]))
    figure = error_figure(curve, simulated, chosen=0.5)
    x, y = line(figure.axes[0], "optimum")
    assert float(x[0]) == pytest.approx(curve.best)
    assert float(y[0]) == pytest.approx(math.degrees(np.min(curve.total)), rel=0.02)
    assert {"motion", "total", "gains in use", "simulated, ± 2 sigma"} <= set(labels(figure))


def test_allan_plot_has_points_and_fitted_lines_of_every_axis() -> None:
    rng = np.random.default_rng(2)
    measured = {axis: allan_deviation(rng.standard_normal(20_000), T) for axis in "xyz"}
    fits = {axis: fit_allan(allan) for axis, allan in measured.items()}
    panel = allan_figure(measured, fits, unit="rad/s", factor=1.0).axes[0]
    fitted = [np.asarray(drawn.get_ydata()) for drawn in panel.lines]
    expected = fits["y"].deviation(measured["y"].tau)
    assert any(y.shape == expected.shape and np.allclose(y, expected) for y in fitted)
    assert panel.get_ylabel() == "Allan deviation [rad/s]"


def test_cost_in_a_loop_is_drawn_in_decibels_and_degrees() -> None:
    loop = InLoop(FILTER, seen=thrust_borne(0.26), delay=T)
    gain, phase = loop_figure({"flight": loop}, (0.1, 50.0), at=6.0).axes
    omega, decibels = line(gain, "flight")
    values = loop.respond(omega)
    np.testing.assert_allclose(decibels, 20.0 * np.log10(np.abs(values)))
    np.testing.assert_allclose(np.asarray(phase.lines[0].get_ydata()), np.degrees(np.angle(values)))


def test_step_and_noise_figures_are_in_degrees_and_percent() -> None:
    panel = step_figure({"second order": FILTER}).axes[0]
    assert line(panel, "second order")[1][0] == pytest.approx(100.0 * (1.0 - 0.5 * T))
    flat = Spectrum(np.array([0.1, 1.0, 10.0]), np.full(3, 1e-3))
    figure = noise_figure(flat, flat, FILTER, flat)
    np.testing.assert_allclose(line(figure.axes[0], "estimate")[1], math.degrees(1e-3))


def test_figures_are_written_as_png_and_svg_with_the_same_bytes_every_time(tmp_path: Path) -> None:
    first = plots.save(bode_figure(FILTER), tmp_path / "first")
    second = plots.save(bode_figure(FILTER), tmp_path / "second")
    assert [p.suffix for p in first] == [".png", ".svg"]
    for a, b in zip(first, second, strict=True):
        assert a.read_bytes() == b.read_bytes()
