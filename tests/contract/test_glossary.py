"""The glossary has every term that the name of a module or of a public class of the core is made of."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
CORE = ROOT / "core" / "grazemap_core"

# words that mean in a name what they mean in any other text
PLAIN = set(
    re.findall(
        r"\w+",
        """about address apart array at attempt between by check code comparison coordinate core curve end equation
        error exact
        finding first folder from found grid half init interval line map maximum middle moment multi name next number
        one pair parameter pass piece plan point problem progress quick result root run search second segment setting
        short size solved start step sum summary table task two warmup warning work""",
    )
)


def stem(word: str) -> str:
    """Take plural endings off a word."""
    word = word.lower()
    for ending, instead in (("branches", "branch"), ("batches", "batch"), ("ies", "y"), ("us", "us"), ("ss", "ss")):
        if word.endswith(ending):
            return word.removesuffix(ending) + instead
    return word.removesuffix("s")


def terms(glossary: str) -> set[str]:
    """Return the words of the first column."""
    cells = re.findall(r"^\| ([^|]+) \|", glossary, re.MULTILINE)
    return {stem(word) for cell in cells for word in re.findall(r"[A-Za-z]+", cell)}


def words_of(path: str, source: str) -> Iterator[tuple[str, str]]:
    """Yield the words of a module's path and of its public classes, each with the name that it is from."""
    for part in path.removesuffix(".py").split("/"):
        yield from ((word, path) for word in part.split("_") if word)
    for node in ast.parse(source).body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from ((word, node.name) for word in re.findall(r"[A-Z][a-z]*", node.name))


def missing(glossary: str, names: Iterator[tuple[str, str]]) -> list[str]:
    """Return the names' words that the glossary does not have."""
    known = terms(glossary) | PLAIN
    return sorted({f"{word.lower()} (of {name})" for word, name in names if stem(word) not in known})


def core_words() -> Iterator[tuple[str, str]]:
    for path in sorted(CORE.rglob("*.py")):
        yield from words_of(path.relative_to(CORE).as_posix(), path.read_text("utf-8"))


def test_every_term_of_the_core_is_in_the_glossary() -> None:
    assert missing((ROOT / "docs" / "glossary.md").read_text("utf-8"), core_words()) == []


def test_a_term_that_is_not_there_is_found() -> None:
    glossary = "| term | meaning |\n|---|---|\n| orbit | a closed motion |\n"
    planted = words_of("orbits/wobbles.py", "class OrbitWobble: ...\nclass _Hidden: ...\n")
    assert missing(glossary, planted) == ["wobble (of OrbitWobble)", "wobbles (of orbits/wobbles.py)"]
