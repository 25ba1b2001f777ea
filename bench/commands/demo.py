"""`motorbench demo`: every procedure on the virtual bench."""

from pathlib import Path

from bench.commands.run import run


def demo(
    *,
    motor: str = "lg-400w",
    seed: int = 0,
    json: bool = False,
    language: str = "auto",
    runs: Path = Path("runs"),
    faults: Path | None = None,
    fault: tuple[str, ...] = (),
) -> int:
    """Measure a virtual motor by every procedure and print the summary beside the truth.

    Parameters
    ----------
    motor
        A motor file with a table [virtual], or the name of a shipped motor: lg-400w, ipmsm, outrunner-delta, gimbal, drone.
    seed
        Seed of noise and of the operator's hand: one seed, the same figures to the last digit.
    json
        Print one JSON object and nothing else.
    language
        en, zh, or auto by the locale.
    runs
        Folder in which the run's own folder is made.
    faults
        A file of faults to inject.
    fault
        One fault in a few words, like "supply: silence at step 3.2.2/3"; may be given several times.

    """
    return run(
        "all",
        station="virtual",
        motor=motor,
        seed=seed,
        json=json,
        language=language,
        runs=runs,
        faults=faults,
        fault=fault,
    )
