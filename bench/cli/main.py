"""The command line. Nothing heavy is imported before a command is chosen."""

import gc
import os
import sys
from collections.abc import Mapping, Sequence

from cyclopts import App, CycloptsError, Parameter

from bench.cli.standard_streams import open_streams, unprinted
from bench.i18n.errors import FileError, InputError, UsageError, fault, message, told
from drivers.interfaces.text import text

#: Exit statuses, as docs/reference/commands.rst has them: it was begun, or the bench kept it from that; what was typed or named is wrong.
FAILED, USAGE = 1, 2


_BEGINNING = """\
To begin, without any instrument: motorbench demo, then motorbench report latest
One step after the other: motorbench run all --station virtual --motor lg-400w
What stands on your bench: motorbench station scan, then motorbench station new
"""


#: Where the commands' functions are, and what they do.
_COMMANDS = {
    "demo:demo": "Every procedure on the virtual bench, then the summary.",
    "run:run": "Run procedures on a station, or on the virtual bench.",
    "procedures:procedures": "List the procedures with their steps and settings.",
    "parameters:parameters": "List the parameters with units and conventions.",
    "report:report": "Write a run's report as a page and a PDF.",
    "sign:sign": "Sign a run: measured, checked or approved.",
    "export:export": "Write a run's parameters as a motor controller's file.",
    "study:study": "How well a station will measure a type: random motors on its virtual twin.",
    "serve:serve": "The operator's panel in a browser.",
    "doctor:doctor": "Check the installation: libraries, VISA backends, permissions.",
}
_ANALYZE = {
    "analyze.captures:back_emf": "Fundamental and harmonics of captured back-EMF voltages.",
    "analyze.captures:step_response": "Resistance and inductance from a current step.",
    "analyze.shaft:coast_down": "Friction from a coast-down (time, speed).",
    "analyze.shaft:cogging": "Cogging torque of a slowly turned shaft.",
    "analyze.captures:four_wire": "Stator resistance from four-wire voltage and current.",
    "analyze.captures:rotor_sweep": "Ld and Lq from inductance over the rotor's angle.",
    "analyze.six_step:six_step": "A measured six-step drive at another load and voltage.",
    "analyze.six_step_loads:six_step_loads": "Equivalent resistance of a six-step drive's load points.",
    "analyze.table:table": "Compare published figures with those of a run or a motor.",
    "analyze.maps:flux_map": "Inductances, MTPA and torque of a table of flux linkages.",
    "analyze.maps:short_circuit": "Inductances, resistance and torque of shorted terminals.",
    "analyze.maps:efficiency": "Efficiency and losses of a table of load points.",
}
_SIM = {
    "sim.six_step:six_step": "Steady state of a six-step BLDC drive.",
    "sim.serve:serve": "The virtual bench on real sockets.",
}
_STATION = {
    "station.check:check": "Open, identify and close its instruments.",
    "station.drivers:drivers": "List the drivers and where each comes from.",
    "station.scan:scan": "Find the instruments; nothing is changed.",
    "station.new:new": "Find the instruments, ask for the rest, and write a station file.",
    "station.traffic:record": "Record the instruments' messages byte by byte, to send to a developer.",
    "station.traffic:replay": "Replay a recording through the drivers, or serve it.",
    "station.framing:set_framing": "Set rate, format and unit of an instrument on its serial line.",
    "station.reset:reset": "Allow runs again after an interlock was open.",
}
_EOL = {
    "eol.run:run": "Measure a batch of motors by a plan.",
    "eol.check:check": "Try a plan on virtual benches: time, limits, instruments.",
    "eol.schema:schema": "The plan file's JSON schema, for editors.",
    "eol.export:export": "Records as CSV, Parquet, JUnit XML or JSON lines.",
    "eol.motor:motor": "One motor's tests, the part at fault, and the changes between tests.",
    "eol.labels:labels": "The label line of each motor of a batch.",
    "eol.archive:archive": "A batch's records, plan and runs in one file.",
    "eol.archive:restore": "Put an archived batch back.",
    "eol.retain:retain": "Remove old waveforms and runs by a rule, with a log.",
    "eol.forward:forward": "Forward the records that wait for their server.",
    "eol.close:close": "List and close batches that were broken off.",
    "eol.pack:pack": "Compress the runs of batches that were measured before.",
    "eol.motors:motors": "List the motors of a figure or a failure, or those that did not pass.",
    "eol.plan:plan": "Write a plan from a measured motor.",
    "eol.migrate:migrate": "Bring the tables of records up to this version.",
    "eol.stats:stats": "Yield, failures, capability, charts, gauge studies.",
}
_GROUPS = {
    "analyze": ("Evaluate a stored capture; no instrument needed.", _ANALYZE),
    "sim": ("Simulations that stand alone.", _SIM),
    "station": ("Look after a station.", _STATION),
    "eol": ("End of line: batches of motors, their records and statistics.", _EOL),
    "user": (
        "People who may open the panel from a network.",
        {"user:add": "Add a person, or change role and password."},
    ),
}


def make_app() -> App:
    """Return the application with all its commands."""
    app = App(
        name="motorbench",
        help="A test bench for permanent-magnet motors, real or virtual.",
        help_epilogue=_BEGINNING,
        version=_version,
        default_parameter=Parameter(negative=()),
        result_action="return_value",
        # The help is plain text: nothing is to be rendered, and the renderer takes as long as all the rest.
        help_format="plaintext",
        # Who is interrupted is told so.
        suppress_keyboard_interrupt=False,
    )
    app.command(
        "bench.cli.results:command", name="results", help="Show a run, list runs, or verify that a run is unchanged."
    )
    _add(app, _COMMANDS)
    for group, (words, commands) in _GROUPS.items():
        under = App(name=group, help=words, default_parameter=Parameter(negative=(), consume_multiple=True))
        _add(under, commands)
        app.command(under)
    return app


def _add(app: App, commands: Mapping[str, str]) -> None:
    for place, words in commands.items():
        app.command(f"bench.cli.{place}", name=place.rpartition(":")[2].replace("_", "-"), help=words)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 failed, 2 wrong usage; one message on standard error, never a traceback."""
    # Matrices here are small: a second BLAS thread only waits for the first, and on a busy machine for long.
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    # What is loaded stays: it is not looked through again and again for what could be freed, nor once more at the end.
    gc.set_threshold(20_000)
    open_streams()
    given = _language_last(list(sys.argv[1:] if arguments is None else arguments))
    code = _run(given)
    if reason := unprinted():
        sentence = text(
            "standard output: {fault}; what was to be printed is incomplete. A run that was made is kept: motorbench results list",
            fault=told(reason),
        )
        code = max(_refuse([word for word in given if word != "--json"], InputError(sentence), FAILED), code)
    gc.freeze()
    sys.exit(code)


def _language_last(given: list[str]) -> list[str]:
    """Return a command line with the language that stands before its command behind it, where every command takes it."""
    if not given or given[0].partition("=")[0] != "--language":
        return given
    own = 1 if "=" in given[0] else 2
    return [*(given[own:] or ["--help"]), *given[:own]]


def _app(given: list[str]) -> App:
    """Return the application, with its help in the reader's language where it may have to show it."""
    app = make_app()
    helped = "--help" in given or "-h" in given or sum(not word.startswith("-") for word in given) < 2
    if not helped:
        return app
    from bench.cli.help import in_language
    from bench.i18n.language import translator

    return in_language(app, translator(_language(given)))


def _run(given: list[str]) -> int:
    try:
        code = _app(given)(given, exit_on_error=False, print_error=False)
    except CycloptsError as error:
        from bench.cli.usage_errors import said_of

        return _refuse(given, InputError(said_of(error)), USAGE)
    except (UsageError, FileError) as error:
        return _refuse(given, error, USAGE)
    except InputError as error:
        # An analysis measures nothing: what it cannot go on from is what it was given.
        return _refuse(given, error, USAGE if given[0] == "analyze" else FAILED)
    except BrokenPipeError:
        # Whoever read the output has had enough; there is nobody left to tell.
        sys.stderr.close()
        return FAILED
    except KeyboardInterrupt:
        return _refuse(given, InputError(text("interrupted by Ctrl-C")), FAILED)
    except Exception as error:  # noqa: BLE001  the last place where an error becomes a message
        return _unexpected(given, error)
    return code if isinstance(code, int) else 0


def _unexpected(given: list[str], error: Exception) -> int:
    from drivers.interfaces import InstrumentError
    from procedures.core.bench import ProcedureError

    if isinstance(error, InstrumentError | ProcedureError):
        return _refuse(given, error, FAILED)
    sentence = text(
        "program error: {fault}; please report it together with the command that you typed", fault=fault(error)
    )
    return _refuse(given, InputError(sentence), FAILED)


def _refuse(given: list[str], error: Exception, code: int) -> int:
    """Say what went wrong in the reader's language; a program that reads the JSON gets it in English."""
    from bench.i18n.language import translator

    if "--json" in given:
        import json

        print(json.dumps({"error": str(error)}, ensure_ascii=False))
    print(f"motorbench: {message(error, translator(_language(given)))}", file=sys.stderr)
    return code


def _language(given: list[str]) -> str:
    """Return the language that a command line asks for, by the locale where it asks for none that there is."""
    from bench.i18n.language import LANGUAGES, language_of

    wish = "auto"
    for word, following in zip(given, [*given, ""][1:], strict=True):
        option, equals, value = word.partition("=")
        if option == "--language":
            wish = value if equals else following
    return language_of(wish if wish in LANGUAGES else "auto")


def _version() -> str:
    from importlib.metadata import version

    return version("motorbench")
