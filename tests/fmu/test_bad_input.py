"""Wrong calls are answered with an error, change nothing and leave a log line; sensors may say anything."""

from __future__ import annotations

import ctypes
from ctypes import byref, c_bool, c_double, c_int, c_int64, c_size_t

import numpy as np
import pytest
from host import DISCARD, ERROR, OK, WARNING, Instance, Library

NAN, INF = float("nan"), float("inf")
DECLARED = {"logStatusError", "logStatusWarning", "logEvents", "logAll"}


def real(instance: Instance) -> str:
    return "Real" if instance.version == 2 else "Float64"


def refused(instance: Instance, status: int, *words: str) -> None:
    """The call failed, and the last line says in which function and why."""
    assert status == ERROR
    line = instance.log[-1]
    assert line.status == ERROR
    assert line.category in DECLARED
    assert line.message.startswith(f"fmi{instance.version}")
    for word in words:
        assert word in line.message


@pytest.fixture
def instance(library: Library):
    one = library.instance()
    yield one
    one.free()


@pytest.fixture
def running(library: Library):
    one = library.instance().run(accel=[0.1, 0.2, -9.8], mag=[2e-5, 0, 4e-5], gyro=[0.1, 0, 0])
    yield one
    one.free()


@pytest.mark.parametrize("token", ["", "{00000000-0000-0000-0000-000000000000}", "nonsense %s%n #r1#"])
def test_a_wrong_token_gives_no_instance(token: str, library: Library) -> None:
    with pytest.raises(ValueError, match="token"):
        library.instance(token=token)


def test_an_instance_without_name_is_refused(library: Library) -> None:
    with pytest.raises(ValueError, match="name"):
        library.instance(name="")


def test_null_instances_are_answered_with_an_error(library: Library) -> None:
    prefix = f"fmi{library.version}"
    for name in ("Reset", "ExitInitializationMode", "Terminate"):
        assert library.c[f"{prefix}{name}"](None) == ERROR
    library.c[f"{prefix}FreeInstance"](None)


@pytest.mark.parametrize("vr", [99, 12, 999_999, 2**32 - 1])
def test_unknown_value_references_are_refused(vr: int, instance: Instance) -> None:
    values = (c_double * 1)(7.0)
    refused(instance, instance.raw(f"Set{real(instance)}", [vr], values), str(vr), "unknown")
    refused(instance, instance.raw(f"Get{real(instance)}", [vr], values), str(vr), "unknown")
    assert values[0] == 7.0


def test_one_wrong_reference_among_right_ones_changes_nothing(instance: Instance) -> None:
    known = instance.library.variables
    references = [known["kp"].vrs[0], known["ki"].vrs[0], 999_999]
    refused(instance, instance.raw(f"Set{real(instance)}", references, (c_double * 3)(0.9, 0.9, 0.9)))
    references = [known["kp"].vrs[0], known["ki"].vrs[0]]
    refused(instance, instance.raw(f"Set{real(instance)}", references, (c_double * 2)(0.9, -1.0)), "ki", "-1")
    assert instance.get("kp") == 0.5
    assert instance.get("ki") == 0.1


def test_the_wrong_type_is_refused(instance: Instance) -> None:
    known = instance.library.variables
    kp, valid, frame = (known[name].vrs[0] for name in ("kp", "mag_valid", "frame"))
    numbers = (c_double * 1)(0.0)
    refused(instance, instance.raw(f"Set{real(instance)}", [valid], numbers), "mag_valid", "Boolean")
    refused(instance, instance.raw(f"Set{real(instance)}", [frame], numbers), "frame", "enumeration")
    refused(instance, instance.raw("GetBoolean", [kp], (c_int * 1)()), "kp", "real")
    refused(instance, instance.raw("SetString", [kp], (ctypes.c_char_p * 1)(b"x")), "kp")
    integer = "Integer" if instance.version == 2 else "Int32"
    refused(instance, instance.raw(f"Set{integer}", [kp], (c_int * 1)()), "kp")


@pytest.mark.parametrize("library", ["3", "3-scalar"], indirect=True)
def test_other_number_types_of_fmi_3_hold_no_variables(instance: Instance) -> None:
    for kind in ("Float32", "Int8", "UInt8", "Int16", "UInt16", "UInt32", "UInt64", "String"):
        refused(instance, instance.raw(f"Get{kind}", [1], (c_int64 * 4)(), 1))
        refused(instance, instance.raw(f"Set{kind}", [1], (c_int64 * 4)(), 1))
        assert instance.raw(f"Get{kind}", [], None, 0) == OK


@pytest.mark.parametrize("library", ["3", "3-scalar"], indirect=True)
def test_the_wrong_number_of_values_is_refused(instance: Instance) -> None:
    gyro = list(instance.library.variables["gyro"].vrs)
    for n in (0, 1, 2, 4, 2**60):
        if n != len(gyro) or instance.library.variables["gyro"].size != n:
            refused(instance, instance.raw("SetFloat64", gyro, (c_double * 4)(), n), "values")


@pytest.mark.parametrize("library", ["3"], indirect=True)
def test_elements_of_an_array_variable_have_no_reference_of_their_own(instance: Instance) -> None:
    refused(instance, instance.raw("GetFloat64", [2], (c_double * 3)(), 1), "2", "unknown")


def test_null_arrays_are_refused(instance: Instance) -> None:
    vr = [instance.library.variables["kp"].vrs[0]]
    refused(instance, instance.raw(f"Set{real(instance)}", vr, None), "NULL")
    refused(instance, instance.raw(f"Get{real(instance)}", vr, None), "NULL")
    extra = () if instance.version == 2 else (c_size_t(1),)
    refused(
        instance, instance.call(f"Get{real(instance)}", None, c_size_t(1), (c_double * 1)(), *extra), "NULL"
    )


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("kp", value) for value in (NAN, INF, -0.1, 1e9)),
        *(("sample_time", value) for value in (0.0, -0.01, NAN, 10.0)),
        *(("motion_time_constant", value) for value in (0.0, -INF)),
        *(("frame", value) for value in (2, -1)),
        ("initialisation", 77),
        *(("q0", value) for value in ([1, 0, NAN, 0], [9, 0, 0, 0])),
    ],
)
def test_parameters_out_of_range_are_refused_by_name_and_limit(
    name: str, value: float, instance: Instance
) -> None:
    before = instance.serialise()
    refused(instance, instance.set(name, value), name, "outside")
    assert instance.serialise() == before


def test_infinity_is_a_value_where_the_descriptor_says_so(instance: Instance) -> None:
    assert instance.set("motion_time_constant", INF) == OK
    assert instance.get("motion_time_constant") == INF


def test_outputs_cannot_be_set(running: Instance) -> None:
    refused(running, running.set("q", [1, 0, 0, 0]), "q", "computed")
    refused(running, running.set("time", 1.0), "time")


def test_fixed_parameters_cannot_be_set_late(running: Instance) -> None:
    refused(running, running.set("sample_time", 0.02), "sample_time", "fixed")
    refused(running, running.set("frame", 1), "frame", "fixed")
    assert running.get("sample_time") == 0.01


def test_outputs_are_not_known_before_initialisation(instance: Instance) -> None:
    vr = list(instance.library.variables["roll"].vrs)
    refused(instance, instance.raw(f"Get{real(instance)}", vr, (c_double * 1)()), "before initialisation")


def test_functions_in_the_wrong_phase_are_refused(library: Library) -> None:
    instance = library.instance()
    refused(instance, instance.step(0.0, 0.01), "DoStep", "before initialisation")
    refused(instance, instance.call("ExitInitializationMode"))
    refused(instance, instance.call("Terminate"))
    assert instance.start() == OK
    refused(instance, instance.step(0.0, 0.01), "during initialisation")
    refused(instance, instance.start())
    assert instance.call("ExitInitializationMode") == OK
    refused(instance, instance.call("ExitInitializationMode"), "once initialisation has ended")
    refused(instance, instance.start())
    assert instance.call("Terminate") == OK
    refused(instance, instance.step(0.0, 0.01), "after the end")
    refused(instance, instance.set("kp", 0.4), "after the end")
    assert instance.get("kp") == 0.5
    assert instance.get("roll") == 0.0
    instance.free()


def test_limits_between_parameters_are_checked_at_the_end_of_initialisation(library: Library) -> None:
    instance = library.instance()
    assert instance.set("kp", 150.0) == OK
    assert instance.start() == OK
    refused(
        instance,
        instance.call("ExitInitializationMode"),
        "kp = 150",
        "sample_time = 0.01",
        "kp*sample_time < 1",
    )
    vr = list(instance.library.variables["roll"].vrs)
    refused(instance, instance.raw(f"Get{real(instance)}", vr, (c_double * 1)()), "kp*sample_time < 1")
    assert instance.set("kp", 0.5) == OK
    assert instance.call("ExitInitializationMode") == OK
    instance.free()


def test_a_step_after_gains_that_do_not_go_together_fails_and_keeps_the_old_ones(running: Instance) -> None:
    assert running.step(0.0, 0.01) == OK
    attitude = running.get("q")
    assert running.set("kp", 150.0) == OK
    assert running.set("ki", 0.2) == OK
    refused(running, running.step(0.01, 0.01), "kp*sample_time < 1")
    assert running.get("kp") == 0.5
    assert running.get("ki") == 0.1
    np.testing.assert_array_equal(running.get("q"), attitude)
    assert running.get("time") == 0.01
    assert running.step(0.01, 0.01) == OK


def test_unwise_settings_warn_and_run(library: Library) -> None:
    instance = library.instance()
    instance.set("motion_compensation", 1)
    instance.set("motion_time_constant", INF)
    assert instance.start() == OK
    assert instance.call("ExitInitializationMode") == WARNING
    assert instance.log[-1].category == "logStatusWarning"
    assert "motion_time_constant" in instance.log[-1].message
    assert instance.step(0.0, 0.01) == OK
    instance.free()


def test_undeclared_log_categories_are_refused_and_declared_ones_choose(library: Library) -> None:
    instance = library.instance()

    def categories(*names: str) -> object:
        return (ctypes.c_char_p * len(names))(*(name.encode() for name in names))

    off, on = (0, 1) if instance.version == 2 else (c_bool(False), c_bool(True))
    refused(instance, instance.call("SetDebugLogging", on, c_size_t(1), categories("logWishes")), "logWishes")
    refused(instance, instance.call("SetDebugLogging", on, c_size_t(1), None))
    assert instance.call("SetDebugLogging", off, c_size_t(1), categories("logStatusError")) == OK
    lines = len(instance.log)
    assert instance.step(0.0, 0.01) == ERROR
    assert len(instance.log) == lines
    assert instance.call("SetDebugLogging", on, c_size_t(2), categories("logStatusError", "logEvents")) == OK
    assert instance.step(0.0, 0.01) == ERROR
    instance.run()
    assert [line.category for line in instance.log[lines:]] == ["logStatusError", "logEvents"]
    assert instance.call("SetDebugLogging", on, c_size_t(1), categories("logAll")) == OK
    assert instance.call("SetDebugLogging", off, c_size_t(0), None) == OK
    instance.free()


def test_events_are_logged_only_when_asked_for(library: Library) -> None:
    assert library.instance().run().log == []
    assert [line.category for line in library.instance(logging=True).run().log] == ["logEvents"]


@pytest.mark.parametrize("value", [NAN, INF, -INF, 1e300, -1e300, 1e30])
@pytest.mark.parametrize("sensor", ["gyro", "accel", "mag"])
def test_impossible_sensor_values_leave_outputs_finite_and_are_forgotten(
    sensor: str, value: float, library: Library
) -> None:
    good = {"gyro": [0.0, 0.0, 0.0], "accel": [0.5, 0.2, -9.7], "mag": [2e-5, 1e-6, 4e-5]}
    spoilt, clean = (library.instance().run(**good) for _ in range(2))
    for k in range(400):
        for name, numbers in good.items():
            numbers = [value, numbers[1], numbers[2]] if name == sensor and 100 <= k < 105 else numbers
            assert spoilt.set(name, numbers) == OK
        assert spoilt.step(k * 0.01, 0.01) == OK
        assert clean.step(k * 0.01, 0.01) == OK
        for output in ("q", "roll", "pitch", "yaw", "rate", "gyro_bias", "motion_accel"):
            assert np.all(np.isfinite(spoilt.get(output)))
    np.testing.assert_allclose(spoilt.get("q"), clean.get("q"), atol=1e-3)
    spoilt.free()
    clean.free()


def test_functions_that_a_sampled_model_does_not_have_say_so(running: Instance) -> None:
    none = (None,) * 8
    names = {
        2: "GetDirectionalDerivative SetRealInputDerivatives GetRealOutputDerivatives CancelStep GetStatus "
        "GetIntegerStatus GetStringStatus EnterEventMode NewDiscreteStates EnterContinuousTimeMode "
        "CompletedIntegratorStep SetContinuousStates GetDerivatives GetEventIndicators GetContinuousStates "
        "GetNominalsOfContinuousStates",
        3: "EnterConfigurationMode ExitConfigurationMode EnterEventMode EnterStepMode "
        "EvaluateDiscreteStates EnterContinuousTimeMode GetNumberOfEventIndicators "
        "GetNumberOfContinuousStates GetIntervalDecimal GetShiftFraction SetShiftDecimal",
    }[running.version]
    before = running.serialise()
    for name in names.split():
        refused(running, running.call(name, *none), name)
    assert running.serialise() == before


@pytest.mark.parametrize("library", ["2"], indirect=True)
def test_status_inquiries_of_fmi_2_tell_what_there_is_to_tell(running: Instance) -> None:
    time, ended = c_double(), c_int(5)
    assert running.step(0.0, 0.03) == OK
    assert running.call("GetRealStatus", c_int(2), byref(time)) == OK
    assert time.value == 0.03
    assert running.call("GetBooleanStatus", c_int(3), byref(ended)) == OK
    assert ended.value == 0
    refused(running, running.call("GetRealStatus", c_int(0), byref(time)))
    refused(running, running.call("GetBooleanStatus", c_int(3), None))
    assert DISCARD not in {line.status for line in running.log}


@pytest.mark.parametrize("library", ["3"], indirect=True)
def test_null_flags_of_an_fmi_3_step_are_refused(running: Instance) -> None:
    before = running.serialise()
    arguments = (c_double(0.0), c_double(0.01), c_bool(True), None, None, None, None)
    refused(running, running.call("DoStep", *arguments), "NULL")
    assert running.serialise() == before
