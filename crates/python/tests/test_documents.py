"""What documents show runs."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
import re
from pathlib import Path

import dose3
import pytest

TUTORIAL = Path(__file__).parents[3] / "docs" / "PYTHON.md"


def test_examples_of_docstrings() -> None:
    tried = 0
    for module in pkgutil.iter_modules(dose3.__path__, "dose3."):
        if module.name != "dose3._native":
            results = doctest.testmod(importlib.import_module(module.name), extraglobs={"dose3": dose3})
            assert results.failed == 0, module.name
            tried += results.attempted
    results = doctest.testmod(dose3)
    assert results.failed == 0 and tried + results.attempted >= 10


def test_the_tutorial_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its blocks of Python, one after the other in one folder."""
    monkeypatch.chdir(tmp_path)
    pytest.importorskip("matplotlib").use("Agg")
    blocks = re.findall(r"```python\n(.*?)```", TUTORIAL.read_text(), flags=re.DOTALL)
    assert len(blocks) >= 5
    names: dict[str, object] = {}
    for number, block in enumerate(blocks):
        exec(compile(block, f"{TUTORIAL.name} block {number + 1}", "exec"), names)
