from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import browser
from ahrs_fmu import campaign
from ahrs_fmu.campaign import Campaign, CaseResult, Results, execution, worker
from ahrs_fmu.campaign.axes import Range, latin_hypercube
from ahrs_fmu.campaign.store import Store
from ahrs_fmu.campaign.worst import run_again
from ahrs_fmu.cli import main
from ahrs_fmu.cosim import running, scenario
from ahrs_fmu.cosim.fmu import Fmu
from ahrs_fmu.cosim.instances import Instances
from ahrs_fmu.errors import MissingExtraError, ScenarioError, SimulationError

distributed = pytest.importorskip("distributed")
parquet = pytest.importorskip("pyarrow.parquet")

SCENARIO = """
template = "estimation"
duration = 4.0

[motion]
rotation.roll_deg.sines = [{ amplitude = 20, frequency = 0.5 }]

[[expect]]
signal = "attitude_error.total"
measure = "rms"
at_most = "3 deg"
from = 1.0

[[expect]]
signal = "estimator.gyro_bias"
measure = "max"
at_most = "0.6 deg/s"
"""

CAMPAIGN = """
description = "Two estimators <and> a fault"
scenario = "tilt.cosim.toml"
seeds = 2
samples = 3

[vary]
components.estimator.model = ["gcf", "mahony"]
components.estimator.parameters.kp = { from = 0.1, to = 10.0, log = true }

[variants.fault]
none = {}
iron.faults.iron = { kind = "bias", signal = "imu.mag", amount = ["9 uT", 0, 0], start = 2 }
"""

FRAGILE = """
import os
from ahrs_fmu.component import Component, Input, Output, Parameter


class Fragile(Component):
    \"\"\"Fails in a way that is given.\"\"\"

    how = Parameter(0.0)
    x = Output()

    def update(self, dt):
        if self.how == 1.0:
            raise ValueError("the rotor came off")
        if self.how == 2.0:
            os._exit(1)
        self.x = self.x + dt
"""

FRAGILE_CAMPAIGN = """
[vary]
components.fragile.parameters.how = {how}

[scenario]
duration = 0.1
step = 0.01
components.fragile.class = "fragile.py:Fragile"

[[scenario.expect]]
signal = "fragile.x"
measure = "max"
at_most = 1.0
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder with a scenario and a campaign of 24 cases of it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tilt.cosim.toml").write_text(SCENARIO)
    (tmp_path / "gains.campaign.toml").write_text(CAMPAIGN)
    return tmp_path


def planned(folder: Path, *changes: tuple[str, str]) -> Campaign:
    """The campaign, with replacements in its text."""
    text = CAMPAIGN
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "gains.campaign.toml").write_text(text)
    return campaign.read(folder / "gains.campaign.toml")


def run(plan: Campaign, output: Path, **options: object) -> Results:
    """Run with one thread, which starts at once."""
    return campaign.run(plan, output, **{"workers": 1, "threads": True, **options})  # type: ignore[arg-type]


def ahrs_fmu(*arguments: str) -> list[str]:
    """Command line of the program in a process of its own."""
    return [sys.executable, "-c", "import sys; from ahrs_fmu.cli import main; sys.exit(main())", *arguments]


def comparable(results: Results) -> list[CaseResult]:
    """Results without what depends on the clock."""
    return [replace(case, runtime=0.0) for case in results.cases]


@pytest.fixture(scope="module")
def gains(tmp_path_factory: pytest.TempPathFactory) -> tuple[Results, Path]:
    """The campaign, run, and its folder."""
    folder = tmp_path_factory.mktemp("gains")
    (folder / "tilt.cosim.toml").write_text(SCENARIO)
    return run(planned(folder), folder / "out"), folder / "out"


# What a file says


def test_every_combination_of_variants_values_points_and_seeds_is_a_case(folder: Path) -> None:
    cases = planned(folder).cases
    assert len(cases) == 2 * 2 * 3 * 2
    assert len({case.key for case in cases}) == len(cases)
    models = {case.changes["components.estimator.model"] for case in cases}
    assert models == {"gcf", "mahony"}
    with_fault = [case for case in cases if case.levels["fault"] == "iron"]
    assert len(with_fault) == len(cases) // 2
    assert all(case.changes["faults.iron.kind"] == "bias" for case in with_fault)
    kp = "components.estimator.parameters.kp"
    for model in models:  # all see the same points
        own = [c.changes[kp] for c in cases if c.changes["components.estimator.model"] == model]
        assert len(set(own)) == 3
    assert cases[0].label.startswith("fault=none, estimator=gcf, kp=")
    assert cases[0].label.endswith("seed=1")


def test_each_part_of_a_range_holds_one_point_of_a_latin_hypercube() -> None:
    ranges = {"a": Range(from_=-2.0, to=3.0), "b": Range(from_=1e-3, to=1e2, log=True)}
    points = latin_hypercube(ranges, 50, seed=3)
    a = (np.array([point["a"] for point in points]) + 2.0) / 5.0
    b = (np.log10(np.array([point["b"] for point in points], dtype=float)) + 3.0) / 5.0
    for part in (a, b):
        assert sorted(np.floor(50 * part).astype(int)) == list(range(50))
    assert latin_hypercube(ranges, 50, seed=3) == points
    assert latin_hypercube(ranges, 50, seed=4) != points


def test_what_a_scenario_varies_itself_is_varied_too(folder: Path) -> None:
    varied = SCENARIO.replace("duration = 4.0", "duration = 4.0\nseeds = [7, 9]")
    (folder / "tilt.cosim.toml").write_text(
        varied + '\n[vary]\n"components.estimator.parameters.ki" = [0.1, 0.2]\n'
    )
    cases = planned(folder, ("seeds = 2\n", "")).cases
    assert {case.seed for case in cases} == {7, 9}
    assert {case.levels["components.estimator.parameters.ki"] for case in cases} == {0.1, 0.2}
    assert len(cases) == 2 * 2 * 3 * 2 * 2


def test_several_scenarios_are_an_axis(folder: Path) -> None:
    (folder / "calm.cosim.toml").write_text(SCENARIO.replace("amplitude = 20", "amplitude = 1"))
    cases = planned(folder, ('"tilt.cosim.toml"', '["tilt.cosim.toml", "calm.cosim.toml"]')).cases
    assert [case.levels["scenario"] for case in cases] == 24 * ["tilt"] + 24 * ["calm"]


def test_a_list_changes_what_a_variant_brings(folder: Path) -> None:
    cases = planned(
        folder,
        ("none = {}\n", ""),
        ("[vary]", "[vary]\nfaults.iron.severity = [0.5, 2.0]"),
    ).cases
    made = {
        scenario.read(folder / "tilt.cosim.toml").scenario(c.changes).faults["iron"].severity for c in cases
    }
    assert made == {0.5, 2.0}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seeds = 2", "seeds = 0", "gains.campaign.toml: seeds: Expected `int` >= 1"),
        ("seeds = 2", "sedes = 2", "gains.campaign.toml: Object contains unknown field `sedes`"),
        ("seeds = 2", "seeds = [1, 1]", "12 cases are the same as others"),
        ("samples = 3", "", "vary.components.estimator.parameters.kp is a range: say samples = N"),
        ('["gcf", "mahony"]', "[]", "vary.components.estimator.model: the list is empty"),
        ('["gcf", "mahony"]', '"gcf"', "vary.components.estimator.model: give a list"),
        ("from = 0.1, to", "from = 20.0, to", "parameters.kp: from = 20 must be below to = 10"),
        ("from = 0.1, to", "from = -1.0, to", "parameters.kp: from = -1 must be positive where log = true"),
        ("from = 0.1, to", "from = 0.1, too = 3, to", "parameters.kp: Object contains unknown field `too`"),
        ("variants.fault", "variants.seed", "variants.seed: 'seed' is an axis already"),
        ('scenario = "tilt', 'scenario = "flat', "flat.cosim.toml"),
        ("scenario = ", "scenario = 3 # ", "gains.campaign.toml: scenario: Expected"),
        ('kind = "bias"', 'kind = "bios"', "tilt.cosim.toml: faults.iron"),
        ("[vary]", "[vary", "gains.campaign.toml: this is no TOML"),
    ],
)
def test_a_wrong_file_is_told_in_one_line_with_file_and_key(
    folder: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, message: str
) -> None:
    assert old in CAMPAIGN
    (folder / "gains.campaign.toml").write_text(CAMPAIGN.replace(old, new, 1))
    assert main(["campaign", "gains.campaign.toml"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert message in lines[0]


def test_a_campaign_none_of_whose_cases_fits_together_does_not_start(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    planned(folder, ("estimator.parameters.kp", "estimator.parameters.kpp"))
    assert main(["campaign", "gains.campaign.toml", "--threads"]) == 2
    assert "tilt.cosim.toml: components.estimator: GCF has no parameter 'kpp'" in capsys.readouterr().err
    assert not list(folder.glob("build/campaign/gains/parts/*"))


def test_without_the_extra_the_command_says_what_to_install(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    planned(folder)
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["campaign", "gains.campaign.toml"]) == 2
    assert capsys.readouterr().err.splitlines() == [
        "ahrs-fmu: a campaign needs distributed: pip install 'ahrs-fmu[campaign]'"
    ]
    with pytest.raises(MissingExtraError):
        run(planned(folder), folder / "out")


def test_the_example_of_the_page_runs_and_tells_the_estimators_apart(folder: Path) -> None:
    page = Path(__file__).parents[2] / "docs" / "campaign.md"
    flight, faults = re.findall(r"```toml\n(.*?)```", page.read_text(), re.DOTALL)
    (folder / "flight.cosim.toml").write_text(flight)
    (folder / "faults.campaign.toml").write_text(faults.replace("seeds = 10", "seeds = 1"))
    results = run(campaign.read("faults.campaign.toml"), folder / "out")
    passing = {
        (case.levels["fault"], case.levels["components.estimator.model"])
        for case, result in zip(results.campaign.cases, results.cases, strict=True)
        if result.passed and case.levels["faults.injected.severity"] == 1.0
    }
    assert ("iron", "gcf") not in passing
    assert ("vibration", "kcf") in passing
    assert results.stopped == 0


# What comes out


def test_a_campaign_measures_what_its_cases_measure_alone(gains: tuple[Results, Path]) -> None:
    results, _ = gains
    file = results.campaign.scenarios[0]
    with Instances() as instances:
        for case, result in list(zip(results.campaign.cases, results.cases, strict=True))[::5]:
            alone = running.run(file.case(case.changes, case.seed), instances, Path())
            assert result.key == case.key
            assert result.passed == alone.passed
            assert {name: found.value for name, found in result.measured.items()} == {
                verdict.clause: verdict.measured for verdict in alone.verdicts
            }
    assert 0 < sum(result.passed for result in results.cases) < len(results.cases)


def test_the_part_of_the_limit_that_is_used_tells_who_violates_it(gains: tuple[Results, Path]) -> None:
    results, _ = gains
    for case in results.cases:
        rms = case.measured["rms of attitude_error.total from 1 s"].value / np.radians(3.0)
        bias = case.measured["max of estimator.gyro_bias"].value / np.radians(0.6)
        assert case.limit_used == pytest.approx(max(rms, bias), rel=1e-12)
        assert case.passed == (case.limit_used <= 1.0)
    assert results.worst(1)[0][1].limit_used == max(case.limit_used for case in results.cases)


def test_the_table_has_a_row_per_case_with_levels_and_measured_values(gains: tuple[Results, Path]) -> None:
    results, folder = gains
    table = parquet.read_table(folder / campaign.RESULTS)
    assert table.num_rows == len(results.cases)
    assert table["case"].to_pylist() == [case.key for case in results.campaign.cases]
    assert set(table["fault"].to_pylist()) == {"none", "iron"}
    assert table["components.estimator.parameters.kp"].type == "double"
    assert json.loads(table["changes"][0].as_py()) == dict(results.campaign.cases[0].changes)
    measured = table["rms of attitude_error.total from 1 s [rad]"].to_pylist()
    assert measured == [case.measured["rms of attitude_error.total from 1 s"].value for case in results.cases]
    parts = [
        row for path in (folder / "parts").iterdir() for row in parquet.read_table(path)["case"].to_pylist()
    ]
    assert sorted(parts) == sorted(case.key for case in results.cases)


def test_an_fmu_is_instantiated_once_and_reset_for_every_case(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []
    instantiate = Fmu.instantiate

    def counted(self: Fmu, *arguments: object) -> object:
        made.append(self)
        return instantiate(self, *arguments)  # type: ignore[arg-type]

    fmu = "[vary]\ncomponents.estimator.via = ['fmu3', 'c']"
    # One set of components for the check beforehand, which the worker of the same process goes on with.
    plan = planned(folder, ("[vary]", fmu), ("none = {}\n", ""), (', "mahony"', ""))
    monkeypatch.setattr(worker, "close", lambda: None)
    monkeypatch.setattr(Fmu, "instantiate", counted)
    results = run(plan, folder / "out")
    monkeypatch.undo()
    worker.close()
    assert len(made) == 1
    count = len(results.cases) // 2
    for with_fmu, with_c in zip(results.cases[:count], results.cases[count:], strict=True):
        assert with_fmu.measured == with_c.measured


def test_a_component_that_fails_is_a_result_and_stops_no_other_case(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "fragile.py").write_text(FRAGILE)
    (folder / "fragile.campaign.toml").write_text(FRAGILE_CAMPAIGN.format(how="[0.0, 1.0, 3.0]"))
    assert main(["campaign", "fragile.campaign.toml", "--threads", "--workers", "1", "-o", "out"]) == 1
    said = capsys.readouterr().out
    assert "2 of 3 cases pass; 0 violate a clause, 1 stopped" in said
    assert "the rotor came off" in said
    suite = ElementTree.parse(folder / "out" / campaign.JUNIT).getroot()
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("3", "0", "1")
    report = (folder / "out" / campaign.REPORT).read_text()
    assert "the rotor came off" in report


@pytest.mark.slow
def test_a_case_that_kills_its_process_is_told_from_its_neighbours(folder: Path) -> None:
    (folder / "fragile.py").write_text(FRAGILE)
    (folder / "fragile.campaign.toml").write_text(
        FRAGILE_CAMPAIGN.format(how="[0.0, 3.0, 4.0, 2.0, 5.0, 6.0]")
    )
    results = campaign.run(campaign.read("fragile.campaign.toml"), "out", workers=2)
    assert [case.failure for case in results.cases] == ["", "", "", execution.DIED, "", ""]


def test_the_workers_of_a_running_cluster_do_the_same(gains: tuple[Results, Path], folder: Path) -> None:
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        results = campaign.run(planned(folder), folder / "out", scheduler=cluster.scheduler_address)
        assert len(cluster.workers) == 1
    assert comparable(results) == comparable(gains[0])


def test_no_scheduler_at_an_address_is_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ahrs_fmu.campaign.cluster.CONNECTING", 0.2)
    with pytest.raises(SimulationError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        run(planned(folder), folder / "out", scheduler="tcp://127.0.0.1:9")


# What happens in the middle


def test_a_killed_campaign_goes_on_to_the_same_table(gains: tuple[Results, Path], folder: Path) -> None:
    script = """
import os, signal, sys
from ahrs_fmu import campaign
def kill(at):
    if at.done >= 8:
        os.kill(os.getpid(), signal.SIGKILL)
campaign.run(campaign.read("gains.campaign.toml"), "out", workers=1, threads=True, progress=kill)
"""
    killed = subprocess.run([sys.executable, "-c", script], cwd=folder, check=False, timeout=60)
    assert killed.returncode == -signal.SIGKILL
    there = Store(folder / "out").count()
    assert 8 <= there < 24
    # As if it had been in the middle of writing.
    (folder / "out" / "parts" / "00000099.incomplete").write_bytes(b"PAR1 and no end")
    ran: list[int] = []
    results = run(planned(folder), folder / "out", progress=lambda at: ran.append(at.done))
    assert ran[-1] == 24 - there
    assert Store(folder / "out").count() == 24
    assert comparable(results) == comparable(gains[0])
    tables = [
        parquet.read_table(path / campaign.RESULTS).drop_columns("runtime")
        for path in (folder / "out", gains[1])
    ]
    assert tables[0].equals(tables[1])


@pytest.mark.slow
def test_a_command_that_is_killed_again_and_again_ends_with_the_same_table(folder: Path) -> None:
    plan = planned(folder, ("samples = 3", "samples = 80"))
    command = ahrs_fmu("campaign", "gains.campaign.toml", "--workers", "2", "-o", "out", "--worst", "0")
    parts = folder / "out" / "parts"
    for kill in range(3):
        before = len(list(parts.glob("*.parquet")))
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
            while len(list(parts.glob("*.parquet"))) < before + 3:
                assert process.poll() is None
            time.sleep(0.1 * kill)
            process.kill()
    there = Store(folder / "out").count()
    assert 0 < there < len(plan.cases)
    ended = subprocess.run(command, check=False, capture_output=True, text=True)
    assert ended.returncode == 1
    assert ended.stdout.startswith(f"{there} of {len(plan.cases)} results are there from before")
    run(plan, folder / "unkilled")
    assert Store(folder / "out").count() == len(plan.cases)
    tables = [
        parquet.read_table(folder / name / campaign.RESULTS).drop_columns("runtime")
        for name in ("out", "unkilled")
    ]
    assert tables[0].equals(tables[1])


def test_more_seeds_run_only_what_is_new_and_a_changed_scenario_runs_anew(folder: Path) -> None:
    ran: list[tuple[int, int]] = []

    def note(at: campaign.Progress) -> None:
        ran.append((at.known, at.done))

    run(planned(folder, (', "mahony"', ""), ("samples = 3", "samples = 1")), folder / "out", progress=note)
    assert ran[-1] == (0, 4)
    more = planned(folder, (', "mahony"', ""), ("samples = 3", "samples = 1"), ("seeds = 2", "seeds = 3"))
    first = run(more, folder / "out", progress=note)
    assert ran[-1] == (4, 2)
    (folder / "tilt.cosim.toml").write_text(SCENARIO.replace('"3 deg"', '"4 deg"'))
    changed = planned(folder, (', "mahony"', ""), ("samples = 3", "samples = 1"), ("seeds = 2", "seeds = 3"))
    second = run(changed, folder / "out", progress=note)
    assert ran[-1] == (0, 6)
    assert first.cases[0].limit_used > second.cases[0].limit_used


def test_a_changed_file_that_a_scenario_names_runs_anew(folder: Path) -> None:
    (folder / "fragile.py").write_text(FRAGILE)
    (folder / "fragile.campaign.toml").write_text(FRAGILE_CAMPAIGN.format(how="[0.0]"))
    before = campaign.read("fragile.campaign.toml").cases[0].key
    assert campaign.read("fragile.campaign.toml").cases[0].key == before
    (folder / "fragile.py").write_text(FRAGILE.replace("+ dt", "- dt"))
    assert campaign.read("fragile.campaign.toml").cases[0].key != before


def test_a_damaged_file_of_results_is_told(folder: Path) -> None:
    plan = planned(folder)
    (folder / "out" / "parts").mkdir(parents=True)
    (folder / "out" / "parts" / "00000001.parquet").write_bytes(b"PAR1 and no end")
    with pytest.raises(
        ScenarioError, match=r"00000001\.parquet is damaged .*: remove it, and its cases run again"
    ):
        run(plan, folder / "out")


def test_two_campaigns_do_not_write_to_one_folder(folder: Path) -> None:
    plan = planned(folder)
    with Store(folder / "out").locked(), pytest.raises(ScenarioError, match="a campaign is writing there"):
        run(plan, folder / "out")


@pytest.mark.slow
def test_an_interrupted_command_says_how_to_go_on(folder: Path) -> None:
    planned(folder, ("samples = 3", "samples = 3000"))
    command = ahrs_fmu("campaign", "gains.campaign.toml", "--workers", "2", "-o", "out")
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        while len(list((folder / "out" / "parts").glob("*.parquet"))) < 5:
            assert process.poll() is None
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to the workers as well
        _, said = process.communicate(timeout=30)
    assert process.returncode == 130
    found = re.fullmatch(
        r"interrupted: (\d+) of 24000 results are in out; the same command goes on from there\n", said
    )
    assert found
    assert int(found[1]) == Store(folder / "out").count()


# What is told


def test_junit_counts_and_names_what_is_violated(gains: tuple[Results, Path]) -> None:
    results, folder = gains
    campaign.write_report(results, folder, worst=0)
    root = ElementTree.parse(folder / campaign.JUNIT).getroot()
    tests = root.findall("./testsuite/testcase")
    failures = root.findall("./testsuite/testcase/failure")
    assert root.tag == "testsuites"
    assert len(tests) == int(root.get("tests", "")) == len(results.cases)
    assert len(failures) == int(root.get("failures", "")) == results.violating
    assert len({test.get("name") for test in tests}) == len(tests)
    assert "expected ≤ 3 deg" in failures[0].get("message", "")


def test_the_exit_code_tells_whether_all_cases_pass(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    planned(folder, ("samples = 3", "samples = 1"))
    arguments = ["campaign", "gains.campaign.toml", "--threads", "--workers", "1", "--worst", "0"]
    assert main(arguments) == 1
    assert "8 of 8 results" not in capsys.readouterr().out
    assert main(arguments) == 1
    assert "8 of 8 results are there from before; 0 to run" in capsys.readouterr().out
    (folder / "tilt.cosim.toml").write_text(
        SCENARIO.replace('"3 deg"', '"90 deg"').replace('"0.6 deg/s"', '"90 deg/s"')
    )
    assert main(arguments) == 0
    assert "8 of 8 cases pass" in capsys.readouterr().out
    for name in (campaign.REPORT, campaign.JUNIT, campaign.RESULTS):
        assert (folder / "build" / "campaign" / "gains" / name).is_file()


def test_the_command_of_a_worst_case_repeats_it(
    gains: tuple[Results, Path],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    results, _ = gains
    monkeypatch.chdir(gains[1].parent)
    [worst] = run_again(results, 1)
    words = shlex.split(worst.command)
    assert main([word for word in words[1:] if word != "--plot"]) == 1
    rms = worst.result.measured["rms of attitude_error.total from 1 s"]
    assert rms.text in capsys.readouterr().out


@pytest.mark.skipif(browser.find() is None, reason="no Chromium: install it to click through the report")
def test_the_report_works_in_a_browser_without_a_complaint(gains: tuple[Results, Path]) -> None:
    results, folder = gains
    report = campaign.write_report(results, folder, worst=2)
    cells = list(zip(results.campaign.cases, results.cases, strict=True))
    iron = [result for case, result in cells if case.levels["fault"] == "iron"]
    gcf = [r for c, r in cells if c.levels["fault"] == "iron" and c.label.split(", ")[1] == "estimator=gcf"]
    with browser.page() as page:
        page.open(report)
        page.wait_for("document.body && document.body.dataset.ready")
        assert page.text("#summary .violate b") == str(results.violating)
        assert page.text("#cases-range") == f"1 to {len(cells)} of {len(cells)}"
        points = "document.querySelectorAll('#plot .point').length"
        assert page.evaluate(points) == len(cells)
        # Rows are the faults, columns the estimators.
        cell = "#matrix-table tbody tr:nth-child(2) td:nth-of-type(1) button"
        assert page.text(cell) == f"{sum(result.passed for result in gcf)} / {len(gcf)}"
        page.click(cell)
        assert f"{len(gcf)} cases with fault = iron and estimator = gcf" in page.text("#chosen")
        assert page.text("#cases-range") == f"1 to {len(gcf)} of {len(gcf)}"
        assert page.evaluate(points) == len(gcf)
        page.click("#chosen-clear")
        assert page.evaluate("document.querySelector('#chosen').hidden")
        page.choose("#matrix-columns", "")
        assert page.text("#matrix-table tbody tr:nth-child(2) td button").endswith(f"/ {len(iron)}")
        page.choose("#matrix-shows", "used")
        used = float(page.text("#matrix-table tbody tr:nth-child(2) td button"))
        assert used == pytest.approx(max(result.limit_used for result in iron), rel=0.01)
        for clause in ("1", "0"):
            page.choose("#plot-clause", clause)
            for axis in ("0", "2"):
                page.choose("#plot-axis", axis)
                for group in ("", "1"):
                    page.choose("#plot-group", group)
                    for kind in ("cumulative", "spread"):
                        page.choose("#plot-kind", kind)
                        assert page.evaluate("document.querySelectorAll('#plot .trace').length") > 0
        page.click("#plot-log")
        assert page.evaluate("document.querySelector('#plot').layout.yaxis.type") == "log"
        page.click("#cases-table th:nth-child(4)")
        shown = page.evaluate(
            "[...document.querySelectorAll('#cases-table td:nth-child(4)')].map((c) => +c.innerText)"
        )
        assert shown == sorted(shown)
        page.choose("#cases-state", "0")
        passed = sum(result.passed for result in results.cases)
        assert page.text("#cases-range") == f"1 to {passed} of {passed}"
        page.click("#worst details:nth-of-type(2) summary")
        picture = "#worst details:nth-of-type(2) img"
        page.wait_for(f"document.querySelector('{picture}').naturalWidth > 500")
        page.click("#parameters details summary")
        assert "Latin hypercube" in page.text("#parameters")
        assert "Two estimators <and> a fault" in page.text("header")
        assert page.complaints == []
