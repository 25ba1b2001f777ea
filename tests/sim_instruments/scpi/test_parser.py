import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.scpi.errors import ErrorQueue, ScpiError
from sim_instruments.scpi.exchange import NoReplyError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.lexer import parse_unit, split_messages, split_units
from sim_instruments.scpi.parameters import boolean, channel_list, choice, choices, exactly, forms, number, string
from sim_instruments.scpi.tree import Call


class Toy(ScpiInstrument):
    """A small instrument: a voltage, a protection, channels and a block."""

    def __init__(self) -> None:
        super().__init__(VirtualClock(), np.random.default_rng(0), "MAKER,TOY,1,2", queue_depth=5)
        self.voltage = 1.0
        self.scales = {1: 1.0, 2: 2.0}
        self.text = ""
        self.protection = False
        self.tree.add(
            "[SOURce]:VOLTage[:LEVel][:IMMediate][:AMPLitude]", command=self.set_voltage, query=self.get_voltage
        )
        self.tree.add("[SOURce]:VOLTage:PROTection:STATe", command=self.set_protection, query=self.get_protection)
        self.tree.add("CHANnel<n>:SCALe", command=self.set_scale, query=self.get_scale)
        self.tree.add("DISPlay:TEXT", command=self.set_text, query=lambda _: f'"{self.text}"')
        self.tree.add("CURVe", query=lambda _: b"#14\n;\x00,")

    def reset(self) -> None:
        self.voltage = 1.0

    def set_voltage(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self.voltage = number(call.arguments[0], 0.0, 10.0, default=5.0, unit="V")

    def get_voltage(self, _: Call) -> str:
        return f"{self.voltage:+.3E}"

    def set_protection(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self.protection = boolean(call.arguments[0])

    def get_protection(self, _: Call) -> str:
        return str(int(self.protection))

    def set_scale(self, call: Call) -> None:
        exactly(call.arguments, 1)
        if call.channel not in self.scales:
            raise ScpiError(-114)
        self.scales[call.channel] = number(call.arguments[0], 0.0, 100.0)

    def get_scale(self, call: Call) -> str:
        return f"{self.scales[call.channel]:g}"

    def set_text(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self.text = string(call.arguments[0])

    def ask(self, message: str) -> bytes:
        self.write(message.encode("latin-1"))
        return self.read(10_000, 1.0)[0]

    def first_error(self) -> int:
        return int(self.ask("SYST:ERR?").split(b",")[0])


@pytest.mark.parametrize(
    "message",
    [
        "VOLT 2.5",
        "volt 2.5",
        "VOLTage 2.5",
        ":SOURce:VOLTage:LEVel:IMMediate:AMPLitude 2.5",
        "sour:volt:ampl 2500 mv",
        "VOLT:LEV 2.5V",
        "  VOLT\t2.5e0 \r",
        "VOLT #B10;VOLT 2.5",
        "VOLT .25E+1",
    ],
)
def test_spellings_of_one_command(message: str) -> None:
    toy = Toy()
    assert toy.ask(message + ";:VOLT?") == b"+2.500E+00\n"
    assert toy.first_error() == 0


@pytest.mark.parametrize("wrong", ["VOLTA 1", "VOLTAG 1", "SOURC:VOLT 1", "VOLT:PROT 1", "*RSTX", "VOLT:PROT:STAT:X 1"])
def test_what_is_neither_short_nor_long_is_undefined(wrong: str) -> None:
    toy = Toy()
    toy.write(wrong.encode())
    assert toy.ask("SYST:ERR?") == b'-113,"Undefined header"\n'


def test_the_path_of_a_compound_stays_until_a_colon() -> None:
    toy = Toy()
    assert toy.ask("SOUR:VOLT:PROT:STAT 1;*CLS;STAT?;:VOLT 3;VOLT?") == b"1;+3.000E+00\n"
    toy.write(b"SOUR:VOLT:PROT:STAT 1;VOLT 3")
    assert toy.first_error() == -113


def test_a_header_may_hold_a_number_of_its_own() -> None:
    toy = Toy()
    toy.tree.add("PARameter1", query=lambda _: "RS")
    assert toy.ask("PAR1?;:parameter1?") == b"RS;RS\n"
    toy.write(b"PAR2?")
    assert toy.first_error() == -113


def test_numeric_suffixes() -> None:
    toy = Toy()
    assert toy.ask("CHAN2:SCAL 7;:CHAN:SCAL 3;:channel1:scale?;:CHANNEL2:SCAL?") == b"3;7\n"
    toy.write(b"CHAN3:SCAL 1")
    assert toy.first_error() == -114
    toy.write(b"VOLT2 1")
    assert toy.first_error() == -114


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ("VOLT", -109),
        ("VOLT 1,2", -108),
        ("VOLT 11", -222),
        ("VOLT -0.1", -222),
        ("VOLT 1 A", -131),
        ("CHAN1:SCAL 1 V", -138),
        ("VOLT ABC", -141),
        ("VOLT 'ABC'", -158),
        ("VOLT (@1)", -178),
        ("VOLT 1.2.3", -121),
        ("VOLT,1", -103),
        ("VOLT 1e999", -123),
        ("DISP:TEXT 5", -104),
        ('DISP:TEXT "a', -151),
        ("VOLT #15ab", -161),
        ("VOLT #", -161),
        ("VOLT (@1", -171),
        ("@VOLT 1", -102),
        ("\x80VOLT", -101),
        ("CURV 1", -113),
        ("*IDN", -113),
    ],
)
def test_errors_have_the_standards_numbers(message: str, error: int) -> None:
    toy = Toy()
    toy.write(message.encode("latin-1"))
    assert toy.first_error() == error
    assert toy.first_error() == 0
    assert toy.voltage == 1.0


def test_strings_keep_separators_and_doubled_quotes() -> None:
    toy = Toy()
    toy.write(b'DISP:TEXT "a;b,c ""d"" \'e\'";:VOLT 2')
    assert toy.text == "a;b,c \"d\" 'e'"
    assert toy.voltage == 2.0


def test_a_block_keeps_every_byte() -> None:
    assert Toy().ask("CURV?;*IDN?") == b"#14\n;\x00,;MAKER,TOY,1,2\n"
    assert split_messages(b"A #15\n;,\r\n\nB?\n") == ["A #15\n;,\r\n", "B?"]
    assert parse_unit("A #15\n;,\r\n").arguments[0].text == "\n;,\r\n"


def test_minimum_maximum_default() -> None:
    toy = Toy()
    assert toy.ask("VOLT MIN;VOLT?;VOLT MAXimum;VOLT?;VOLT DEF;VOLT?") == b"+0.000E+00;+1.000E+01;+5.000E+00\n"


def test_event_status_follows_the_kind_of_error() -> None:
    toy = Toy()
    assert toy.ask("*ESR?") == b"+128\n"
    toy.write(b"FOO")
    assert toy.ask("*ESR?") == b"+32\n"
    toy.write(b"VOLT 99")
    assert toy.ask("*ESR?;*ESR?") == b"+16;+0\n"
    toy.write(b"*ESE 16;*SRE 32;VOLT 99")
    assert toy.status_byte() == 0x60
    toy.write(b"*IDN?")
    assert toy.status_byte() == 0x70
    toy.write(b"*CLS")
    assert toy.status_byte() == 0x00
    assert toy.ask("*ESE?;*SRE?") == b"+16;+32\n"


def test_an_unread_reply_is_interrupted_and_lost() -> None:
    toy = Toy()
    toy.write(b"VOLT?")
    assert toy.ask("*IDN?") == b"MAKER,TOY,1,2\n"
    assert toy.first_error() == -410


def test_reading_without_a_query_is_unterminated_after_the_time_out() -> None:
    toy = Toy()
    with pytest.raises(NoReplyError):
        toy.read(10, 3.0)
    assert toy.clock.now() == 3.0
    assert toy.first_error() == -420


def test_a_message_may_come_in_pieces() -> None:
    toy = Toy()
    toy.write(b"VO", end=False)
    toy.write(b"LT 4;VOLT?")
    assert toy.read(3, 1.0)[0] + toy.read(100, 1.0)[0] == b"+4.000E+00\n"


def test_device_clear_forgets_the_reply() -> None:
    toy = Toy()
    toy.write(b"*IDN?")
    toy.clear()
    assert toy.ask("VOLT?") == b"+1.000E+00\n"
    assert toy.first_error() == 0


def test_the_error_queue_is_bounded_and_says_so() -> None:
    queue = ErrorQueue(3)
    for _ in range(10):
        queue.push(ScpiError(-113))
    assert [queue.pop().number for _ in range(4)] == [-113, -113, -350, 0]


def test_channel_lists() -> None:
    def parse(text: str) -> tuple[int, ...]:
        return channel_list(parse_unit(f"X {text}").arguments[0], 3)

    assert parse("(@1)") == (1,)
    assert parse("(@ 1 , 3)") == (1, 3)
    assert parse("(@1:3)") == (1, 2, 3)
    assert parse("(@3:2,1)") == (3, 2, 1)
    for text, error in (("(@4)", -222), ("(@0)", -222), ("(1)", -171), ("(@)", -171), ("(@1;2)", -171), ("1", -104)):
        with pytest.raises(ScpiError) as caught:
            parse(text)
        assert caught.value.number == error


def test_choices_reply_with_the_short_form() -> None:
    table = choices(("INTernal", "BUS"))
    assert choice(parse_unit("X internal").arguments[0], table) == "INT"
    with pytest.raises(ScpiError):
        choice(parse_unit("X INTER").arguments[0], table)


_MNEMONICS = ("SOURce", "VOLTage", "LEVel", "AMPLitude")


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 2**12)), min_size=4, max_size=4), st.booleans())
def test_any_case_of_either_form_is_equal(spelling: list[tuple[bool, int]], colon: bool) -> None:
    def spell(mnemonic: str, long: bool, case: int) -> str:
        text = forms(mnemonic)[long]
        return "".join(c.lower() if case >> i & 1 else c for i, c in enumerate(text))

    header = ":".join(spell(name, *how) for name, how in zip(_MNEMONICS, spelling, strict=True))
    assert Toy().ask(f"{':' if colon else ''}{header} 4;:VOLT?") == b"+4.000E+00\n"


_FRAGMENTS = st.sampled_from(
    [
        "VOLT",
        "VOLT?",
        ":",
        ";",
        " ",
        ",",
        "*IDN?",
        "*OPC?",
        "1",
        "-2.5E3",
        "'",
        '"',
        "(",
        "(@1:2)",
        ")",
        "#",
        "#0",
        "#15",
        "#9",
        "CHAN2:SCAL",
        "*ESR?",
        "*STB?",
        "\n",
        "\r",
        "\x00",
        "é",
        "MIN",
        "mV",
        "CURV?",
        "SYST:ERR?",
        "?",
        "@",
        "#HFF",
    ]
)


@given(
    st.one_of(st.binary(max_size=200), st.lists(_FRAGMENTS, max_size=30).map(lambda x: "".join(x).encode("latin-1")))
)
def test_nothing_upsets_the_parser(data: bytes) -> None:
    toy = Toy()
    toy.write(data)
    assert len(toy.errors) <= 5
    toy.clear()
    toy.write(b"*CLS")
    assert toy.ask("*IDN?;:SYST:ERR?") == b'MAKER,TOY,1,2;+0,"No error"\n'


@given(st.text(alphabet=st.characters(codec="latin-1", exclude_characters="\n"), max_size=60))
def test_units_rejoin_to_their_message(text: str) -> None:
    # Splitting loses nothing but the separators and the white space round them.
    blanks = {chr(code) for code in range(33)}
    kept = "".join(c for c in "".join(split_units(text)) if c not in blanks | {";"})
    assert kept == "".join(c for c in text if c not in blanks | {";"})


@given(st.floats(0.0, 10.0))
def test_numbers_survive_their_text(value: float) -> None:
    argument = parse_unit(f"X {value!r}").arguments[0]
    assert number(argument, 0.0, 10.0) == value
    milli = parse_unit(f"X {value * 1000.0!r} MV").arguments[0]
    assert math.isclose(number(milli, 0.0, 10.0, unit="V"), value, rel_tol=1e-12, abs_tol=1e-12)


def test_every_header_is_listed_once_in_its_long_form() -> None:
    headers = Toy().tree.headers()
    assert ":SOURCE:VOLTAGE:LEVEL:IMMEDIATE:AMPLITUDE?" in headers
    assert "*IDN?" in headers
    assert len(headers) == len(set(headers))


def test_a_header_registered_twice_is_refused() -> None:
    toy = Toy()
    with pytest.raises(ValueError, match="twice"):
        toy.tree.add("VOLTage", query=lambda _: "1")
