"""The loop that answers an FMU's messages."""

from __future__ import annotations

import signal
import struct
import sys
import traceback
from pathlib import Path

import numpy as np

from ahrs_fmu.errors import DescriptorError
from ahrs_fmu.serve.channel import HEAD, MAGIC, PROTOCOL, Channel, Kind, framed
from ahrs_fmu.serve.model import Model, Numbers, load, size, slots

_RUN_HEAD = struct.Struct("<dII")
_OPEN = struct.Struct("<IIII")
_LONGEST_TEXT = 3000
"""Bytes of a traceback that fit into a line of the FMU's log; its end tells most."""


class Server:
    """A model with the messages it has been sent.

    Parameters
    ----------
    model : Model
        The model.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self.counts = tuple(size(slots(model.descriptor, role)) for role in ("parameter", "input", "output"))
        self._n_parameters, self._n_inputs, n_outputs = self.counts
        self._reply = bytearray(HEAD.pack(MAGIC, Kind.REPLY, 8 * n_outputs) + bytes(8 * n_outputs))
        self._outputs = np.frombuffer(self._reply, dtype=np.float64, offset=HEAD.size)

    def answer(self, kind: int, payload: memoryview) -> bytes | bytearray:
        """Do what a message asks for and give the message to send back."""
        if kind == Kind.SAVE:
            return framed(Kind.REPLY, self._model.save())
        if kind == Kind.RESTORE:
            self._model.restore(bytes(payload))
            return framed(Kind.REPLY, b"")
        if kind == Kind.RUN:
            dt, ticks, n_parameters = _RUN_HEAD.unpack_from(payload)
            numbers = _numbers(payload[_RUN_HEAD.size :])
            if n_parameters:
                self._model.tune(numbers[self._n_inputs :])
            self._model.run(numbers[: self._n_inputs], ticks, dt)
        elif kind == Kind.START:
            numbers = _numbers(payload)
            self._model.start(numbers[: self._n_parameters], numbers[self._n_parameters :])
        elif kind == Kind.OUTPUTS:
            self._model.tune(_numbers(payload))
        else:
            raise ValueError(f"message of unknown kind {kind}")
        self._model.outputs(self._outputs)
        return self._reply


def _numbers(payload: memoryview) -> Numbers:
    return np.frombuffer(payload, dtype=np.float64).copy()


def _open(folder: Path, payload: memoryview) -> Server:
    protocol, *counts = _OPEN.unpack(payload)
    if protocol != PROTOCOL:
        raise DescriptorError("the FMU was built by another version of ahrs-fmu: build it again")
    server = Server(load(folder))
    if server.counts != tuple(counts):
        raise DescriptorError("the FMU's library and its resources do not belong together: build it again")
    return server


def _raised(error: BaseException) -> bytes:
    """Report an error by its traceback, from where this package called the model."""
    own = str(Path(__file__).parent)
    trace = error.__traceback__
    while (
        trace is not None and trace.tb_next is not None and trace.tb_frame.f_code.co_filename.startswith(own)
    ):
        trace = trace.tb_next
    text = "".join(traceback.format_exception(type(error), error, trace)).rstrip().encode(errors="replace")
    if len(text) > _LONGEST_TEXT:
        # The cut may have gone through a character.
        text = b"..." + text[-_LONGEST_TEXT:].decode(errors="ignore").encode()
    return framed(Kind.RAISED, text)


def main(arguments: list[str]) -> None:
    """Answer messages until the importer closes the channel."""
    if len(arguments) != 1:
        sys.exit("usage: python -m ahrs_fmu.serve RESOURCES (started by an FMU)")
    # An interrupt from the keyboard is the importer's to handle; it closes the channel when it ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    channel = Channel()
    server: Server | None = None
    while (message := channel.receive()) is not None:
        kind, payload = message
        try:
            if server is None:
                server = _open(Path(arguments[0]), payload)
                reply: bytes | bytearray = framed(Kind.REPLY, b"")
            else:
                reply = server.answer(kind, payload)
        # The model's code may raise anything, also SystemExit.
        except BaseException as error:
            reply = _raised(error)
        channel.send(reply)


if __name__ == "__main__":
    main(sys.argv[1:])
