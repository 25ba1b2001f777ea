"""HardPy, by the Python that has it: as its panel does, pytest is started for each motor; its JSON store is synced at the end.

Prints a motor's serial number when its report is kept.
"""

import os
import subprocess
import sys
from pathlib import Path

TEST = """
import os
import hardpy

def test_motor():
    hardpy.set_dut_serial_number(os.environ["SERIAL"])
    for n in range(COUNT):
        value = hardpy.NumericMeasurement(
            value=(n + 1) * 1.01, name=f"parameter_{n:02d}", operation=hardpy.ComparisonOperation.GELE,
            lower_limit=0.9 * (n + 1), upper_limit=1.1 * (n + 1))
        hardpy.set_case_measurement(value)
"""


def main() -> None:
    folder, motors, count = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    (folder / "hardpy.toml").write_text('title = "x"\ntests_name = "x"\n[database]\nstorage_type = "json"\n')
    (folder / "pytest.ini").write_text("[pytest]\n")
    (folder / "test_motor.py").write_text(f"COUNT = {count}\n{TEST}")
    for number in range(1, motors + 1):
        serial = f"P-{number:07d}"
        command = [sys.executable, "-m", "pytest", "-q", "--hardpy-pt", "--hardpy-config-file", str(folder)]
        done = subprocess.run(
            command, cwd=folder, env=os.environ | {"SERIAL": serial}, capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise SystemExit(done.stdout + done.stderr)
        reports = [path for path in folder.rglob("*.json") if "_hardpy" not in path.name]
        if not any(serial in path.read_text() for path in reports):
            raise SystemExit(f"{serial}: there is no report of it among {[str(path) for path in folder.rglob('*')]}")
        for path in reports:
            descriptor = os.open(path, os.O_RDONLY)
            os.fsync(descriptor)
            os.close(descriptor)
        print(serial, flush=True)


if __name__ == "__main__":
    main()
