"""Accuracy on the BROAD data set (doi 10.3390/data6070072), with its own metric, filters side by side.

The score of a trial is the RMS over the movement phases of the angle between estimated and optical attitude,
and of its parts, heading and inclination; the score of a filter is the mean over the trials. Results are kept
in files, so that an interrupted run goes on and a changed filter runs anew.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import descriptors, kcf_offline, models, peers, records
from ahrs_fmu.errors import RecordError
from ahrs_fmu.estimator import Estimator
from ahrs_fmu.frames import Frame
from ahrs_fmu.host_library import library_file
from ahrs_fmu.metrics import attitude_error
from ahrs_fmu.native import NativeModel
from ahrs_fmu.records import Record

FloatArray = NDArray[np.float64]

OFFLINE = "KCF offline"
CURVE_POINTS = 3000
_LAYOUT = "2"
"""Of the kept files: part of their names."""

GROUPS: Mapping[str, tuple[str, ...]] = {
    "undisturbed": ("undisturbed",),
    "vibration": ("tapping", "vibration"),
    "fixed magnet": ("stationary_magnet",),
    "attached magnet": ("attached_magnet",),
}
"""Groups of trials by what their names contain."""
OTHER_GROUP = "other"


@dataclass(frozen=True, slots=True)
class Trial:
    """One recording of the data set.

    Attributes
    ----------
    path : Path
        Where it is.
    group : str
        A key of `GROUPS`, or `OTHER_GROUP`.
    """

    path: Path
    group: str

    @property
    def name(self) -> str:
        """Name of the file without its extension."""
        return self.path.stem


def find_trials(folder: Path) -> list[Trial]:
    """List the recordings in a folder.

    Raises
    ------
    RecordError
        There is none.
    """
    paths = sorted(folder.glob("*.mat"))
    if not paths:
        raise RecordError(f"{folder} holds no MAT files of BROAD; get them from github.com/dlaidig/broad")
    return [Trial(path, group_of(path.stem)) for path in paths]


def group_of(name: str) -> str:
    """Group of a trial by its name."""
    for group, words in GROUPS.items():
        if any(word in name for word in words):
            return group
    return OTHER_GROUP


def as_recorded(record: Record) -> Record:
    """Leave the recording as it is."""
    return record


def without_rest(record: Record) -> Record:
    """Cut the rest at the beginning off."""
    if record.evaluate is None or not record.evaluate.any():
        raise RecordError(f"{record.name} does not tell when it moves")
    return _rows(record, slice(int(np.argmax(record.evaluate)), None))


def without_rest_biased(record: Record) -> Record:
    """Cut the rest off and add the bias."""
    return with_bias(without_rest(record))


def with_bias(record: Record) -> Record:
    """Add one degree per second to every axis of the gyroscope."""
    return replace(record, gyro=record.gyro + np.radians(1.0))


def with_hard_iron(record: Record) -> Record:
    """Add (5, -5, 0) uT to the magnetometer, in the axes of the recording."""
    return replace(record, mag=record.mag + np.array([5e-6, -5e-6, 0.0]))


def every_third(record: Record) -> Record:
    """Keep every third sample as it is."""
    return _rows(record, slice(None, None, 3))


def swapped_gyro(record: Record) -> Record:
    """Turn the sign of the gyroscope's x axis around."""
    return replace(record, gyro=record.gyro * np.array([-1.0, 1.0, 1.0]))


def swapped_mag(record: Record) -> Record:
    """Turn the sign of the magnetometer's y axis around."""
    return replace(record, mag=record.mag * np.array([1.0, -1.0, 1.0]))


def _rows(record: Record, rows: slice) -> Record:
    return replace(
        record,
        time=record.time[rows],
        gyro=record.gyro[rows],
        accel=record.accel[rows],
        mag=record.mag[rows],
        accel_valid=record.accel_valid[rows],
        mag_valid=record.mag_valid[rows],
        q_true=None if record.q_true is None else record.q_true[rows],
        evaluate=None if record.evaluate is None else record.evaluate[rows],
    )


STRESSES: Mapping[str, Callable[[Record], Record]] = {
    "as recorded": as_recorded,
    "hard iron (5, -5) uT": with_hard_iron,
    "gyroscope +1 deg/s": with_bias,
    "rest cut off": without_rest,
    "rest cut off, +1 deg/s": without_rest_biased,
    "every third sample": every_third,
    "float32": as_recorded,
    "gyro x swapped": swapped_gyro,
    "mag y swapped": swapped_mag,
}
"""Changes of the recordings by name; "float32" changes the filter instead."""
NOMINAL = "as recorded"
SINGLE = "float32"


@dataclass(frozen=True, slots=True)
class Job:
    """A filter, a recording, and what is done to it.

    Attributes
    ----------
    estimator : str
        Model of the project, `OFFLINE`, or a key of `peers.PEERS`.
    trial : Trial
        The recording.
    stress : str
        A key of `STRESSES`.
    """

    estimator: str
    trial: Trial
    stress: str = NOMINAL

    @property
    def label(self) -> str:
        """Name of the filter in tables and figures."""
        own = self.estimator in models.BY_NAME
        return descriptors.load(self.estimator).title if own else self.estimator

    @property
    def is_possible(self) -> bool:
        """Whether the filter exists in the precision that the stress asks for."""
        return self.stress != SINGLE or self.estimator in models.BY_NAME


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What came of a job.

    Attributes
    ----------
    job : Job
        The job.
    total, heading, inclination : float
        RMS errors, degrees.
    nanoseconds : float
        Processor time per sample: of the updates for a filter of the project, of the whole call for others.
    implausible : float
        Share of the samples that the filter reported as implausible; NaN if it does not report that.
    time : ndarray, shape (M,)
        Seconds, for the curves.
    curves : ndarray, shape (M, 3)
        Total, heading and inclination error over time, degrees; NaN where the truth is unknown.
    """

    job: Job
    total: float
    heading: float
    inclination: float
    nanoseconds: float
    implausible: float
    time: FloatArray
    curves: FloatArray


def estimator_names(with_peers: bool) -> list[str]:
    """Names of all filters: those of the project, then the peers."""
    return [*models.BY_NAME, OFFLINE, *(peers.PEERS if with_peers else ())]


def estimate(job: Job, record: Record) -> tuple[FloatArray, float]:
    """Run the filter of a job over a recording in ENU.

    Returns
    -------
    q : ndarray, shape (N, 4)
        Attitude in ENU.
    implausible : float
        As in `Outcome`.
    """
    if job.estimator == OFFLINE:
        return kcf_offline.smooth(record).q, float("nan")
    if job.estimator in peers.PEERS:
        return peers.PEERS[job.estimator][0](record), float("nan")
    options = {"frame": record.frame.value, "sample_time": record.sample_time}
    result = Estimator(job.estimator, options, "single" if job.stress == SINGLE else "double").run(record)
    flagged = result.others.get("implausible")
    return result.q, float("nan") if flagged is None else float(np.mean(flagged))


def evaluate(job: Job) -> Outcome:
    """Do a job."""
    record = STRESSES[job.stress](records.read(job.trial.path).in_frame(Frame.ENU))
    if record.q_true is None:
        raise RecordError(f"{job.trial.path} has no true attitude")
    start = time.process_time()
    q, implausible = estimate(job, record)
    spent = time.process_time() - start
    if job.estimator in models.BY_NAME and job.stress == NOMINAL:
        spent = _update_time(job.estimator, record)
    error = attitude_error(q, record.q_true)
    rms = error.rms(record.evaluate).degrees()
    thin = slice(None, None, max(1, len(record) // CURVE_POINTS))
    curves = np.degrees(np.stack((error.total, error.heading, error.inclination), axis=-1))[thin]
    return Outcome(
        job=job,
        total=rms["total"],
        heading=rms["heading"],
        inclination=rms["inclination"],
        nanoseconds=1e9 * spent / len(record),
        implausible=implausible,
        time=record.time[thin] - record.time[0],
        curves=curves,
    )


def _update_time(estimator: str, record: Record) -> float:
    """Processor time of the updates alone over a recording, the best of three."""
    core = NativeModel(descriptors.load(estimator))
    core.set("sample_time", record.sample_time)
    steps = np.diff(record.time, prepend=record.time[0])
    samples = {"gyro": record.gyro, "accel": record.accel, "mag": record.mag}
    spent = []
    for _ in range(3):
        core.reset()
        start = time.process_time()
        core.run(steps, samples, ())
        spent.append(time.process_time() - start)
    return min(spent)


def run(
    jobs: Iterable[Job],
    keep: Path,
    *,
    workers: int = 1,
    done: Callable[[Outcome], object] = id,
) -> list[Outcome]:
    """Do jobs that are possible and have not been done before, several at a time.

    Parameters
    ----------
    jobs : iterable of Job
        What to do.
    keep : Path
        Folder of the kept results.
    workers : int
        Processes at a time.
    done : callable
        Told of every outcome as it comes, kept ones first.

    Returns
    -------
    list of Outcome
        In the order of the jobs.

    Raises
    ------
    MissingExtraError
        A peer is not installed.
    RecordError
        A recording cannot be used.
    """
    keep.mkdir(parents=True, exist_ok=True)
    wanted = [job for job in jobs if job.is_possible]
    files = {job: keep / f"{_fingerprint(job)}.npz" for job in wanted}
    outcomes: dict[Job, Outcome] = {}
    waiting = []
    for job, file in files.items():
        kept = _load(job, file)
        if kept is None:
            waiting.append(job)
        else:
            outcomes[job] = kept
            done(kept)
    with ProcessPoolExecutor(workers) as pool:
        futures = [pool.submit(evaluate, job) for job in waiting]
        try:
            for future in as_completed(futures):
                outcome = future.result()
                _store(outcome, files[outcome.job])
                outcomes[outcome.job] = outcome
                done(outcome)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return [outcomes[job] for job in wanted]


def _fingerprint(job: Job) -> str:
    if job.estimator in peers.PEERS:
        code = peers.version(job.estimator)
    else:
        code = str(library_file("single" if job.stress == SINGLE else "double"))
    stat = job.trial.path.stat()
    parts = (_LAYOUT, job.estimator, job.stress, job.trial.name, stat.st_size, stat.st_mtime_ns, code)
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:24]


def _load(job: Job, file: Path) -> Outcome | None:
    if not file.is_file():
        return None
    with np.load(file) as held:
        total, heading, inclination, nanoseconds, implausible = (float(x) for x in held["numbers"])
        return Outcome(
            job, total, heading, inclination, nanoseconds, implausible, held["time"], held["curves"]
        )


def _store(outcome: Outcome, file: Path) -> None:
    numbers = (
        outcome.total,
        outcome.heading,
        outcome.inclination,
        outcome.nanoseconds,
        outcome.implausible,
    )
    # A name of its own until it is whole: an interrupted run leaves no half file.
    partial = file.with_suffix(".partial.npz")
    np.savez_compressed(partial, numbers=np.array(numbers), time=outcome.time, curves=outcome.curves)
    partial.replace(file)


@dataclass(frozen=True, slots=True)
class Row:
    """Means over trials, degrees.

    Attributes
    ----------
    estimator : str
        The filter.
    total, heading, inclination : float
        Mean RMS errors.
    by_group : mapping of str to float
        Mean total error of the groups.
    nanoseconds : float
        Median processor time per sample.
    """

    estimator: str
    total: float
    heading: float
    inclination: float
    by_group: Mapping[str, float]
    nanoseconds: float


def summary(outcomes: Sequence[Outcome]) -> list[Row]:
    """Means of every filter over the recordings as they are, the best first."""
    rows = []
    for name in dict.fromkeys(o.job.estimator for o in outcomes):
        own = [o for o in outcomes if o.job.estimator == name and o.job.stress == NOMINAL]
        if own:
            rows.append(_row(own))
    return sorted(rows, key=lambda row: row.total)


def _row(own: Sequence[Outcome]) -> Row:
    groups = dict.fromkeys([*GROUPS, OTHER_GROUP])
    totals = {g: [o.total for o in own if o.job.trial.group == g] for g in groups}
    return Row(
        estimator=own[0].job.label,
        total=fmean(o.total for o in own),
        heading=fmean(o.heading for o in own),
        inclination=fmean(o.inclination for o in own),
        by_group={group: fmean(values) for group, values in totals.items() if values},
        nanoseconds=float(np.median([o.nanoseconds for o in own])),
    )


@dataclass(frozen=True, slots=True)
class StressRow:
    """Mean of one filter under one change of the recordings.

    Attributes
    ----------
    estimator, stress : str
        The filter and the change.
    total : float
        Mean RMS total error, degrees.
    reported : int or None
        Trials in which the filter reported implausible sensors; None if it does not report that.
    trials : int
        Trials.
    """

    estimator: str
    stress: str
    total: float
    reported: int | None
    trials: int


def stress_summary(outcomes: Sequence[Outcome]) -> list[StressRow]:
    """Means of every filter under every change."""
    rows = []
    for name in dict.fromkeys(o.job.estimator for o in outcomes):
        for stress in STRESSES:
            own = [o for o in outcomes if (o.job.estimator, o.job.stress) == (name, stress)]
            if own:
                flags = [o.implausible for o in own]
                reported = None if np.isnan(flags).any() else sum(flag > 0.0 for flag in flags)
                rows.append(
                    StressRow(own[0].job.label, stress, fmean(o.total for o in own), reported, len(own))
                )
    return rows
