"""Attitude estimators as FMI co-simulation components.

An estimator class takes its parameters by name and runs over a recording::

    import ahrs_fmu

    record = ahrs_fmu.read_record("flight.csv")
    result = ahrs_fmu.GCF(kp=0.5, ki=0.1).run(record)
    print(result.euler)
"""

from ahrs_fmu.estimate import Estimate, EstimateResult, Status
from ahrs_fmu.estimator import Estimator
from ahrs_fmu.frames import Frame
from ahrs_fmu.models import *  # noqa: F403
from ahrs_fmu.models import __all__ as _models
from ahrs_fmu.records import Record
from ahrs_fmu.records import read as read_record
from ahrs_fmu.records import write as write_record

__all__ = [
    "Estimate",
    "EstimateResult",
    "Estimator",
    "Frame",
    "Record",
    "Status",
    "read_record",
    "write_record",
]
__all__ += _models  # noqa: PLE0605
