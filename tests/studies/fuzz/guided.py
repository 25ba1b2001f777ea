"""One target under atheris, in a process of its own: libFuzzer ends it when the time is over or something is found."""

import sys

import atheris

#: What is watched for new branches: ours, and the parsers in Python beneath it.
_WATCHED = [
    "bench", "drivers", "procedures", "reports", "sim_instruments", "tomllib", "pymodbus.framer", "pymodbus.pdu", "canopen.sdo",
]  # fmt: skip


def main() -> None:
    """`NAME [libFuzzer's own options] [corpus]`."""
    name, *options = sys.argv[1:]
    with atheris.instrument_imports(include=_WATCHED, enable_loader_override=False):
        from tests.studies.fuzz.catalogue import find
        from tests.studies.fuzz.target import check

        target = find(name)

    def one_input(data: bytes) -> None:
        check(target, data)

    atheris.Setup([sys.argv[0], *options], one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
