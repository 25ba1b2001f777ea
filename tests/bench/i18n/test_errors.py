"""What cannot be used is refused in the reader's language, and in English where a program reads."""

import ast
import json
import os
import pickle
import socket
import ssl
from collections.abc import Iterator
from pathlib import Path

import pytest
from serial import SerialException

from bench.eol.plan import load_plan
from bench.i18n.errors import InputError, UsageError, message
from bench.i18n.language import translator
from bench.motor.motor_file import load_motor
from bench.panel.line_records import Choice, read_statistics
from bench.panel.motor_store import save_motor
from drivers.interfaces import MeasurementError, ReportedError, SetpointError
from drivers.interfaces.text import lines, text
from tests.command_line import Call

ROOT = Path(__file__).parents[3]
CHINESE = translator("zh")
MOTOR = """
[nameplate]
name = ""
connection = "wye"
rated_current = "10 A"
maximum_current = 1e5
rated_sped_rpm = 3000.0
"""
ENGLISH = [
    "nameplate.name = ''; allowed is the motor's name, text in quotes (String should have at least 1 character)",
    "nameplate.rated_current = '10 A' is text, not a number; give a number in A, such as 10, "
    "allowed is a number above 0 and up to 10000 A (phase, peak)",
    "nameplate.maximum_current = 100000.0; allowed is a number above 0 and up to 10000 A (phase, peak)",
    "unknown key nameplate.rated_sped_rpm; did you mean rated_speed_rpm?",
]
IN_CHINESE = [
    "nameplate.name = ''；允许值：电机名称，带引号的文本（文本至少应有 1 个字符）",
    "nameplate.rated_current = '10 A' 是文本，不是数；请给出以 A 为单位的数，例如 10，允许值：大于 0 且不超过 10000 A 的数（相，峰值）",
    "nameplate.maximum_current = 100000.0；允许值：大于 0 且不超过 10000 A 的数（相，峰值）",
    "未知的键 nameplate.rated_sped_rpm；是否指 rated_speed_rpm？",
]
#: This speaks English to whoever writes tests.
UNTRANSLATED = ("bench/testing/__init__.py", "bench/testing/benches.py")


@pytest.fixture
def motor(tmp_path: Path) -> Path:
    path = tmp_path / "motor.toml"
    path.write_text(MOTOR, encoding="utf-8")
    return path


def run(call: Call, motor: Path, *options: str) -> tuple[int, str, str]:
    return call("run", "stator-resistance", "--station", "virtual", "--motor", str(motor), *options)


@pytest.mark.parametrize("option", [["--language", "zh"], ["--language=zh"]])
def test_a_wrong_motor_file_is_refused_in_the_language_that_is_asked_for(
    call: Call, motor: Path, option: list[str]
) -> None:
    code, out, err = run(call, motor, *option)
    assert (code, out) == (2, "")
    assert err.removeprefix("motorbench: ").splitlines() == [f"{motor}：{line}" for line in IN_CHINESE]


def test_it_is_refused_in_english_otherwise(call: Call, motor: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "zh_CN.UTF-8")
    _, _, err = run(call, motor, "--language", "en")
    assert err.removeprefix("motorbench: ").splitlines() == [f"{motor}: {line}" for line in ENGLISH]


def test_a_command_without_the_option_goes_by_the_locale(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "zh_CN.UTF-8")
    code, _, err = call("sim", "six-step", "--motor", "92bl-30-25l")
    assert (code, err) == (2, "motorbench: 请给出 --speed RPM… 或 --load NM…，二者取一\n")
    monkeypatch.setenv("LC_ALL", "C")
    assert "give either --speed RPM… or --load NM…" in call("sim", "six-step", "--motor", "92bl-30-25l")[2]


def test_a_language_that_is_not_there_is_refused_by_the_locale(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "zh_CN.UTF-8")
    _, _, err = call("procedures", "--language", "de")
    assert err == "motorbench: --language de：允许 en、zh 和 auto\n"


def test_a_program_reads_english(call: Call, motor: Path) -> None:
    _, out, err = run(call, motor, "--json", "--language", "zh")
    assert json.loads(out) == {"error": "\n".join(f"{motor}: {line}" for line in ENGLISH)}
    assert IN_CHINESE[0] in err


def test_a_procedure_or_setting_that_is_not_there(call: Call) -> None:
    virtual = ("--station", "virtual", "--motor", "lg-400w", "--language", "zh")
    _, _, err = call("run", "stator-resistence", *virtual)
    assert err == "motorbench: 没有测量项目 'stator-resistence'，也不是 all：是否指 stator-resistance？\n"
    _, _, err = call("run", "stator-resistance", *virtual, "--set", "frequencie=1")
    assert "--set frequencie=1：没有设置项 frequencie；" in err
    _, _, err = call("run", "pole-pairs-static", *virtual, "--set", "current_share=7")
    assert "current_share = 7；允许值：大于 0 且不超过 1 的数（电源限流，占额定电流的比例）" in err


def test_two_values_that_contradict_one_another(tmp_path: Path) -> None:
    plate = {"name": "a", "connection": "wye", "rated_current": 10.0, "maximum_current": 5.0}
    with pytest.raises(InputError) as refused:
        save_motor(tmp_path, plate)
    assert str(refused.value).startswith("nameplate: maximum_current = 5 A is below rated_current = 10 A")
    assert message(refused.value, CHINESE).startswith(
        "nameplate：maximum_current = 5 A 小于 rated_current = 10 A；两者均为相电流峰值"
    )


def test_a_plan_and_a_serial_number(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    wanted = '[plan]\nname = "p"\nmotor = "lg-400w"\nserial_pattern = "A.*"\n[[procedure]]\nname = "{}"\n'
    path.write_text(wanted.format("stator-resistance"), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_plan(path).check_serial("B7")
    assert message(refused.value, CHINESE) == "序列号 'B7' 不符合计划的格式 A.*"
    path.write_text(wanted.format("stator-resistence"), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_plan(path)
    assert message(refused.value, CHINESE) == f"{path}：测量项目 'stator-resistence'：是否指 stator-resistance？"


def test_records_that_cannot_be_read_tell_the_page_why() -> None:
    found = read_statistics("mysql://here/records", Choice())
    assert found.fault is not None
    assert "数据库须为 SQLite（文件路径）或 PostgreSQL" in found.fault.render(CHINESE)


def test_an_error_keeps_its_sentence_on_its_way_between_processes() -> None:
    said = text("there is no step {step!r}; {hint}", step="9.9", hint=text("did you mean {name}?", name="3.2"))
    again = pickle.loads(pickle.dumps(UsageError(lines([said, "as it is {here}"]))))  # noqa: S301  our own
    assert str(again) == "there is no step '9.9'; did you mean 3.2?\nas it is {here}"
    assert message(again, CHINESE) == "没有步骤 '9.9'；是否指 3.2？\nas it is {here}"


def test_a_capture_that_cannot_be_used(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    capture = tmp_path / "scope.csv"
    capture.write_text("time (s),CH1 (V)\n0.0,1.0\n0.1,two\n0.2,3.0\n", encoding="utf-8")
    monkeypatch.setenv("LANG", "zh_CN.UTF-8")
    for name in ("LC_ALL", "LC_MESSAGES"):
        monkeypatch.delenv(name, raising=False)
    _, _, err = call("analyze", "back-emf", str(capture))
    assert f"{capture}，第 3 行：'0.1,two' 不是与其他行相同的 2 个数" in err


def test_a_motor_that_is_not_there() -> None:
    with pytest.raises(InputError) as refused:
        load_motor("lg-401w")
    assert message(refused.value, CHINESE) == "没有电机 'lg-401w'，也没有这样的文件：是否指 lg-400w？"


#: Where each takes its sentence.
ERRORS = {"InputError": 0, "UsageError": 0, "NoDatabaseError": 0, "StoreError": 0, "CaptureError": 1}


def bare(tree: ast.AST) -> Iterator[ast.Call]:
    """Errors that are made of a finished sentence, which nobody can translate."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ERRORS:
            said = node.args[ERRORS[node.func.id]]
            if isinstance(said, ast.JoinedStr | ast.Constant | ast.BinOp):
                yield node


def test_no_error_is_a_finished_sentence() -> None:
    found = []
    for path in sorted((ROOT / "bench").rglob("*.py")):
        where = str(path.relative_to(ROOT))
        if not where.startswith(UNTRANSLATED):
            found += [f"{where}:{node.lineno}" for node in bare(ast.parse(path.read_text(encoding="utf-8")))]
    assert not found, "give a text(…):\n" + "\n".join(found)


def test_a_drivers_error_speaks_the_readers_language() -> None:
    error = SetpointError("supply", "voltage", 60.0, "V", 0.0, 48.0, text("the station"))
    assert str(error) == "supply: voltage = 60 V is outside 0 … 48 V, the limit of the station; nothing was sent"
    assert (
        message(error, CHINESE)
        == f"直流电源：电压 = 60 V 超出 0 … 48 V，限值属于 {CHINESE('the station')}；未发送任何命令"
    )
    sent = ReportedError("relay {K1}", text("the output is still on"), command="OUTP?", remedy=text("Press Single."))
    assert str(sent) == "relay {K1} after 'OUTP?': the output is still on. Press Single."
    assert message(sent, CHINESE) == "relay {K1}，'OUTP?' 之后：输出仍接通。" + CHINESE("Press Single.")


def test_a_driver_of_a_strangers_may_say_plain_words() -> None:
    assert str(MeasurementError("meter", "overheated {98 °C}")) == "meter: overheated {98 °C}"


@pytest.mark.parametrize(
    ("error", "english", "chinese"),
    [
        (
            FileNotFoundError(2, "", "a.toml"),
            "there is no such file or folder: 'a.toml'",
            "没有该文件或文件夹：'a.toml'",
        ),
        (ConnectionResetError(104, "Connect call failed"), "the other side closed the connection", "对方关闭了连接"),
        (PermissionError(13, "Permission denied"), "permission denied", "权限不足"),
        (TimeoutError("timed out"), "there was no answer in time", "未及时应答"),
        (socket.gaierror(-2, "Name or service not known"), "the computer's name is not known", "无法识别该计算机名"),
        (SerialException(2, f"port x: {os.strerror(2)}"), "there is no such file or folder", "没有该文件或文件夹"),
        (ssl.SSLError(1, "[SSL] no start line"), "[SSL] no start line", "[SSL] no start line"),
        (ValueError(), "ValueError", "ValueError"),
    ],
)
def test_the_operating_systems_errors(error: Exception, english: str, chinese: str) -> None:
    assert str(text("{error}", error=error)) == english
    assert message(error, CHINESE) == chinese
