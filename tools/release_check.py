"""Whether this version can be published: `make release-check`, or `python -m tools.release_check [--tag vX.Y.Z]`.

It builds the wheel and the source distribution into dist/, checks them, and says the outcome of every check in a line.
With the tag of a release, the tag and a section of CHANGELOG.md must be of this version too. The exit status is 1 if a
check failed. It needs git, the index of packages, and the extra `dev`.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from email import message_from_bytes
from pathlib import Path

import yaml
from markdown_it import MarkdownIt

from tools import conda_recipe

ROOT = Path(__file__).parents[1]
DIST = ROOT / "dist"
GUIDE = "service/grazemap_service/guide"
_ADDRESS = re.compile(r"[a-z]+:|#")


class CheckFailed(Exception):
    """A check failed; the message says what is wrong."""


def version() -> str:
    """Return the version of pyproject.toml, with which all others are compared."""
    return str(tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"])


def versions() -> Iterator[tuple[str, str]]:
    """Yield the places that name the version, each with what stands there."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    (kernels,) = project["optional-dependencies"]["kernels"]
    yield "the extra `kernels`", re.split(r"==|;", kernels)[1].strip()
    yield "CITATION.cff", yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))["version"]
    services = yaml.safe_load((ROOT / "docker-compose.yml").read_text("utf-8"))["services"]
    for name in ("service", "worker"):
        yield f"docker-compose.yml, {name}", services[name]["image"].partition(":")[2]
    # a version that is not released yet has its changes under another heading
    sections = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    yield "CHANGELOG.md", version() if sections[0] == "Unreleased" else sections[0].split()[0]


def check_versions() -> str:
    """Compare all versions with that of pyproject.toml."""
    others = [f"{place} has {text}" for place, text in versions() if text != version()]
    if others:
        raise CheckFailed(f"pyproject.toml has {version()}, but {'; '.join(others)}")
    return version()


def check_tag(tag: str) -> str:
    """Compare the tag of a release with the version, and look for the section of its changes."""
    if tag != f"v{version()}":
        raise CheckFailed(f"the tag is {tag}, and the version {version()}")
    if not changes():
        raise CheckFailed(f"CHANGELOG.md has no section `## {version()}`")
    return tag


def changes() -> str:
    """Return the section of this version in CHANGELOG.md, without its heading; empty if there is none."""
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    section = re.search(rf"^## {re.escape(version())}\b.*\n((?:(?!## ).*\n?)*)", text, re.MULTILINE)
    return section[1].strip() if section else ""


def built(folder: Path, into: Path, *targets: str) -> list[Path]:
    """Build the wheel or the source distribution of a folder; return the files."""
    options = [word for target in targets for word in ("-t", target)]
    _run([sys.executable, "-m", "hatchling", "build", *options, "-d", str(into)], folder)
    return sorted(into.iterdir())


def tracked(*folders: str) -> set[str]:
    """Return the files of the repository, below folders or all."""
    return set(_run(["git", "ls-files", "-z", *folders], ROOT).split("\0")) - {""}


def guide() -> set[str]:
    """Return the files of the guide; none where it was not built."""
    return {str(path.relative_to(ROOT)) for path in (ROOT / GUIDE).rglob("*") if path.is_file()}


def check_guide() -> str:
    """Look for the guide, which the wheel carries."""
    if f"{GUIDE}/index.html" not in guide():
        raise CheckFailed("it was not built: run `make guide`")
    return f"{len(guide())} files"


def check_wheel(wheel: Path) -> str:
    """Compare what the wheel holds with the files of the packages."""
    folders = [
        Path(package)
        for package in tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"]["targets"][
            "wheel"
        ]["packages"]
    ]
    expected = {str(Path(name).relative_to(folder.parent)) for folder in folders for name in tracked(folder.as_posix())}
    expected |= {name.partition("/")[2] for name in guide()}
    with zipfile.ZipFile(wheel) as archive:
        held = set(archive.namelist())
    described = f"grazemap-{version()}.dist-info"
    about = {f"{described}/{name}" for name in ("METADATA", "WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE")}
    return _same(expected | about, held)


def check_sdist(sdist: Path) -> str:
    """Compare what the source distribution holds with the files of the repository."""
    with tarfile.open(sdist) as archive:
        held = {member.name.partition("/")[2] for member in archive if member.isfile()}
    return _same(tracked() | guide() | {"PKG-INFO"}, held)


def check_rebuilt(sdist: Path, wheel: Path) -> str:
    """Build the wheel from the source distribution; it must have the same bytes."""
    with tempfile.TemporaryDirectory() as name:
        with tarfile.open(sdist) as archive:
            archive.extractall(name, filter="data")
        (source,) = Path(name).iterdir()
        (again,) = built(source, Path(name) / "dist", "wheel")
        if again.read_bytes() != wheel.read_bytes():
            raise CheckFailed("the wheel that the source distribution builds is another one")
    return f"SHA-256 of {sdist.name}: {hashlib.sha256(sdist.read_bytes()).hexdigest()}"


def check_description(wheel: Path) -> str:
    """Look for links in the description that an index of packages cannot follow."""
    with zipfile.ZipFile(wheel) as archive:
        message = message_from_bytes(archive.read(f"grazemap-{version()}.dist-info/METADATA"))
    relative = relative_links(str(message.get_payload()))
    if relative:
        raise CheckFailed(f"relative links: {', '.join(relative)}")
    if message["Project-URL"]:
        return "no link or picture is relative"
    return "no link or picture is relative; links to files are left out, as the project names no public address"


def relative_links(markdown: str) -> list[str]:
    """Return the addresses of links and pictures that need the files beside a text."""
    tokens = MarkdownIt().enable("table").parse(markdown)
    inline = [child for token in tokens for child in token.children or ()]
    addresses = [str(token.attrs.get("href") or token.attrs.get("src") or "") for token in inline]
    return [address for address in addresses if address and not _ADDRESS.match(address)]


def check_metadata(files: Iterable[Path]) -> str:
    """Check the metadata of the files, and that their description renders, as an index does."""
    _run([sys.executable, "-m", "twine", "check", "--strict", *map(str, files)], ROOT)
    return "twine check --strict"


def check_installed(wheel: Path) -> str:
    """Install the wheel into an empty environment with what it requires, and start it there."""
    with tempfile.TemporaryDirectory() as name:
        _run([sys.executable, "-m", "venv", f"{name}/venv"], ROOT)
        python = f"{name}/venv/bin/python"
        _run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", str(wheel)], Path(name))
        _run([python, "-I", "-W", "error", "-c", "import grazemap; grazemap.Client, grazemap.Oscillator()"], Path(name))
        said = _run([f"{name}/venv/bin/grazemap", "--version"], Path(name)).strip()
        if said != f"grazemap {version()}":
            raise CheckFailed(f"`grazemap --version` says {said}")
    return said


def check_recipe() -> str:
    """Compare the conda recipe with pyproject.toml, and have it rendered as conda-forge does."""
    if conda_recipe.RECIPE.read_text("utf-8") != conda_recipe.recipe():
        raise CheckFailed("conda/recipe.yaml is not that of pyproject.toml: run `python -m tools.conda_recipe`")
    from rattler_build import RenderConfig, Stage0Recipe, VariantConfig

    rendered = Stage0Recipe.from_yaml(conda_recipe.recipe()).render(VariantConfig(), RenderConfig())
    return ", ".join(variant.recipe.package.name for variant in rendered)


def _same(expected: set[str], held: set[str]) -> str:
    """Return how many files there are; raise CheckFailed where some are missing or too many."""
    lacks, has = (", ".join(sorted(names)[:5]) for names in (expected - held, held - expected))
    if lacks or has:
        raise CheckFailed("; ".join([f"it lacks {lacks}"] * bool(lacks) + [f"it holds {has}"] * bool(has)))
    return f"{len(held)} files, and no others"


def _run(command: Sequence[str], folder: Path) -> str:
    """Run a command with the modules of its own environment; return its output.

    Raises CheckFailed with its last lines.
    """
    own = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, cwd=folder, env=own, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stdout + done.stderr).strip().splitlines()[-5:]
        raise CheckFailed(f"{' '.join(map(str, command[:4]))} ...: {' / '.join(last)}")
    return done.stdout


def passed(name: str, check: Callable[[], str]) -> bool:
    """Run a check and say its outcome in a line; return whether it passed."""
    try:
        outcome, text = "ok", check()
    except CheckFailed as error:
        outcome, text = "FAILED", str(error)
    print(f"{outcome:7}{name}: {text}", flush=True)
    return outcome == "ok"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all checks; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.release_check", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--tag", help="the tag of the release")
    parser.add_argument("--changes", action="store_true", help="print the changes of this version alone")
    options = parser.parse_args(arguments)
    if options.changes:
        print(changes())
        return 0
    outcomes = [passed("versions", check_versions)]
    if options.tag:
        outcomes.append(passed("tag", lambda: check_tag(options.tag)))
    outcomes += [passed("conda recipe", check_recipe), passed("guide", check_guide)]
    shutil.rmtree(DIST, ignore_errors=True)
    files: list[Path] = []

    def build() -> str:
        files.extend(built(ROOT, DIST, "sdist", "wheel"))
        return ", ".join(f"{file.name}, {file.stat().st_size / 1e6:.1f} MB" for file in files)

    outcomes.append(passed("build", build))
    if outcomes[-1]:
        wheel, sdist = files
        outcomes += [
            passed("metadata", lambda: check_metadata(files)),
            passed("description", lambda: check_description(wheel)),
            passed("wheel", lambda: check_wheel(wheel)),
            passed("source distribution", lambda: check_sdist(sdist)),
            passed("wheel from it", lambda: check_rebuilt(sdist, wheel)),
            passed("installed", lambda: check_installed(wheel)),
        ]
    return 0 if all(outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())
