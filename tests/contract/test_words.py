"""Some words are not used in public names, docstrings, texts for users and documents.

- behind, of time: after. Behind a stop or a proxy, in space, is right.
- told: resolved, decided, classified.
- flows in, flows out, of arguments and results: takes, returns.
- landed, of impacts and states: what happened.
- room, of memory: scratch, memory, space.
- proven, proof: verified, verification. Only interval arithmetic is a proof; the words stand where its certificates
  are made, checked and described.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("core/grazemap_core", "sdk/grazemap", "worker/grazemap_worker", "service/grazemap_service")
# the record of the long checks is left out: it has the names of targets only
DOCUMENTS = [
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "README.md",
]

OF_PROOFS = r"proven|proofs?|proves?|proved|proving"
NEVER = re.compile(
    rf"\b(behind|told|flows (?:in|out)|flow (?:in|out)(?= *[;,])|landed|rooms?|{OF_PROOFS})\b", re.IGNORECASE
)
# what makes a use right, in the text from 40 characters before the word to 60 after it
RIGHT = re.compile(r"behind (a|the|its|either) (stop|wall|proxy)|(interval|ball) arithmetic", re.IGNORECASE)
WITH_CERTIFICATE = re.compile(
    r"certificate|grazemap.check|/v1/proofs|python-flint|#proofs|`proofs`|< proofs|statement", re.IGNORECASE
)
IN_NAMES = {"behind", "told", "landed", "room", "rooms", "proven", "proof", "proofs", "prove", "proving"}
# modules and parts of pages that are about certificates, and their public names elsewhere
ABOUT_CERTIFICATES = re.compile(r"/(proofs|checker)/|/(proofs|checking)\.py$")
SECTION = re.compile(r"^## Proofs\n.*?(?=^## )", re.MULTILINE | re.DOTALL)
NAMES_OF_PROOFS = {"ProofsRequest", "Proof", "prove", "PROOF_SECONDS"}


def wrong_words(text: str) -> list[str]:
    """Return the words of a text that are not right, each with what is around it."""
    text = re.sub(r"\s+", " ", text)
    return [
        around
        for match in NEVER.finditer(text)
        if not RIGHT.search(around := text[max(0, match.start() - 40) : match.end() + 60])
        and not (re.fullmatch(OF_PROOFS, match[0], re.IGNORECASE) and WITH_CERTIFICATE.search(around))
    ]


def names(tree: ast.Module) -> Iterator[str]:
    """Yield the public names that a module defines: of functions, parameters, classes, fields and constants."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name
            if not node.name.startswith("_"):
                yield from (
                    argument.arg for argument in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
                )
        elif isinstance(node, ast.ClassDef):
            yield node.name
            yield from _assigned(node.body)
    yield from _assigned(tree.body)


def _assigned(body: list[ast.stmt]) -> Iterator[str]:
    for statement in body:
        targets = statement.targets if isinstance(statement, ast.Assign) else []
        if isinstance(statement, ast.AnnAssign):
            targets = [statement.target]
        yield from (target.id for target in targets if isinstance(target, ast.Name))


def wrong_in_source(source: str) -> list[str]:
    """Return what is wrong in a module: in its public names, its docstrings, and its texts of several words."""
    tree = ast.parse(source)
    words = [
        name
        for name in names(tree)
        if not name.startswith("_")
        and name not in NAMES_OF_PROOFS
        and IN_NAMES & {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name.replace("_", " "))}
    ]
    texts = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return words + [wrong for text in texts if " " in text for wrong in wrong_words(text)]


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_has_none_of_the_words(package: str) -> None:
    found = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        source, name = path.read_text("utf-8"), path.stem
        if ABOUT_CERTIFICATES.search(path.as_posix()):
            source, name = (re.sub(OF_PROOFS, "shown", text, flags=re.IGNORECASE) for text in (source, name))
        wrong = wrong_in_source(source) + ([path.name] if IN_NAMES & set(name.split("_")) else [])
        if wrong:
            found[path.relative_to(ROOT).as_posix()] = wrong
    assert found == {}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_a_document_has_none_of_the_words(document: Path) -> None:
    assert wrong_words(SECTION.sub("", document.read_text("utf-8"))) == []


@pytest.mark.parametrize(
    "text",
    [
        "The state behind an impact.",
        "Motions are told apart.",
        "An oscillator flows in, a curve\nflows out.",
        "Frequencies flow in; codes flow out.",
        "Who has landed.",
        "Make room for lanes.",
        "A proof that there is one.",
    ],
)
def test_a_planted_word_is_found(text: str) -> None:
    assert wrong_words(text)
    assert wrong_in_source(f'def f():\n    """{text}"""\n')


@pytest.mark.parametrize(
    "text",
    [
        "Masses behind the stop.",
        "A proof by interval arithmetic.",
        "The flow in closed form.",
        "The flow into the stop.",
    ],
)
def test_a_right_use_is_left(text: str) -> None:
    assert wrong_words(text) == []


def test_a_planted_name_is_found_and_a_private_one_is_not() -> None:
    source = "def make_room(proven, _told): ...\nclass Landed:\n    behind: int\ndef _room(): ...\n"
    assert sorted(wrong_in_source(source)) == ["Landed", "behind", "make_room", "proven"]
