"""Campaigns: many variations of a scenario, run by many workers, told in one report.

From a script::

    from ahrs_fmu import campaign

    if __name__ == "__main__":
        results = campaign.run(campaign.read("gains.campaign.toml"), "build/campaign/gains", workers=4)
        campaign.write_report(results, "build/campaign/gains")
"""

from ahrs_fmu.campaign.execution import Progress, run
from ahrs_fmu.campaign.plan import Campaign, PlannedCase, read
from ahrs_fmu.campaign.report import JUNIT, REPORT, write_report
from ahrs_fmu.campaign.results import CaseResult, Measured, Results
from ahrs_fmu.campaign.store import RESULTS

__all__ = [
    "JUNIT",
    "REPORT",
    "RESULTS",
    "Campaign",
    "CaseResult",
    "Measured",
    "PlannedCase",
    "Progress",
    "Results",
    "read",
    "run",
    "write_report",
]
