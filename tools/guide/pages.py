"""Run what the pages of the guide show, and write what it prints into them: `python -m tools.guide.pages [PAGE ..]`.

The blocks of Python and of the shell of a page run in their order, in an empty folder; Python names live from one block
to the next. After a block stands one of text or JSON: what it printed. For `curl` this is what `jq` makes of the
answer; lines of the command line are run. A picture of the page whose name a block saves is written too. Blocks of
``py`` and of ``console`` are shown only. With `--check` nothing is written, and the exit status says whether all is as
the pages show it.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, chdir, contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from unittest.mock import patch

import matplotlib as mpl
from matplotlib import pyplot

import grazemap

if TYPE_CHECKING:
    from grazemap import Client

DOCS = Path(__file__).parents[2] / "docs"
Ask = Callable[[str, dict[str, Any]], dict[str, Any]]
"""Returns the result of a process for a request."""

_BLOCKS = re.compile(r"```(python|sh)\n(.*?)```\n(?:\n```(?:text|json)\n(.*?)```\n)?", re.DOTALL)
_FILTER = re.compile(r"(?:\.(\w+)((?:\[0:(\d+)\])?\[\])? \| )?(?:\{([\w, ]+)\}|\[([\w., ]+)\])")
_PICTURE = re.compile(r"!\[[^]]*\]\(((?:\.\./)*pictures/[\w/]*?([\w-]+\.png))\)")


class Block(NamedTuple):
    """A block of a page: its language, what it printed, and what the page says that it prints."""

    language: str
    printed: str
    shown: str

    @property
    def differs(self) -> bool:
        """Whether it printed something else: records of JSON agree in numbers to nine digits, all else as text."""
        if self.language != "sh" or not self.shown.startswith(("{", "[")):
            return self.shown != self.printed
        lists = [list(_values([json.loads(line) for line in text.splitlines()])) for text in (self.shown, self.printed)]
        return len(lists[0]) != len(lists[1]) or not all(
            math.isclose(number, other, rel_tol=1e-9)
            if isinstance(number, float) and isinstance(other, float)
            else number == other
            for number, other in zip(*lists, strict=True)
        )


def _values(document: Any) -> Iterator[Any]:
    """Yield the names and the values in a JSON document."""
    if isinstance(document, dict):
        for name, part in document.items():
            yield name
            yield from _values(part)
    elif isinstance(document, list):
        for part in document:
            yield from _values(part)
    else:
        yield document


def pages() -> list[Path]:
    """Return the pages of the guide that have blocks to run."""
    return [path for path in sorted(DOCS.rglob("*.md")) if _BLOCKS.search(path.read_text("utf-8"))]


def run(text: str, ask: Ask) -> Iterator[Block]:
    """Run the blocks of a page in their order, and yield each with what it printed."""
    names: dict[str, Any] = {}
    for language, code, shown in _BLOCKS.findall(text):
        yield Block(language, _python(code, names) if language == "python" else _shell(code, ask), shown)


def written(text: str, ask: Ask) -> str:
    """Return the page with what its blocks print; a block that prints something for the first time gets a block."""
    printed = (block.printed for block in run(text, ask))

    def replaced(match: re.Match[str]) -> str:
        now = next(printed)
        if match[3] is not None:
            return match[0][: match.start(3) - match.start()] + now + match[0][match.end(3) - match.start() :]
        return match[0] + (f"\n```text\n{now}```\n" if now else "")

    return _BLOCKS.sub(replaced, text)


def pictures_of(page: Path) -> dict[str, Path]:
    """Return the pictures that a page shows, by the names under which its blocks save them."""
    return {match[2]: (page.parent / match[1]).resolve() for match in _PICTURE.finditer(page.read_text("utf-8"))}


def ask_with(client: Client) -> Ask:
    """Return what asks the service of a client."""
    import httpx2

    def ask(process: str, request: dict[str, Any]) -> dict[str, Any]:
        job = client.submit(process, request)
        job.wait(progress=False)
        answer: dict[str, Any] = httpx2.get(f"{client.base_url}/v1/jobs/{job.id}/result?f=json").json()
        return answer

    return ask


def _python(code: str, names: dict[str, Any]) -> str:
    output = io.StringIO()
    with redirect_stdout(output):
        exec(code, names)
    return output.getvalue()


def _shell(code: str, ask: Ask) -> str:
    if not code.startswith("curl"):
        command = f"set -e\n{code}"
        here = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # `grazemap` of this environment
        environment = {**os.environ, "PATH": here}
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, env=environment)
        if done.returncode:
            raise RuntimeError(f"{code}: {done.stderr}")
        return done.stdout
    words = shlex.split(code.replace("\\\n", " "))
    (process,) = [word.rpartition("/")[2] for word in words if "/v1/" in word]
    filtered = _FILTER.fullmatch(words[-1])
    assert filtered is not None, words[-1]
    result: Any = ask(process, json.loads(words[words.index("-d") + 1]))
    part: Any = result[filtered[1]] if filtered[1] else result
    records = part[: int(filtered[3]) if filtered[3] else None] if filtered[2] else [part]
    names = (filtered[4] or filtered[5].replace(".", "")).split(", ")
    chosen = [{name: record[name] for name in names} for record in records]
    shown = chosen if filtered[4] else [list(record.values()) for record in chosen]
    return "".join(json.dumps(record, separators=(",", ":")) + "\n" for record in shown)


def _write(page: Path, client: Client, folder: str) -> list[str]:
    """Run a page in a folder, and write what it prints and the pictures that it saves; nothing then differs."""
    with chdir(folder):
        page.write_text(written(page.read_text("utf-8"), ask_with(client)), "utf-8")
    for name, target in pictures_of(page).items():
        made = Path(folder, name)
        if made.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(made.read_bytes())
    return []


def differences(page: Path, client: Client, folder: str | Path) -> list[str]:
    """Run a page in a folder, and return in what it differs from what it shows."""
    with chdir(folder):
        blocks = list(run(page.read_text("utf-8"), ask_with(client)))
    return [f"printed {block.printed!r}, not {block.shown!r}" for block in blocks if block.differs]


@contextmanager
def examples_ask(url: str) -> Iterator[None]:
    """Within this block examples ask the service at an address, each with clients of its own, and start none."""
    with ExitStack() as opened:

        def local(*_: Any, **__: Any) -> grazemap.Client:
            return opened.enter_context(grazemap.Client(url))

        opened.enter_context(patch.object(grazemap, "local", local))
        opened.enter_context(patch.dict(os.environ, GRAZEMAP_URL=url))
        yield


def main(arguments: Sequence[str]) -> int:
    """Run the pages, all of them where none is named."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("pages", nargs="*", type=lambda name: Path(name).resolve())
    parser.add_argument("--check", action="store_true")
    given = parser.parse_args(arguments)
    mpl.use("Agg")
    wrong = 0
    with grazemap.local() as client, examples_ask(client.base_url):
        for page in given.pages or pages():
            began = time.monotonic()
            # settings of pictures are those of one page
            with mpl.rc_context(), tempfile.TemporaryDirectory(prefix="grazemap-page-") as folder:
                differ = (differences if given.check else _write)(page, client, folder)
            pyplot.close("all")
            wrong += len(differ)
            print(f"{page.name}: {time.monotonic() - began:.1f} s", *differ, sep="\n  ", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
