from __future__ import annotations

from ahrs_fmu.export import modelica


def test_what_the_libraries_take_from_descriptors_and_c_is_fresh() -> None:
    files = modelica.generated()
    stale = [path.name for path, text in files.items() if not path.is_file() or path.read_text() != text]
    assert not stale, f"{', '.join(stale)}: run `make generate`"
