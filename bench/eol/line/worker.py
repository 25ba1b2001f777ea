"""A socket's process: it measures one motor after the other and hands their records over.

`python -m bench.eol.line.worker CONNECTION` is how the coordinator starts it, with the connection's file descriptor.
"""

import os
import signal
import sys
from contextlib import suppress
from multiprocessing.connection import Connection

from bench.eol.line.messages import Broken, Done, Ready, Setup


def main() -> None:
    """Measure what the coordinator sends until it sends no more."""
    # Ctrl-C is the coordinator's to take; it says what to do.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    connection = Connection(int(sys.argv[1]))
    setup = connection.recv()
    if not isinstance(setup, Setup):
        sys.exit("motorbench line worker: no set-up on its connection; it is started by motorbench eol run")
    # Heavy from here on.
    from bench.eol.line.channel import Channel
    from bench.eol.line.passage import Socket
    from bench.errors import InputError

    try:
        socket = Socket(setup)
    except InputError as error:
        connection.send(Broken(str(error)))
        return
    channel = Channel(connection, socket.stop)
    socket.channel = channel
    with suppress(OSError):
        channel.send(Ready())
        while (task := channel.task()) is not None:
            record, time = socket.measure(task)
            channel.send(Done(record, time))
    sys.stdout.flush()
    sys.stderr.flush()
    # Whatever a library has left running must not keep it here.
    os._exit(0)


if __name__ == "__main__":
    main()
