"""`python -m motorbench` is `motorbench`."""

import sys
from typing import NoReturn

from motorbench import shadowed


def main() -> None:
    """Run the command line, or say in one sentence which module stands in front of one of ours."""
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
