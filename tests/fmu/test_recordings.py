"""Real recordings give the same attitude by every way through the project, to the bit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import models, records, scenarios
from ahrs_fmu.replay import Replay, Via

THROUGH_FMUS: tuple[Via, ...] = ("fmu2", "fmu3", "fmu3-scalar")
ROTATED: dict[str, Via] = {"mekf": "fmu2", "ukf": "fmu3", "cg_ekf": "fmu3-scalar"}
"""What is run by default: each FMU takes seconds to compile. GCF has tests of its own."""


def check(recordings: Sequence[Path], via: Via, build: Path) -> None:
    core, fmu = Replay("gcf", {}, "c"), Replay("gcf", {}, via, build)
    for path in recordings:
        record = records.read(path)
        expected, found = core.run(record), fmu.run(record)
        assert len(expected) == len(record) > 40_000
        for name in ("q", "gyro_bias", "status"):
            np.testing.assert_array_equal(
                getattr(found, name), getattr(expected, name), err_msg=f"{name} of {path.name}"
            )


@pytest.mark.parametrize("via", THROUGH_FMUS)
def test_a_recording_replayed_through_an_fmu_gives_the_bits_of_the_core(
    via: Via, broad_dir: Path, tmp_path: Path
) -> None:
    check(sorted(broad_dir.glob("*.mat"))[-1:], via, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("via", THROUGH_FMUS)
def test_all_recordings_replayed_through_an_fmu_give_the_bits_of_the_core(
    via: Via, broad_dir: Path, tmp_path: Path
) -> None:
    recordings = sorted(broad_dir.glob("*.mat"))
    assert len(recordings) == 15
    check(recordings, via, tmp_path)


EVERY_ESTIMATOR = [
    pytest.param(name, via, marks=() if ROTATED.get(name) == via else pytest.mark.slow)
    for name in sorted(models.BY_NAME)
    for via in THROUGH_FMUS
]


@pytest.mark.parametrize(("name", "via"), EVERY_ESTIMATOR)
def test_the_fmu_of_every_estimator_gives_the_bits_of_its_core(name: str, via: Via, tmp_path: Path) -> None:
    core, fmu = Replay(name, {}, "c"), Replay(name, {}, via, tmp_path)
    for experiment in ("ac/swing", "gc/circ"):
        record = scenarios.load(experiment).rows(0, 700)
        expected, found = core.run(record), fmu.run(record)
        for output in ("q", "euler", "rate", "gyro_bias", "motion_accel", "attitude_std", "status"):
            np.testing.assert_array_equal(getattr(found, output), getattr(expected, output), err_msg=output)
