"""Efficiency, bias and coverage of every estimator: `python -m tests.studies.estimators --trials N`."""

import argparse

from tests.studies.worlds.simulated import false_saliency, reported, score, simple


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    print(f"{'estimator':<48}{'efficiency':>11}{'bias/sd':>9}{'coverage':>10}   ({given.trials} trials)")
    for case in (*reported(), *simple()):
        found = score(case, given.trials, given.seed)
        print(f"{found.name:<48}{found.efficiency:>11.3g}{found.bias:>9.2f}{100 * found.coverage:>9.1f}%", flush=True)
    for timed in (False, True):
        share = false_saliency(given.trials, timed=timed)
        print(
            f"false saliency, {'turned by hand' if timed else 'known angle'}: {100 * share:.1f} % (at most 5 %)",
            flush=True,
        )


if __name__ == "__main__":
    main()
