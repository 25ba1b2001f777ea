"""`python -m motorbench` is `motorbench`."""

import os
import sys
from typing import NoReturn

from motorbench import shadowed

#: What is fitted here is small: further threads of linear algebra wait for each other, at full load, for longer than they compute.
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> None:
    """Run the command line, or say in one sentence which module stands in front of one of ours."""
    for variable in _THREADS:
        # Before NumPy is imported, which reads them once.
        os.environ.setdefault(variable, "1")
    if sentence := shadowed():
        _end(sentence)
    try:
        from bench.cli.main import main as run
    except KeyboardInterrupt:
        # What is imported takes a second on a slow machine: nothing is open yet.
        _end("interrupted by Ctrl-C")
    run()


def _end(sentence: str) -> NoReturn:
    if "--json" in sys.argv:
        import json

        print(json.dumps({"error": sentence}))
    sys.exit(f"motorbench: {sentence}")


if __name__ == "__main__":
    main()
