"""A folder in, a Parquet file out: `python folder.py DETECTOR FOLDER results.parquet`. What the image runs."""

from __future__ import annotations

import sys

import dose3


def main() -> int:
    detector, folder, out = sys.argv[1:]
    failed = dose3.Detector.load(detector).write_table(out, [folder]).failed
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
