"""What a shell completes of the command."""

import subprocess

import pytest

from grazemap import cli
from grazemap.wire import PROCESSES


@pytest.fixture
def completed(tmp_path, monkeypatch, capsys):
    """Return what bash offers for words of a command line, the last one to be completed."""
    assert cli.main(["completion", "bash"]) == 0
    script = tmp_path / "completion.bash"
    script.write_text(capsys.readouterr().out)

    def offered(*words):
        code = (
            f'source {script}; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_LINE="$*"; COMP_POINT=${{#COMP_LINE}}\n'
            'entry=$(complete -p grazemap); [[ $entry =~ -F\\ ([a-z_]+) ]]; "${BASH_REMATCH[1]}"\n'
            "printf '%s\\n' \"${COMPREPLY[@]}\""
        )
        command = ["bash", "--norc", "-c", code, "bash", "grazemap", *words]
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
        assert done.stderr == ""
        return done.stdout.split()

    return offered


def test_commands_flags_choices_and_files_are_completed(completed, tmp_path):
    (tmp_path / "curve.npz").touch()
    assert completed("graz") == ["grazing-curves"]
    assert set(PROCESSES) <= set(completed(""))
    assert completed("grazing-curves", "--max") == ["--max-order"]
    assert completed("run", "unfolding-maps", "--policy", "sweep") == ["sweep-up", "sweep-down"]
    assert completed("show", "cur") == ["curve.npz"]
    assert completed("grazing-curves", "-o", "cur") == ["curve.npz"]


@pytest.mark.parametrize("shell", ["zsh", "tcsh"])
def test_there_is_a_script_for_other_shells(shell, capsys):
    assert cli.main(["completion", shell]) == 0
    printed = capsys.readouterr().out
    assert all(process in printed for process in PROCESSES)
