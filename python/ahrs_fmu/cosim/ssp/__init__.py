"""Systems as SSP 1.0 packages: System Structure and Parameterization, the exchange format above FMI."""

from ahrs_fmu.cosim.ssp.read import read_ssp
from ahrs_fmu.cosim.ssp.write import write_ssp

__all__ = ["read_ssp", "write_ssp"]
