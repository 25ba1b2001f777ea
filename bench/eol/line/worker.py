"""A socket's process: it measures one motor after the other and hands their records over."""

from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection

from bench.eol.line.messages import Broken, Done, Ready
from bench.eol.line.unit_test import Socket
from bench.eol.line.worker_channel import Channel
from bench.i18n.errors import InputError, said_by


def work(connection: Connection, lifeline: int, times: int, owner: int) -> None:
    """Measure what the coordinator sends until it sends no more; the others are descriptors of this process."""
    try:
        setup = connection.recv()
        place = replace(setup.place, lifeline=lifeline, times=times, owner=owner)
        socket = Socket(replace(setup, place=place))
    except (EOFError, ConnectionError):
        return
    except InputError as error:
        connection.send(Broken(said_by(error)))
        return
    channel = Channel(connection, socket.stop)
    socket.channel = channel
    with suppress(OSError):
        channel.send(Ready())
        while (task := channel.task()) is not None:
            record, time = socket.measure(task)
            channel.send(Done(record, time))
