"""How connections were verified, as a report's table."""

from bench.i18n.language import translator
from reports.document.wiring import wiring_table

COLOURS = {"A": "white", "B": "green", "C": "black"}
BRIDGE = {
    "terminals": {"A": "lcr_high", "B": "lcr_low", "C": "open"},
    "by": "lcr_meter",
    "read": {"resistance": 0.0243},
}
PROBED = {
    "terminals": {"A": "open", "B": "open", "C": "open"},
    "probes": [{"channel": 1, "positive": "A", "negative": "star"}],
    "by": "oscilloscope",
    "read": {},
}
CHECKS = [
    {**BRIDGE, "outcome": "wrong", "reason": "", "possible": [{"kind": "joined", "terminals": ["C"]}]},
    {**BRIDGE, "outcome": "verified", "reason": "", "possible": [{"kind": "exchanged", "terminals": ["A", "B"]}]},
    # As records of earlier versions have it.
    {**PROBED, "outcome": "not proved", "reason": "weak", "possible": []},
]


def test_each_check_is_a_row():
    table = wiring_table(CHECKS, COLOURS)
    # Either may be a whole sentence: neither may take the other's room.
    assert [column.wide for column in table.columns] == [True, False, True]
    assert [[str(cell) for cell in row.cells] for row in table.rows] == [
        [
            "A → LCR meter, high; B → LCR meter, low",
            "LCR meter",
            "connection wrong: C (black) is connected, and should be open",
        ],
        ["A → LCR meter, high; B → LCR meter, low", "LCR meter", "connection verified"],
        [
            "all terminals open; channel 1: tip on terminal A, "
            "reference on the artificial star point (three equal resistors, 20 kΩ)",
            "Oscilloscope",
            "connection not verified: the signal is too small for the instrument's resolution",
        ],
    ]
    chinese = translator("zh")
    said = table.rows[0].cells[2].render(chinese)
    assert "C（黑" in said
    assert "悬空" in said


def test_a_procedure_without_connections_has_no_table():
    assert wiring_table([], COLOURS) is None
