"""A model that misbehaves on command; exported as an FMU by the tests."""

import ctypes
import os
import signal
import socket
import sys
import time

import numpy as np

from ahrs_fmu.component import Component, Input, Limit, Output, Parameter

DEEDS = [
    "behave",
    "raise",
    "leave",
    "exit",
    "kill",
    "hang",
    "print",
    "chatter",
    "flood_and_raise",
    "garbage",
    "partial",
    "new_attribute",
    "wrong_size",
    "recurse",
]


class Troublesome(Component):
    """Sums its input, and does what it is told.

    The second paragraph has "quotes", a back\\slash, */ and /*, and µ.
    """

    deed = Input(
        "behave", choices={name: f"to {name}" for name in DEEDS}, description="What the next update does"
    )
    signal = Input(size=2, unit="m/s2", description="What is summed")
    total = Output(size=2, unit="m/s2", description="The sum")
    count = Output(0, integer=True, description="Number of updates")
    odd = Output(False, description="Whether that number is odd")
    shape = Output(
        "round", choices={"round": "like a ball", "flat": "like a plate"}, description="An enumeration"
    )
    gain = Parameter(1.0, min=0.0, max=10.0, tunable=True, description='Factor */ of the "input"')
    offsets = Parameter([0.5, 0.25], description="Where the sum begins")
    steps = Parameter(1, integer=True, min=1, max=9, description="Whole number")
    limits = (Limit("gain < 9 or steps == 1", 'a "large" gain goes with one step: lower \\ it'),)

    def initialise(self):
        self.total = self.offsets.copy()
        self.rng = np.random.default_rng(1)

    def update(self, dt):
        getattr(self, f"do_{self.deed}", lambda: None)()
        self.total = self.total + self.gain * dt * self.signal + 1e-3 * self.rng.standard_normal(2)
        self.count += self.steps
        self.odd = self.count % 2 == 1
        self.shape = "flat" if self.odd else "round"

    def do_raise(self):
        raise RuntimeError("the gyroscope has fallen off")

    def do_leave(self):
        sys.exit("enough")

    def do_exit(self):
        os._exit(7)

    def do_kill(self):
        os.kill(os.getpid(), signal.SIGKILL)

    def do_hang(self):
        while True:
            time.sleep(0.05)

    def do_print(self):
        print("hello from Python")
        sys.stdout.write("no newline")
        os.write(1, b" straight to the descriptor")
        ctypes.CDLL(None).puts(b"")

    def do_chatter(self):
        for _ in range(40):
            os.write(2, b"x" * 65536)
        print("last words")

    def do_flood_and_raise(self):
        os.write(2, b"y" * 500_000)
        raise RuntimeError("z" * 20_000)

    def channel(self):
        for fd in range(3, 64):
            try:
                duplicate = os.dup(fd)
            except OSError:
                continue
            try:
                return socket.socket(fileno=duplicate)
            except OSError:
                os.close(duplicate)
        raise AssertionError("no channel")

    def do_garbage(self):
        self.channel().send(b"HTTP/1.1 200 OK\r\n\r\n garbage garbage")

    def do_partial(self):
        self.channel().send(b"AHRS\x64\0")
        time.sleep(60)

    def do_new_attribute(self):
        self.totl = 1.0

    def do_wrong_size(self):
        self.total = [1.0, 2.0, 3.0]

    def do_recurse(self):
        self.do_recurse()
