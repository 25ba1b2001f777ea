"""`python -m tests.studies.bare_machine [PYTEST ARGUMENTS…]`: both commands of the README's start, as on a bare machine.

A fresh clone of what is committed is tried in a network namespace with loopback alone, with a home of its own, and a path on which there
is one Python with pip and neither uv nor PostgreSQL nor Chromium. The packages are downloaded before, into a cache of their own,
so that this needs a package registry once. With arguments the second command runs these tests only.

Ends with 0 where both commands pass and no tests are skipped but a browser's, and those that read data which is not beside this checkout;
with 77 where this machine allows no namespace.
"""

import argparse
import fnmatch
import os
import re
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from tests.studies.loopback import why_not, with_loopback_only

ROOT = Path(__file__).parents[2]
NOT_TRIED = 77
_SYSTEM_PATH = ("/usr/local/sbin", "/usr/local/bin", "/usr/sbin", "/usr/bin", "/sbin", "/bin")
_ABSENT = (
    *("python*", "pip*", "uv", "uvx", "chromium*", "google-chrome*", "chrome*"),
    *("psql*", "postgres*", "pg_*", "initdb*"),
)
#: Data that some tests compare with, beside a checkout where there is any, and not part of it.
DATA = ROOT.parent / "shared"
#: Why the tests are skipped that a bare machine may skip: those in a browser, and without the data those that read them.
_BROWSER, _NO_DATA = "no Chromium on this machine", ("not beside the repository", "not beside this checkout")
_SHOWN = 60


@dataclass(frozen=True)
class Outcome:
    """How a command ended, what it printed, and how long (s) it took."""

    status: int
    output: str
    seconds: float
    with_data: bool

    @property
    def trouble(self) -> str:
        """What is wrong with it, nothing where it is as promised."""
        if self.status:
            return f"ends with {self.status}"
        allowed = (_BROWSER,) if self.with_data else (_BROWSER, *_NO_DATA)
        skipped = [line for line in self.output.splitlines() if line.startswith("SKIPPED")]
        others = [line for line in skipped if not any(reason in line for reason in allowed)]
        return f"skips more than browser tests: {others[0]}" if others else ""

    @property
    def last_line(self) -> str:
        """The last line of its output."""
        return next((line for line in reversed(self.output.splitlines()) if line.strip()), "")


class BareMachine:
    """A clone, a home and a path in `folder`, with `python` as the only Python."""

    def __init__(self, folder: Path, python: str) -> None:
        self._python = python
        self._clone, self._wheels = folder / "motorbench", folder / "wheels"
        self._base = folder / "base"
        home, programs = folder / "home", folder / "programs"
        for made in (home, programs):
            made.mkdir()
        _link_programs(programs, python)
        self._cached = {"UV_CACHE_DIR": str(folder / "cache")}
        self._environment = {
            **self._cached,
            "HOME": str(home),
            "LANG": "C.UTF-8",
            "PATH": f"{self._base}/bin:{programs}",
            # pip adds to this machine, not to the Python that it borrows.
            "PIP_USER": "1",
            "PIP_IGNORE_INSTALLED": "1",
            "PYTHONUSERBASE": str(self._base),
            # No network: packages come from what was downloaded.
            "PIP_NO_INDEX": "1",
            "PIP_FIND_LINKS": str(self._wheels),
            "UV_OFFLINE": "1",
        }

    def prepare(self) -> None:
        """Clone, and download the packages. Raises CalledProcessError where that fails."""
        _run("git", "clone", "--quiet", str(ROOT), str(self._clone))
        if DATA.is_dir():
            (self._clone.parent / DATA.name).symlink_to(DATA)
        _run(self._python, "-m", "pip", "download", "--quiet", "--dest", str(self._wheels), "uv")
        uv = self._wheels.parent / "uv"
        _run(self._python, "-m", "pip", "install", "--quiet", "--no-index", "--find-links", str(self._wheels),
             "--target", str(uv), "uv")  # fmt: skip
        _run(str(uv / "bin" / "uv"), "sync", "--quiet", "--python", self._python, cwd=self._clone, more=self._cached)
        # What the clone had not is what the first command is to make.
        _run("git", "clean", "-xdfq", cwd=self._clone)

    def run(self, command: str) -> Outcome:
        """Run a shell's command in the clone, without network."""
        begin = monotonic()
        done = subprocess.run(
            with_loopback_only(["sh", "-c", command], self._python),
            cwd=self._clone,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        return Outcome(done.returncode, done.stdout, monotonic() - begin, DATA.is_dir())


def promised() -> tuple[str, str]:
    """Return the README's first two commands."""
    setup, tests, *_ = re.findall(r"^```\n(.+?)\n```$", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    return setup, tests


def main(arguments: list[str]) -> int:
    """Try both commands and print how they end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", default=_own_python(), help="the machine's Python; this one unless said otherwise")
    given, tests = parser.parse_known_args(arguments)
    if reason := why_not():
        print(f"No network namespace is allowed here, so nothing was tried: {reason}")
        return NOT_TRIED
    with tempfile.TemporaryDirectory(prefix="bare-machine-") as folder:
        machine = BareMachine(Path(folder), given.python)
        begin = monotonic()
        try:
            machine.prepare()
        except subprocess.CalledProcessError as error:
            print(f"The machine cannot be prepared: {shlex.join(error.cmd)}\n{error.stdout}")
            return 1
        version = _run(given.python, "-c", "import platform; print(platform.python_version())").strip()
        who = "root" if os.geteuid() == 0 else "an ordinary user"
        print(f"Python {version}, {who}, loopback only; packages downloaded in {monotonic() - begin:.0f} s", flush=True)
        if not DATA.is_dir():
            print(f"Without {DATA.name}/ beside the checkout, the tests that read it are skipped", flush=True)
        setup, suite = promised()
        outcomes = [_tell(machine, command) for command in (setup, shlex.join([*shlex.split(suite), *tests]))]
    return 1 if any(outcome.trouble for outcome in outcomes) else 0


def _tell(machine: BareMachine, command: str) -> Outcome:
    print(f"$ {command}", flush=True)
    outcome = machine.run(command)
    if outcome.trouble:
        print(*outcome.output.splitlines()[-_SHOWN:], sep="\n")
    print(f"  {outcome.seconds:.0f} s, {outcome.trouble or 'as promised'}: {outcome.last_line.strip('= ')}", flush=True)
    return outcome


def _link_programs(folder: Path, python: str) -> None:
    for place in map(Path, _SYSTEM_PATH):
        for program in place.iterdir() if place.is_dir() else ():
            link = folder / program.name
            if not link.is_symlink() and not any(fnmatch.fnmatch(program.name, absent) for absent in _ABSENT):
                link.symlink_to(program)
    (folder / "python3").symlink_to(python)


def _own_python() -> str:
    return str(Path(getattr(sys, "_base_executable", sys.executable)).resolve())


def _run(*command: str, cwd: Path | None = None, more: dict[str, str] | None = None) -> str:
    environment = {name: value for name, value in os.environ.items() if name != "VIRTUAL_ENV"} | (more or {})
    done = subprocess.run(
        command, cwd=cwd, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=True
    )
    return done.stdout


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
