"""`python -m motorbench` is `motorbench`."""

import sys

from motorbench import shadowed


def main() -> None:
    """Run the command line, or say in one sentence which module stands in front of one of ours."""
    if sentence := shadowed():
        if "--json" in sys.argv:
            import json

            print(json.dumps({"error": sentence}))
        sys.exit(f"motorbench: {sentence}")
    from bench.cli.main import main as run

    run()


if __name__ == "__main__":
    main()
