"""The core's part of the benchmarks alone, with the instructions that this process compiles for: prints a document.

`benchmarks.run` starts it with the settings of `compiled_ahead.PROCESSOR`.
"""

from __future__ import annotations

import argparse
import sys

from benchmarks.run import core_alone


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.narrow")
    parser.add_argument("--quick", action="store_true", help="less of everything")
    alone = core_alone(parser.parse_args().quick, lambda message: print(message, file=sys.stderr, flush=True))
    print(alone.model_dump_json())


if __name__ == "__main__":
    main()
