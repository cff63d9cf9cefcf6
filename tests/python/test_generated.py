from __future__ import annotations

from ahrs_fmu.export import classes, headers
from ahrs_fmu.sources import fmu_src


def test_every_generated_c_file_is_fresh() -> None:
    stale = [
        path.name
        for path, text in headers.generated().items()
        if not path.is_file() or path.read_text() != text
    ]
    assert not stale, f"{', '.join(stale)}: run `make generate`"


def test_no_generated_c_file_is_left_over() -> None:
    expected = set(headers.generated())
    found = {*fmu_src().glob("include/*.h"), *fmu_src().glob("models/*/*_table.c")}
    assert found == expected


def test_the_python_classes_are_fresh() -> None:
    assert classes.path().read_text() == classes.text(), "models.py: run `make generate`"
