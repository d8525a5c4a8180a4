"""Run what docs/machines.md shows, and write what it prints into the page: `python docs/machine_page.py`.

After a block of Python or of the shell stands one of text or JSON: what the Python code printed, and what `jq` makes
of the answer to `curl`. The drawings are written too (`machine_drawings`).
"""

from __future__ import annotations

import io
import json
import re
import shlex
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

PAGE = Path(__file__).parent / "machines.md"
Ask = Callable[[str, dict[str, Any]], dict[str, Any]]
"""Returns the result of a process for a request."""

_BLOCKS = re.compile(r"```(python|sh)\n(.*?)```\n(?:\n```(?:text|json)\n(.*?)```\n)?", re.DOTALL)
_FILTER = re.compile(r"(?:\.(\w+)((?:\[0:(\d+)\])?\[\])? \| )?(?:\{([\w, ]+)\}|\[([\w., ]+)\])")


class Block(NamedTuple):
    """A block of the page: its language, what it printed, and what the page says that it prints."""

    language: str
    printed: str
    shown: str


def run(text: str, ask: Ask) -> Iterator[Block]:
    """Run the blocks of a page in their order, and yield each with what it printed."""
    names: dict[str, Any] = {}
    for language, code, shown in _BLOCKS.findall(text):
        yield Block(language, _python(code, names) if language == "python" else _shell(code, ask), shown)


def written(text: str, ask: Ask) -> str:
    """Return the page with what its blocks print."""
    printed = (block.printed for block in run(text, ask))

    def replaced(found: re.Match[str]) -> str:
        said = next(printed)
        if found[3] is None:
            return found[0]
        return found[0][: found.start(3) - found.start()] + said + found[0][found.end(3) - found.start() :]

    return _BLOCKS.sub(replaced, text)


def _python(code: str, names: dict[str, Any]) -> str:
    output = io.StringIO()
    with redirect_stdout(output):
        exec(code, names)
    return output.getvalue()


def _shell(code: str, ask: Ask) -> str:
    words = shlex.split(code.replace("\\\n", " "))
    (process,) = [word.rpartition("/")[2] for word in words if "/v1/" in word]
    found = _FILTER.fullmatch(words[-1])
    assert found is not None, words[-1]
    result = ask(process, json.loads(words[words.index("-d") + 1]))
    part = result[found[1]] if found[1] else result
    records = part[: int(found[3]) if found[3] else None] if found[2] else [part]
    names = (found[4] or found[5].replace(".", "")).split(", ")
    chosen = [{name: record[name] for name in names} for record in records]
    shown = chosen if found[4] else [list(one.values()) for one in chosen]
    return "".join(json.dumps(one, separators=(",", ":")) + "\n" for one in shown)


def main() -> None:
    """Write the page and its drawings."""
    import httpx2
    import machine_drawings

    import grazemap

    client = grazemap.local()

    def ask(process: str, request: dict[str, Any]) -> dict[str, Any]:
        job = client.submit(process, request)
        job.wait(progress=False)
        answer: dict[str, Any] = httpx2.get(f"{client.base_url}/v1/jobs/{job.id}/result?f=json").json()
        return answer

    with client:
        machine_drawings.main()
        PAGE.write_text(written(PAGE.read_text("utf-8"), ask), "utf-8")


if __name__ == "__main__":
    main()
