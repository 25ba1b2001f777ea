"""Inks and patterns of the drawings: nothing is told by a colour alone."""

INK = "#17202a"
PAPER = "#ffffff"
BODY = "#eef1f4"
STEEL = "#8895a1"
SHAFT = "#b9c4cd"
FLANGE = "#d5dce2"
#: What comes off.
GHOST = "#5b6874"
TAKE_OFF = "#b3121d"
#: What is new.
HALO = "#ffcf33"
#: What the person does.
ACT = "#0b4fa0"
#: The supply's plus, as its leads are sold.
PLUS = "#b3121d"

#: An oscilloscope's channel: its colour, dark enough for paper and for white letters, and its dashes.
CHANNELS = {
    "1": ("#855c00", ""),
    "2": ("#1b6e3c", "18 6"),
    "3": ("#0b4fa0", "18 5 4 5"),
    "4": ("#a8124f", ""),
}
REFERENCE_DASHES = "4 5"
GHOST_DASHES = "7 6"

FONT = "'Noto Sans','Noto Sans SC','Noto Sans CJK SC','Segoe UI',Roboto,Arial,'DejaVu Sans',sans-serif"
