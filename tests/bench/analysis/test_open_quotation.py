"""Tables of load points in which a quotation mark is not closed."""

import pytest

from bench.analysis.efficiency_table import analyze_efficiency
from bench.i18n.errors import InputError


@pytest.mark.parametrize(
    ("rows", "line"),
    [
        (('torque_Nm,"speed_rpm,power_W', "1.2,1464,240", "1.3,2641,390"), 1),
        (("torque_Nm,speed_rpm,power_W", "1.2,1464,240", '1.3,"2641,390', "1.4,2700,420"), 3),
    ],
)
def test_a_quotation_mark_that_is_not_closed_is_said_with_its_line(tmp_path, rows, line):
    path = tmp_path / "points.csv"
    path.write_text("\n".join(rows) + "\n")
    with pytest.raises(InputError, match=f"line {line}: a quotation mark is not closed"):
        analyze_efficiency(path)
