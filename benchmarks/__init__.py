"""Speed and correctness of the impact core compared with other tools: `make bench`.

`python -m benchmarks` writes a JSON document (`result`) and prints its tables; `python -m benchmarks.report` makes the
page docs/performance.md of the document. Only `this_core` calls the core.
"""
