"""Attitude filters of other packages behind one call, for comparison; the extra ``peers`` brings them.

Each takes a recording in ENU and gives attitudes in ENU with magnetic north, from samples in the units and
the convention that its package asks for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import metadata

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import quaternion
from ahrs_fmu.extras import require
from ahrs_fmu.records import Record

FloatArray = NDArray[np.float64]
Peer = Callable[[Record], FloatArray]

STANDARD_GRAVITY = 9.80665
_PURPOSE = "comparison with other filters"
# A quarter turn about the vertical: north-west-up to east-north-up.
_NWU_TO_ENU = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])


def vqf(record: Record) -> FloatArray:
    """VQF with its default parameters."""
    return _vqf_family("VQF", record)


def basic_vqf(record: Record) -> FloatArray:
    """VQF without rest detection, bias estimation and magnetic disturbance rejection."""
    return _vqf_family("BasicVQF", record)


def offline_vqf(record: Record) -> FloatArray:
    """VQF that uses the whole recording for every sample."""
    module = require("vqf", "peers", _PURPOSE)
    result = module.offlineVQF(*_samples(record), record.sample_time)
    return np.asarray(result["quat9D"], dtype=np.float64)


def _vqf_family(name: str, record: Record) -> FloatArray:
    module = require("vqf", "peers", _PURPOSE)
    result = getattr(module, name)(record.sample_time).updateBatch(*_samples(record))
    return np.asarray(result["quat9D"], dtype=np.float64)


def fusion(record: Record) -> FloatArray:
    """Fusion, the revised filter of Madgwick's thesis, with its default gain; degrees and g."""
    module = require("imufusion", "peers", _PURPOSE)
    settings = module.AhrsSettings()
    settings.convention = module.CONVENTION_ENU
    settings.sample_rate = 1.0 / record.sample_time
    filter_ = module.Ahrs()
    filter_.set_settings(settings)
    q = np.empty((len(record), 4))
    gyro, accel, mag = _samples(record)
    for k, sample in enumerate(zip(np.degrees(gyro), accel / STANDARD_GRAVITY, mag, strict=True)):
        filter_.update(*sample)
        q[k] = filter_.get_quaternion()
    return q


def madgwick(record: Record) -> FloatArray:
    """Madgwick's gradient descent with the default gain of the package ahrs; nanotesla, north-west-up."""
    q = require("ahrs.filters", "peers", _PURPOSE).Madgwick(**_ahrs_samples(record)).Q
    return quaternion.multiply(_NWU_TO_ENU, np.asarray(q, dtype=np.float64))


def mahony(record: Record) -> FloatArray:
    """Mahony's filter with the default gains of the package ahrs; nanotesla."""
    q = require("ahrs.filters", "peers", _PURPOSE).Mahony(**_ahrs_samples(record)).Q
    return np.asarray(q, dtype=np.float64)


def _samples(record: Record) -> tuple[FloatArray, FloatArray, FloatArray]:
    microtesla = np.ascontiguousarray(1e6 * record.mag)
    return np.ascontiguousarray(record.gyro), np.ascontiguousarray(record.accel), microtesla


def _ahrs_samples(record: Record) -> dict[str, object]:
    gyro, accel, mag = _samples(record)
    return {"gyr": gyro, "acc": accel, "mag": 1e3 * mag, "frequency": 1.0 / record.sample_time}


PEERS: Mapping[str, tuple[Peer, str]] = {
    "VQF": (vqf, "vqf"),
    "BasicVQF": (basic_vqf, "vqf"),
    "offlineVQF": (offline_vqf, "vqf"),
    "Fusion": (fusion, "imufusion"),
    "Madgwick (ahrs)": (madgwick, "ahrs"),
    "Mahony (ahrs)": (mahony, "ahrs"),
}
"""Filter and distribution by the name in tables."""


def version(name: str) -> str:
    """Version of the distribution that brings a peer.

    Raises
    ------
    MissingExtraError
        It is not installed.
    """
    distribution = PEERS[name][1]
    require(distribution, "peers", _PURPOSE)
    return metadata.version(distribution)
