"""A client that reads the oscilloscope's record as fast as it can: `python -m tests.benchmarks.reader PORT`."""

import socket
import sys

SETTING = b":TIM:RANG 0.0008;:WAV:POIN:MODE RAW;:WAV:POIN 4000000;:WAV:FORM ASC;:SING;*OPC?\n"


def read(port: int) -> None:
    """Read records until the process ends; an empty JSON object is printed once the first one has come."""
    buffer = bytearray(1 << 20)
    with socket.create_connection(("127.0.0.1", port)) as scope:
        scope.sendall(SETTING)
        scope.recv(2, socket.MSG_WAITALL)
        told = False
        while True:
            scope.sendall(b":WAV:DATA?\n")
            left = int(scope.recv(10, socket.MSG_WAITALL)[2:]) + 1
            while left:
                left -= scope.recv_into(buffer, min(left, len(buffer)))
            if not told:
                print("{}", flush=True)
                told = True


if __name__ == "__main__":
    read(int(sys.argv[1]))
