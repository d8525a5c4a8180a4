"""Run the benchmarks, write the JSON document and print its tables: `python -m benchmarks out/bench.json [--quick]`."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from benchmarks.run import run
from benchmarks.tables import tables


def main() -> None:
    """Run everything."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Speed beside scipy and heyoka.")
    parser.add_argument("path", type=Path, help="JSON document to write")
    parser.add_argument("--quick", action="store_true", help="less of everything: a minute instead of ten")
    arguments = parser.parse_args()
    began = time.perf_counter()

    def progress(message: str) -> None:
        print(f"[{time.perf_counter() - began:6.1f} s] {message}", file=sys.stderr, flush=True)

    bench = run(arguments.quick, progress)
    arguments.path.parent.mkdir(parents=True, exist_ok=True)
    arguments.path.write_text(bench.model_dump_json(indent=1) + "\n", "utf-8")
    print(tables(bench))
    print(f"Written: {arguments.path.resolve()}")


if __name__ == "__main__":
    main()
