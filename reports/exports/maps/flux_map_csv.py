"""CSV of a flux map: its measured points with their uncertainties, both signs of i_q."""

import csv
import io

from reports.exports.maps.interpolation import map_of
from reports.exports.target import Sheet, Target

COLUMNS = ("id_A", "iq_A", "psi_d_Vs", "psi_q_Vs", "u_psi_d_Vs", "u_psi_q_Vs")


def write(sheet: Sheet) -> str:
    """Return a heading and a row a measured current, lines ended as RFC 4180 has it."""
    stream = io.StringIO()
    writer = csv.writer(stream)
    writer.writerow(COLUMNS)
    writer.writerows([f"{value:.12g}" for value in row] for row in map_of(sheet).points)
    return stream.getvalue()


TARGET = Target("flux-map-csv", "CSV of the flux map", ".csv", (), write, of_map=True)
