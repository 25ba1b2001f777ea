"""OpenHTF's writer, run by the Python that has it: one test a motor, 30 numeric measurements with limits, a JSON file each.

Prints a motor's serial number when its test has returned, its output written.
"""

import itertools
import logging
import sys

import openhtf as htf
from openhtf.output.callbacks import json_factory

COUNT = 30
logging.disable(logging.CRITICAL)


@htf.measures(*(htf.Measurement(f"parameter_{n:02d}").in_range(0.9 * (n + 1), 1.1 * (n + 1)) for n in range(COUNT)))
def measure(test: htf.TestApi) -> None:
    for n in range(COUNT):
        test.measurements[f"parameter_{n:02d}"] = (n + 1) * 1.01


def main() -> None:
    folder, motors = sys.argv[1], int(sys.argv[2])
    for number in itertools.islice(itertools.count(1), motors or None):
        test = htf.Test(measure, test_name="motor")
        test.add_output_callbacks(json_factory.OutputToJSON(folder + "/{dut_id}.json"))
        serial = f"P-{number:07d}"
        if not test.execute(test_start=lambda serial=serial: serial):
            raise SystemExit("OpenHTF's test did not pass")
        print(serial, flush=True)


if __name__ == "__main__":
    main()
