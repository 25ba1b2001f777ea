"""`python -m bench` is `motorbench`."""

from bench.cli.main import main

if __name__ == "__main__":
    main()
