"""Maps of large oscillators: `make large-models`.

A dense model of 40 degrees of freedom, with contact between two of them, and a chain of 64 masses. Each is asked for a
map of 64 by 64 points twice, through a service that has compiled nothing: the kernels, which are for any number of
masses, are compiled once, the first job waits for them, and a map takes no more processor time than estimated.
The program fails if a map takes more, or if the second one waits for kernels. On a machine slower than the reference of
`tools.pace` a map may take longer in proportion, which is printed first.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
import time
from contextlib import ExitStack
from typing import Any, Final

import numpy as np

import grazemap
from tools.pace import pace

SIDE, PERIODS = 64, 200
DENSE, CHAIN = 40, 64
_SECONDS_BETWEEN_LOOKS = 0.2
_SPRINGS: Final = 0.05
"""Stiffness between any two coordinates of the dense model, over their share of its random matrix."""


def dense_model(size: int) -> dict[str, Any]:
    """Return an oscillator of dense matrices, with contact between its first and its last coordinate."""
    generator = np.random.default_rng(40)
    spread = generator.normal(size=(size, size)) / size
    mass = np.diag(generator.uniform(1.0, 2.0, size)) + 0.2 * spread @ spread.T
    coupling = _SPRINGS * np.abs(spread + spread.T)
    stiffness = np.diag(1.0 + np.sum(coupling, axis=1)) - coupling
    return {
        "matrices": {"mass": mass.tolist(), "stiffness": stiffness.tolist(), "damping": {"modal": 0.05}},
        "contact": [1, size],
        "forcing": [1.0] + [0.0] * (size - 1),
    }


def chain_model(size: int) -> dict[str, Any]:
    """Return a chain, whose first mass moves between the stops."""
    return {"masses": [1.0] * size, "stiffnesses": [5.0] * size}


def question(oscillator: dict[str, Any], omega: float, clearance: float) -> dict[str, Any]:
    """Return the request for a map about a point."""
    return {
        "oscillator": oscillator,
        "omega": {"start": 0.98 * omega, "stop": 1.02 * omega, "points": SIDE},
        "clearance": {"start": 0.5 * clearance, "stop": 1.1 * clearance, "points": SIDE},
        "max_periods": PERIODS,
    }


def waited(job: grazemap.Job) -> list[str]:
    """Wait for a job; return what it waited for, each text once."""
    texts: list[str] = []
    while job.refresh().job.status not in ("successful", "failed", "dismissed"):
        text = re.sub(r" for \d+ s", "", job.job.waiting_for or "")
        if text and text not in texts:
            texts.append(text)
        time.sleep(_SECONDS_BETWEEN_LOOKS)
    job.wait()  # raises where it failed
    return texts


def main() -> int:
    """Print both maps of both models; return 1 if one took more than its estimate, or kernels were compiled twice."""
    wrong, slower = 0, pace()
    print(f"at most {slower:.2f} of an estimate", flush=True)
    with ExitStack() as stack:
        empty = stack.enter_context(tempfile.TemporaryDirectory())
        os.environ.update(GRAZEMAP_CACHE_DIR=empty, NUMBA_CACHE_DIR=empty)
        client = stack.enter_context(grazemap.local())
        for title, oscillator in (
            (f"{DENSE} degrees of freedom, dense", dense_model(DENSE)),
            (f"a chain of {CHAIN}", chain_model(CHAIN)),
        ):
            curve = client.grazing_curve(omega=(1.0, 1.1), points=2, oscillator=oscillator)
            for number in (1, 2):
                about = question(oscillator, 1.0 + 0.001 * number, float(curve.clearance[0]))
                began = time.perf_counter()
                job = client.submit("unfolding-maps", about)
                texts = waited(job)
                wall, record = time.perf_counter() - began, job.job
                assert record.cpu_seconds is not None
                share = record.cpu_seconds / record.estimate.seconds
                compiled = [text for text in texts if "kernels" in text]
                wrong += share > slower or (number == 2 and bool(compiled))
                print(
                    f"{title}, map {number}: {record.cpu_seconds:.1f} s of processor time, {share:.2f} of the estimate;"
                    f" {wall:.1f} s in all; waited for: {'; '.join(texts) or 'nothing'}",
                    flush=True,
                )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
