"""Figures of a run: what a person reads from them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from ahrs_fmu.cosim.plots import run_figure
from ahrs_fmu.cosim.running import run_file

SCENARIOS = Path(__file__).resolve().parent / "scenarios"


@pytest.fixture(scope="module")
def panels() -> dict[str, Axes]:
    """By label of the panel: a run with two faults, of which one lasts."""
    (outcome,) = run_file(SCENARIOS / "complementary-mag-dropout.cosim.toml")
    figure = run_figure(outcome, "a title")
    return {panel.get_ylabel().replace("\n", " "): panel for panel in figure.axes}


def test_angles_come_first_and_then_what_is_expected(panels: dict[str, Axes]) -> None:
    assert list(panels) == [
        "roll [deg]", "pitch [deg]", "yaw [deg]", "attitude error heading [deg]", "estimator status"
    ]  # fmt: skip


def test_states_are_called_by_their_names(panels: dict[str, Axes]) -> None:
    panel = panels["estimator status"]
    assert [label.get_text() for label in panel.get_yticklabels()] == ["nominal", "mag unused"]
    (states,) = panel.lines
    time, values = np.array(states.get_xdata()), np.array(states.get_ydata())
    assert (values == ((time > 19.995) & (time < 49.995))).all()


def test_a_bound_is_drawn_where_it_holds(panels: dict[str, Axes]) -> None:
    bounds = [
        (*line.get_xdata(), line.get_ydata()[0]) for line in panels["attitude error heading [deg]"].lines[1:]
    ]
    assert bounds == [pytest.approx(b) for b in ((0.0, 70.0, 3.21), (0.0, 70.0, 3.19), (50.0, 70.0, 0.3))]


def test_the_time_of_every_fault_is_shaded(panels: dict[str, Axes]) -> None:
    for panel in panels.values():
        spans = [p for p in panel.patches if isinstance(p, Rectangle)]
        assert [(span.get_x(), span.get_width()) for span in spans] == [(0.0, 70.0), (20.0, 30.0)]


def test_a_clause_stands_with_its_signal(panels: dict[str, Axes]) -> None:
    (words,) = [text.get_text() for text in panels["estimator status"].texts]
    assert words == "reached equals mag_unused: 20 s (20 to 20.01 s)"
