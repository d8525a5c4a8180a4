"""The example notebook in a fresh kernel, as a user runs it: pictures, no saved progress, no cell over its time."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from tests.support.thorough import KERNELS_FIRST

pytestmark = KERNELS_FIRST

NOTEBOOK = Path(__file__).parents[3] / "examples" / "first_hour.ipynb"


@pytest.fixture(scope="module")
def compiled() -> None:
    """Compile the kernels for the notebook's two masses, so that its cells have the times of what they compute."""
    two_masses = Oscillator.create([1.0, 1.0], [1.0, 1.0], 0.05, [1.0, 0.0], 0.8)
    unfolding_map_tile(Plane.of(two_masses, np.array([0.5]), np.array([1.0])), MapSettings(max_periods=2))


@pytest.fixture(scope="module")
def executed(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> nbformat.NotebookNode:
    """The notebook after all its cells were run in a folder of its own."""
    folder, kernels = tmp_path_factory.mktemp("notebook"), tmp_path_factory.mktemp("jupyter")
    book = nbformat.read(NOTEBOOK, as_version=4)
    with pytest.MonkeyPatch.context() as environment:
        # neither kernels nor settings of the user
        environment.setenv("JUPYTER_CONFIG_DIR", str(kernels))
        environment.setenv("IPYTHONDIR", str(kernels))
        environment.setenv("JUPYTER_PLATFORM_DIRS", "1")
        environment.setenv("PYDEVD_DISABLE_FILE_VALIDATION", "1")
        environment.delenv("MPLBACKEND", raising=False)
        client = NotebookClient(
            book, timeout=300, kernel_name="python3", record_timing=True, resources={"metadata": {"path": str(folder)}}
        )
        client.execute()
    assert (folder / "machine.pdf").read_bytes().startswith(b"%PDF")
    nbformat.write(book, folder / "executed.ipynb")
    return nbformat.read(folder / "executed.ipynb", as_version=4)


@pytest.mark.timeout(600)  # the kernels are compiled
def test_every_plot_of_the_notebook_is_an_image(executed: nbformat.NotebookNode) -> None:
    assert len(executed.cells) == 25
    plots = [cell for cell in executed.cells if ".plot(" in cell.source]
    assert len(plots) == 6
    for cell in plots:
        images = [output for output in cell.outputs if "image/png" in output.get("data", {})]
        assert len(images) == 1, cell.source


@pytest.mark.timeout(300)
def test_what_is_saved_has_no_progress_and_no_warnings(executed: nbformat.NotebookNode) -> None:
    for cell in executed.cells:
        for output in cell.get("outputs", ()):
            assert output.output_type in ("display_data", "execute_result"), (cell.source, output)
            data = output.get("data", {})
            if "image/png" in data or output.output_type == "execute_result":
                continue
            # a display of progress is cleared when the work is done
            assert "".join(data.get("text/html", "")).strip() == "", (cell.source, output)


@pytest.mark.timeout(300)
def test_no_cell_takes_longer_than_it_may(executed: nbformat.NotebookNode) -> None:
    for cell in executed.cells:
        if cell.cell_type == "code":
            times = cell.metadata.execution
            began, ended = (
                datetime.fromisoformat(times[name].replace("Z", "+00:00"))
                for name in ("iopub.execute_input", "shell.execute_reply")
            )
            assert (ended - began).total_seconds() <= cell.metadata.seconds, cell.source


@pytest.mark.timeout(300)
def test_results_are_shown_as_tables_and_pictures(executed: nbformat.NotebookNode) -> None:
    shown = {cell.source.splitlines()[-1]: cell.outputs for cell in executed.cells if cell.cell_type == "code"}
    for name in ("client", "umap", "orbit"):
        (result,) = [output for output in shown[name] if output.output_type == "execute_result"]
        assert "<table" in result.data["text/html"]
