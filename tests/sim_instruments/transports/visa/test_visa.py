import gc
import weakref
from collections.abc import Callable

import numpy as np
import pytest
import pyvisa
from pyvisa.constants import ResourceAttribute, StatusCode
from pyvisa.highlevel import VisaLibraryBase

from sim_instruments.bench import VirtualBench
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.faults.line_faults import Fault, FaultKind
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.tree import Call, Handling
from sim_instruments.transports.visa.library import InProcessVisaLibrary

NAME = "TCPIP0::box::inst0::INSTR"
BLOCK = bytes(range(256)) * 8000


class Box(ScpiInstrument):
    """Replies at once, after a while, and with a block."""

    def __init__(self, clock: VirtualClock) -> None:
        super().__init__(clock, np.random.default_rng(0), "MAKER,BOX,1,2")
        self.tree.add("SLOW", query=self.slow, command=self.slow_command)
        self.tree.add("BLOCk", query=lambda _: b"#8%08d" % len(BLOCK) + BLOCK)

    def reset(self) -> None:
        pass

    def slow(self, _: Call) -> Handling:
        yield self.clock.now() + 1.5
        return f"{self.clock.now():.1f}"

    def slow_command(self, _: Call) -> Handling:
        yield self.clock.now() + 1.5
        return None


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def box(clock: VirtualClock) -> Box:
    return Box(clock)


@pytest.fixture
def session(box: Box):
    library = InProcessVisaLibrary({NAME: box})
    manager = pyvisa.ResourceManager(library)
    with manager.open_resource(NAME, read_termination="\n", write_termination="\n") as resource:
        yield resource
    library.shut()


def test_a_query_and_its_status(session: pyvisa.resources.MessageBasedResource) -> None:
    assert session.query("*IDN?") == "MAKER,BOX,1,2"
    assert session.last_status == StatusCode.success_termination_character_read
    assert session.resource_name == NAME
    assert session.interface_type == pyvisa.constants.InterfaceType.tcpip


def test_a_silent_instrument_times_out_in_virtual_time(
    session: pyvisa.resources.MessageBasedResource, clock: VirtualClock
) -> None:
    session.timeout = 3000
    with pytest.raises(pyvisa.VisaIOError) as caught:
        session.read()
    assert caught.value.error_code == StatusCode.error_timeout
    assert clock.now() == 3.0
    assert session.query("SYST:ERR?").startswith("-420")


def test_without_a_time_out_nothing_hangs(session: pyvisa.resources.MessageBasedResource, clock: VirtualClock) -> None:
    session.timeout = None
    with pytest.raises(pyvisa.VisaIOError):
        session.read()
    assert clock.now() == 0.0


def test_a_slow_reply_takes_its_time(session: pyvisa.resources.MessageBasedResource, clock: VirtualClock) -> None:
    session.write("SLOW?")
    assert clock.now() == 0.0
    assert session.read() == "1.5"
    session.write("SLOW;*IDN?")
    assert session.read() == "MAKER,BOX,1,2"
    assert clock.now() == 3.0


def test_a_reply_later_than_the_time_out_can_still_be_read(
    session: pyvisa.resources.MessageBasedResource, clock: VirtualClock
) -> None:
    session.timeout = 1000
    session.write("SLOW?")
    with pytest.raises(pyvisa.VisaIOError):
        session.read()
    assert clock.now() == 1.0
    assert session.read() == "1.5"


def test_device_clear_gives_up_what_is_waited_for(session: pyvisa.resources.MessageBasedResource) -> None:
    session.write("SLOW?")
    session.clear()
    assert session.query("*IDN?;:SYST:ERR?") == 'MAKER,BOX,1,2;+0,"No error"'


def test_serial_poll_shows_the_message(session: pyvisa.resources.MessageBasedResource) -> None:
    assert session.read_stb() == 0
    session.write("SLOW?")
    assert session.read_stb() == 0
    session.read()
    session.write("*IDN?")
    assert session.read_stb() == 0x10


@pytest.mark.parametrize("chunk", [1, 7, 4096, 20_480, 1 << 22])
def test_blocks_arrive_whole_whatever_the_chunk(session: pyvisa.resources.MessageBasedResource, chunk: int) -> None:
    if chunk == 1:
        session.write("*IDN?")
        assert session.read_bytes(14, chunk_size=1) == b"MAKER,BOX,1,2\n"
        return
    session.read_termination = None
    session.write("BLOC?")
    data = session.read_bytes(10 + len(BLOCK) + 1, chunk_size=chunk)
    assert data == b"#8%08d" % len(BLOCK) + BLOCK + b"\n"


def test_a_termination_character_stops_a_read_inside_a_block(session: pyvisa.resources.MessageBasedResource) -> None:
    session.write("BLOC?")
    first, status = session.visalib.read(session.session, 1 << 24)
    assert first == b"#8%08d" % len(BLOCK) + bytes(range(11))
    assert status == StatusCode.success_termination_character_read


def test_query_binary_values(session: pyvisa.resources.MessageBasedResource) -> None:
    session.read_termination = None
    data = session.query_binary_values("BLOC?", datatype="B", container=bytes)
    assert data == BLOCK


def test_faults(session: pyvisa.resources.MessageBasedResource, box: Box, clock: VirtualClock) -> None:
    box.faults.add(Fault.on(FaultKind.SILENCE, r"^\*IDN\?"))
    with pytest.raises(pyvisa.VisaIOError):
        session.query("*IDN?")
    assert session.query("*IDN?;:SYST:ERR?").endswith('+0,"No error"')

    box.faults.add(Fault.on("half", "IDN"))
    session.write("*IDN?")
    with pytest.raises(pyvisa.VisaIOError):
        session.read()
    assert session.query("*IDN?") == "MAKER,BOX,1,2"

    box.faults.clear()
    box.faults.add(Fault.at("garbage", 2))
    assert session.query("*IDN?") == "MAKER,BOX,1,2"
    session.write("*IDN?")
    assert max(session.read_raw()) >= 0x80
    assert session.query("*IDN?") == "MAKER,BOX,1,2"

    box.faults.clear()
    box.faults.add(Fault.wrong_identity())
    assert session.query("*IDN?") == session.query("*idn?") == "ACME,MODEL 1,0,0.0"

    box.faults.clear()
    now = clock.now()
    box.faults.add(Fault.on("late", "IDN", delay=0.5))
    assert session.query("*IDN?") == "MAKER,BOX,1,2"
    assert clock.now() == now + 0.5


def test_half_a_block_arrives_and_then_nothing(session: pyvisa.resources.MessageBasedResource, box: Box) -> None:
    box.faults.add(Fault.on("half", "BLOC"))
    session.read_termination = None
    session.write("BLOC?")
    half = session.read_bytes(1_000_000)
    assert half == (b"#8%08d" % len(BLOCK) + BLOCK)[: len(half)]
    with pytest.raises(pyvisa.VisaIOError):
        session.read_bytes(len(BLOCK))


def test_attributes(session: pyvisa.resources.MessageBasedResource) -> None:
    with pytest.raises(pyvisa.VisaIOError):
        session.get_visa_attribute(ResourceAttribute.user_data)
    with pytest.raises(pyvisa.VisaIOError):
        session.set_visa_attribute(ResourceAttribute.resource_class, "SOCKET")


def test_without_end_a_message_goes_on(session: pyvisa.resources.MessageBasedResource) -> None:
    session.send_end = False
    session.write_raw(b"*ID")
    session.send_end = True
    assert session.query("N?") == "MAKER,BOX,1,2"


def test_unknown_names_are_refused(box: Box) -> None:
    library = InProcessVisaLibrary({NAME: box})
    manager = pyvisa.ResourceManager(library)
    with pytest.raises(pyvisa.VisaIOError) as caught:
        manager.open_resource("TCPIP0::elsewhere::inst0::INSTR")
    assert caught.value.error_code == StatusCode.error_resource_not_found
    library.shut()


def test_benches_share_nothing_and_leave_nothing(bench_motor: VirtualMotor) -> None:
    with VirtualBench(bench_motor) as one, VirtualBench(bench_motor) as two:
        assert one.visa_library is not two.visa_library
        managers = [pyvisa.ResourceManager(bench.visa_library) for bench in (one, two)]
        assert managers[0] is not managers[1]
        assert len(managers[0].list_resources()) == 4
        assert managers[0].list_resources("?*::osc?*::INSTR") == ("TCPIP0::oscilloscope::inst0::INSTR",)
        resource = managers[0].open_resource(one.address("supply"))
        kept = weakref.ref(one.visa_library)
        one.visa_library.shut()
        with pytest.raises(pyvisa.InvalidSession):
            _ = resource.session
    del one, two, managers, resource
    gc.collect()
    assert kept() is None
    assert not [key for key in VisaLibraryBase._registry if key[0] is InProcessVisaLibrary]


def test_each_role_says_who_it_is(visa: Callable[[str], pyvisa.resources.MessageBasedResource]) -> None:
    models = {"supply": "E36313A", "lcr_meter": "E4980AL", "oscilloscope": "DSO-X 3024T", "voltmeter": "34461A"}
    for role, model in models.items():
        assert visa(role).query("*IDN?").split(",")[1] == model
