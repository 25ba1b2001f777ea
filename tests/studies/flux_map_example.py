"""Make the flux map of the shipped motor `ipmsm-map`: `python -m tests.studies.flux_map_example bench/motors/ipmsm-map.csv`.

Not measured: with x = id + 80 A and y = iq, the fluxes are the slopes of the coenergy
½·(133.3 µH·x² + 90 µH·y²) + 1.168 J·(√(1 + (x/120 A)² + (y/60 A)²) − 1), which so is conserved and saturates across the axes.
"""

import argparse
from pathlib import Path

import numpy as np

from tests.sim_instruments.flux_maps import MadeMotor

EXAMPLE = MadeMotor(133.3e-6, 90e-6, 1.168, 120.0, 60.0, 80.0)


def table() -> str:
    """Return the map's file."""
    axis = np.linspace(-75.0, 75.0, 21)
    lines = [
        "# Made up, by python -m tests.studies.flux_map_example; no motor was measured.",
        "id_A,iq_A,psi_d_Vs,psi_q_Vs",
    ]
    for d in axis:
        for d_flux, q_flux, q in zip(*EXAMPLE.flux(np.full(len(axis), d), axis), axis, strict=True):
            # Without the sign of a zero.
            lines.append(f"{d:g},{q:g},{d_flux:.6e},{q_flux + 0.0:.6e}")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, help="the file to write")
    parser.parse_args().file.write_text(table(), encoding="utf-8")


if __name__ == "__main__":
    main()
