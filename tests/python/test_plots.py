from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import plots
from ahrs_fmu.demo_flight import demo_flight
from ahrs_fmu.records import Record


@pytest.fixture(scope="module")
def flight() -> Record:
    return demo_flight(duration=8.0)


def test_the_figure_shows_angles_and_the_three_errors(flight: Record) -> None:
    assert flight.q_true is not None
    figure = plots.replay_figure(flight, flight.q_true, "GCF")
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels[:3] == ["roll [deg]", "pitch [deg]", "yaw [deg]"]
    assert [label.split("\n")[0] for label in labels[3:]] == ["total", "heading", "inclination"]


def test_a_record_without_truth_shows_the_angles_only(flight: Record) -> None:
    assert flight.q_true is not None
    figure = plots.replay_figure(replace(flight, q_true=None), flight.q_true, "GCF")
    assert len(figure.axes) == 3


def test_thinning_keeps_a_peak_of_one_sample() -> None:
    long = Record(np.arange(60000.0), np.zeros((60000, 3)), np.zeros((60000, 3)))
    q = np.tile([1.0, 0.0, 0.0, 0.0], (60000, 1))
    q[30001] = [np.cos(0.5), np.sin(0.5), 0.0, 0.0]
    roll = plots.replay_figure(long, q, "GCF").axes[0].lines[0].get_ydata()
    assert len(roll) < 5000
    assert np.max(roll) == pytest.approx(np.degrees(1.0))


def test_the_same_figure_gives_the_same_bytes(flight: Record, tmp_path: Path) -> None:
    assert flight.q_true is not None
    first, second = (
        [
            p.read_bytes()
            for p in plots.save(plots.replay_figure(flight, flight.q_true, "GCF"), tmp_path / name)
        ]
        for name in ("deep/a", "deep/b")
    )
    assert first == second
