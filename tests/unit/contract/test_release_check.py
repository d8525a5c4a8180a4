"""The release check: it passes what is in the repository, and finds planted errors."""

from __future__ import annotations

import shutil
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest

from tools import conda_recipe, release_check
from tools.package_readme import description
from tools.release_check import CheckFailed

VERSIONED = ("pyproject.toml", "CITATION.cff", "docker-compose.yml", "CHANGELOG.md")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The wheel and the source distribution."""
    return release_check.built(release_check.ROOT, tmp_path_factory.mktemp("dist"), "sdist", "wheel")


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the files that name the version, in place of the repository."""
    for name in VERSIONED:
        shutil.copy(release_check.ROOT / name, tmp_path)
    monkeypatch.setattr(release_check, "ROOT", tmp_path)
    return tmp_path


def test_all_versions_are_the_same() -> None:
    assert release_check.check_versions() == release_check.version()


@pytest.mark.parametrize("name", VERSIONED)
def test_another_version_in_any_file_is_named(root: Path, name: str) -> None:
    text = (root / name).read_text().replace(release_check.version(), "0.0.7").replace("Unreleased", "0.0.7 (2026)")
    (root / name).write_text(text)
    with pytest.raises(CheckFailed, match=name):
        release_check.check_versions()


def test_a_release_needs_its_tag_and_its_changes(root: Path) -> None:
    version = release_check.version()
    (root / "CHANGELOG.md").write_text("# Changelog\n\n## 0.0.7\n\nOld.\n")
    for tag in ("v0.0.7", f"v{version}"):
        with pytest.raises(CheckFailed):
            release_check.check_tag(tag)
    (root / "CHANGELOG.md").write_text(f"# Changelog\n\n## {version} (2026-12-01)\n\nNew.\n\n- A\n\n## 0.0.7\n\nOld.\n")
    assert release_check.check_tag(f"v{version}") == f"v{version}"
    assert release_check.changes() == "New.\n\n- A"


def test_the_description_has_no_relative_links(files: list[Path]) -> None:
    release_check.check_description(files[0])
    readme = (release_check.ROOT / "README.md").read_text("utf-8")
    assert len(release_check.relative_links(readme)) > 10
    assert release_check.relative_links(description(readme)) == []
    kept = "[a](https://a.example/b) and [c](#d), ![e](https://a.example/f.png)\n"
    assert description(kept).startswith(kept)


def test_the_wheel_is_complete_and_a_foreign_file_in_it_is_named(files: list[Path], tmp_path: Path) -> None:
    release_check.check_wheel(files[0])
    changed = shutil.copy(files[0], tmp_path)
    with zipfile.ZipFile(changed, "a") as archive:
        archive.writestr("grazemap/notes.txt", "")
    with pytest.raises(CheckFailed, match=r"holds grazemap/notes\.txt"):
        release_check.check_wheel(changed)


@pytest.mark.thorough  # as `make release-check` does
def test_the_source_distribution_builds_the_same_wheel(files: list[Path], tmp_path: Path) -> None:
    wheel, sdist = files
    release_check.check_rebuilt(sdist, wheel)
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    (source,) = tmp_path.iterdir()
    (source / "sdk/grazemap/version.py").write_text("")
    with tarfile.open(tmp_path / "other.tar.gz", "w:gz") as archive:
        archive.add(source, source.name)
    with pytest.raises(CheckFailed):
        release_check.check_rebuilt(tmp_path / "other.tar.gz", wheel)


def test_the_source_distribution_lacks_no_file(tmp_path: Path) -> None:
    with tarfile.open(tmp_path / "empty.tar.gz", "w:gz") as archive:
        archive.add(release_check.ROOT / "LICENSE", "grazemap/LICENSE")
    with pytest.raises(CheckFailed, match="lacks"):
        release_check.check_sdist(tmp_path / "empty.tar.gz")


def test_the_conda_recipe_is_that_of_the_project() -> None:
    assert conda_recipe.RECIPE.read_text("utf-8") == conda_recipe.recipe(), "run `python -m tools.conda_recipe`"


def test_a_check_says_its_outcome_in_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    def fails() -> str:
        return release_check._run(["sh", "-c", "echo planted >&2; exit 3"], Path())

    assert release_check.passed("first", lambda: "fine")
    assert not release_check.passed("second", fails)
    first, second = capsys.readouterr().out.splitlines()
    assert first.split() == ["ok", "first:", "fine"]
    assert second.startswith("FAILED second:")
    assert second.endswith("planted")


def test_the_makefile_runs_it() -> None:
    done = subprocess.run(["make", "-n", "release-check"], cwd=release_check.ROOT, capture_output=True, text=True)
    assert "-m tools.release_check" in done.stdout
