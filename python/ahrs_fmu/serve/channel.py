"""Messages with the FMU's library, whose side is `fmu_src/python_model/engine_python.c`."""

from __future__ import annotations

import os
import select
import struct
import sys
import threading
from enum import IntEnum
from io import FileIO

MAGIC = 0x53524841
PROTOCOL = 1
HEAD = struct.Struct("<IIQ")


class Kind(IntEnum):
    """What a message asks for, or that it answers."""

    OPEN = 1
    START = 2
    RUN = 3
    OUTPUTS = 4
    SAVE = 5
    RESTORE = 6
    REPLY = 100
    RAISED = 101


class Channel:
    """Standard input (and on Windows standard output), taken away from the model's code.

    What the model prints goes to the error stream, and its standard input is empty.
    """

    def __init__(self) -> None:
        self._reader = FileIO(os.dup(0), "rb")
        self._writer = FileIO(os.dup(1 if os.name == "nt" else 0), "wb")
        self._buffer = bytearray(1 << 16)
        self._filled = 0
        nothing = os.open(os.devnull, os.O_RDONLY)
        os.dup2(nothing, 0)
        os.close(nothing)
        os.dup2(2, 1)
        if hasattr(select, "poll"):
            threading.Thread(target=self._end_with_importer, daemon=True).start()

    def _end_with_importer(self) -> None:
        """End this process when the importer is gone, even in the middle of an endless update."""
        poll = select.poll()
        poll.register(self._reader.fileno(), 0)
        poll.poll()
        # The main thread ends in order; if it cannot, nobody waits for it.
        threading.Event().wait(1.0)
        os._exit(1)

    def receive(self) -> tuple[int, memoryview] | None:
        """Kind and payload of the next message, valid until the one after; None when the importer is done."""
        if not self._fill(0, HEAD.size):
            return None
        magic, kind, size = HEAD.unpack_from(self._buffer)
        if magic != MAGIC:
            sys.exit("ahrs_fmu.serve is started by an FMU, not by hand")
        end = HEAD.size + size
        if end > len(self._buffer):
            self._buffer = self._buffer[: self._filled] + bytearray(end - self._filled)
        if not self._fill(self._filled, end):
            return None
        return kind, memoryview(self._buffer)[HEAD.size : end]

    def _fill(self, start: int, end: int) -> bool:
        view = memoryview(self._buffer)
        while start < end:
            n = self._reader.readinto(view[start:])
            if not n:
                return False
            start += n
        self._filled = start
        return True

    def send(self, message: bytes | bytearray | memoryview) -> None:
        """Send a whole message, head and payload."""
        rest = memoryview(message)
        while rest:
            rest = rest[self._writer.write(rest) :]


def framed(kind: Kind, payload: bytes) -> bytes:
    """A message."""
    return HEAD.pack(MAGIC, kind, len(payload)) + payload
