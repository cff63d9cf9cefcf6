"""Real recordings give the same attitude by every way through the project, to the bit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import records
from ahrs_fmu.replay import Replay, Via

THROUGH_FMUS: tuple[Via, ...] = ("fmu2", "fmu3", "fmu3-scalar")


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
