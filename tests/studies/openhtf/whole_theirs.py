"""OpenHTF's whole framework, by the Python that has it: one test a motor, its JSON file synced to the disk, as ours are.

Prints a motor's serial number when its test has returned.
"""

import logging
import os
import sys

import openhtf as htf
from openhtf.output.callbacks import json_factory

FOLDER, MOTORS, COUNT = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
logging.disable(logging.CRITICAL)


@htf.measures(*(htf.Measurement(f"parameter_{n:02d}").in_range(0.9 * (n + 1), 1.1 * (n + 1)) for n in range(COUNT)))
def measure(test: htf.TestApi) -> None:
    for n in range(COUNT):
        test.measurements[f"parameter_{n:02d}"] = (n + 1) * 1.01


def synced(record: htf.TestRecord) -> None:
    json_factory.OutputToJSON(FOLDER + "/{dut_id}.json")(record)
    for path in (f"{FOLDER}/{record.dut_id}.json", FOLDER):
        descriptor = os.open(path, os.O_RDONLY)
        os.fsync(descriptor)
        os.close(descriptor)


def main() -> None:
    for number in range(1, MOTORS + 1):
        test = htf.Test(measure, test_name="motor")
        test.add_output_callbacks(synced)
        serial = f"P-{number:07d}"
        if not test.execute(test_start=lambda serial=serial: serial):
            raise SystemExit("OpenHTF's test did not pass")
        print(serial, flush=True)


if __name__ == "__main__":
    main()
