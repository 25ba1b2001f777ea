"""Commands of motorbench that the panel has done in a process of their own: its server stays small."""

import asyncio
import sys

from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, text

_TIME = 120.0


async def child_command(*arguments: str) -> tuple[bytes, str]:
    """Return what a command prints, and what it says where its exit status is not 0.

    Raises InputError where it does not answer.
    """
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-P",
        "-m",
        "motorbench",
        *arguments,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        async with asyncio.timeout(_TIME):
            out, errors = await process.communicate()
    except TimeoutError:
        process.kill()
        await process.wait()
        raise InputError(
            text("motorbench {command} did not answer within {time:g} s", command=" ".join(arguments), time=_TIME)
        ) from None
    if process.returncode == 0:
        return out, ""
    said = errors.decode("utf-8", "replace").strip().rpartition("motorbench: ")[2]
    return out, said or Text("exit status {status}", {"status": process.returncode}).render()
