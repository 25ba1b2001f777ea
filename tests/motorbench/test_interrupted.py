"""Ctrl-C while the program is still being loaded ends it with a sentence, as it does later."""

import builtins
import json
import sys
from typing import Any

import pytest

from motorbench.__main__ import main


def test_ctrl_c_before_anything_is_loaded(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    genuine = builtins.__import__

    def interrupted(name: str, *rest: Any) -> Any:
        if name == "bench.cli.main":
            raise KeyboardInterrupt
        return genuine(name, *rest)

    monkeypatch.setattr(builtins, "__import__", interrupted)
    monkeypatch.setattr(sys, "argv", ["motorbench", "run", "--json"])
    with pytest.raises(SystemExit, match="motorbench: interrupted by Ctrl-C"):
        main()
    assert json.loads(capsys.readouterr().out) == {"error": "interrupted by Ctrl-C"}
