"""A folder in, a Parquet file out: `python folder.py DETECTOR FOLDER results.parquet [frame=body-flu ...]`. What the
image runs; settings of reading are those of `dose3.load`."""

from __future__ import annotations

import json
import sys
from typing import Any

import dose3


def setting(text: str) -> tuple[str, Any]:
    """`rate=10` is a number, `frame=body-flu` a text."""
    name, _, value = text.partition("=")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def main() -> int:
    detector, folder, out, *reading = sys.argv[1:]
    settings = dict(map(setting, reading))
    counts = dose3.Detector.load(detector).write_table(out, [folder], **settings)
    print(f"{counts.judged} logs judged, {counts.ood} out of distribution, {counts.failed} could not be judged")
    return 2 if counts.failed else 0


if __name__ == "__main__":
    sys.exit(main())
