"""Many questions at once, so that all workers have something to do."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from grazemap import Client
from grazemap.results import Result

R = TypeVar("R", bound=Result)


def answers(
    client: Client, answer: type[R], questions: Sequence[Mapping[str, Any]], text: str = "", say_every: int = 100
) -> list[R]:
    """Return the results of questions to one process, in order.

    Parameters
    ----------
    client : Client
    answer : type
        The class of the results; it names the process.
    questions : sequence of mapping
        Request bodies.
    text : str
        What they are about, for a line on stderr after every `say_every` of them; none where it is empty.
    say_every : int
    """
    jobs = [client.submit(answer.process, dict(question)) for question in questions]
    results: list[R] = []
    for job in jobs:
        result = job.wait(progress=False).result()
        assert isinstance(result, answer)
        results.append(result)
        done = len(results)
        if text and (done % say_every == 0 or done == len(jobs)):
            print(f"  {text}: {done} of {len(jobs)}", file=sys.stderr, flush=True)
    return results
