"""Recordings of an inertial measurement unit: in memory and in files."""

from ahrs_fmu.records.files import EXTENSIONS, read, write
from ahrs_fmu.records.record import Record

__all__ = ["EXTENSIONS", "Record", "read", "write"]
