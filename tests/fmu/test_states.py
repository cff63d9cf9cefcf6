"""Saved states are exact, and bytes that are no state of this model are refused."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import byref, c_size_t, c_void_p

import numpy as np
import pytest
from host import ERROR, OK, Library


@pytest.fixture
def running(library: Library):
    instance = library.instance().run(accel=[0.1, 0.2, -9.8], mag=[2e-5, 1e-6, 4e-5])
    for k in range(7):
        assert instance.step(k * 0.01, 0.01) == OK
    yield instance
    instance.free()


def test_every_single_bit_flip_is_refused(running) -> None:
    data = bytearray(running.serialise())
    before = running.serialise()
    for position in range(len(data)):
        for bit in range(8):
            data[position] ^= 1 << bit
            status, _ = running.deserialise(bytes(data))
            assert status == ERROR, (position, bit)
            data[position] ^= 1 << bit
    assert running.serialise() == before
    assert running.deserialise(bytes(data))[0] == OK


def test_truncated_extended_and_random_bytes_are_refused(running) -> None:
    data = running.serialise()
    rng = np.random.default_rng(3)
    wrong = [data[:n] for n in range(0, len(data), 7)]
    wrong += [
        data + b"\0",
        data + data,
        b"",
        rng.bytes(len(data)),
        bytes(len(data)),
        data[:64] + rng.bytes(len(data) - 64),
    ]
    for bytes_ in wrong:
        status, state = running.deserialise(bytes_)
        assert status == ERROR
        assert not state.value
        assert "state" in running.log[-1].message


def test_states_of_another_fmu_are_refused(load: Callable[..., Library]) -> None:
    donors = [load("2"), load("3"), load("3-scalar"), load("3", "single")]
    for here in donors:
        instance = here.instance()
        for donor in donors:
            status, _ = instance.deserialise(donor.instance().serialise())
            assert status == (OK if donor is here else ERROR)


def test_a_saved_state_can_be_taken_again_and_freed_once(running) -> None:
    state = running.save()
    first = state.value
    running.step(0.07, 0.01)
    name = "GetFMUstate" if running.version == 2 else "GetFMUState"
    assert running.call(name, byref(state)) == OK
    assert state.value
    assert running.restore(state) == OK
    assert running.free_state(state) == OK
    assert state.value is None
    assert running.free_state(state) == OK
    assert first


def test_memory_that_is_no_state_is_refused(running) -> None:
    rubbish = ctypes.create_string_buffer(b"\x5a" * 4096)
    assert running.restore(ctypes.cast(rubbish, c_void_p)) == ERROR
    pointer = ctypes.cast(rubbish, c_void_p)
    assert running.free_state(pointer) == ERROR
    name = "GetFMUstate" if running.version == 2 else "GetFMUState"
    assert running.call(name, byref(pointer)) == ERROR
    assert running.restore(c_void_p()) == ERROR
    assert running.call(name, None) == ERROR


def test_a_buffer_too_small_for_a_state_is_refused(running) -> None:
    upper = "FMUstate" if running.version == 2 else "FMUState"
    state, size = running.save(), c_size_t()
    assert running.call(f"Serialized{upper}Size", state, byref(size)) == OK
    assert running.call(f"Serialized{upper}Size", state, None) == ERROR
    buffer = ctypes.create_string_buffer(size.value)
    assert running.call(f"Serialize{upper}", state, buffer, c_size_t(size.value - 1)) == ERROR
    assert running.call(f"Serialize{upper}", state, None, size) == ERROR
    assert running.call(f"Serialize{upper}", c_void_p(), buffer, size) == ERROR
    assert running.free_state(state) == OK


def test_a_state_carries_phase_time_and_parameters(library: Library) -> None:
    instance = library.instance().run(5.0, kp=0.7, accel=[0, 0, -9.8])
    instance.step(5.0, 0.013)
    instance.set("ki", 0.02)
    state = instance.save()
    assert instance.call("Reset") == OK
    assert instance.restore(state) == OK
    assert instance.get("time") == 5.013
    np.testing.assert_array_equal([*instance.get("kp"), *instance.get("ki")], [0.7, 0.02])
    assert instance.step(5.013, 0.01) == OK


def test_a_state_remembers_the_parameters_to_fall_back_to(library: Library) -> None:
    instance = library.instance().run(kp=0.7)
    instance.set("kp", 500.0)
    state = instance.save()
    assert instance.call("Reset") == OK
    assert instance.restore(state) == OK
    assert instance.step(0.0, 0.01) == ERROR
    assert instance.get("kp") == 0.7
