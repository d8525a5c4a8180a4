"""Speed and correctness of the impact core beside other tools: `make bench`.

What flows in is nothing but the machine; what flows out is a JSON document (`result`), the table that
`python -m benchmarks` prints, and the page that `python -m benchmarks.report` makes of the document. The core is
called through `this_core` alone.
"""
