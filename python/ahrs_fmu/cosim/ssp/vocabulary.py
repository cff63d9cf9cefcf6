"""Names in the XML files of SSP 1.0."""

from __future__ import annotations

from xml.etree import ElementTree

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
AHRS = "urn:ahrs-fmu:co-simulation"

for _prefix, _space in (("ssd", SSD), ("ssc", SSC), ("ssv", SSV), ("ahrs", AHRS)):
    ElementTree.register_namespace(_prefix, _space)


def ssd(name: str) -> str:
    """Qualified name in the structure description."""
    return f"{{{SSD}}}{name}"


def ssc(name: str) -> str:
    """Qualified name of what all files share."""
    return f"{{{SSC}}}{name}"


def ssv(name: str) -> str:
    """Qualified name in a parameter set."""
    return f"{{{SSV}}}{name}"


def ahrs(name: str) -> str:
    """Qualified name in this package's annotation."""
    return f"{{{AHRS}}}{name}"
