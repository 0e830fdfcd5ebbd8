"""The notebook runs from beginning to end and finds the texture with both renderers."""

import json
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[2] / "docs" / "notebooks" / "inverse_rendering.ipynb"
LARGEST_RATIO = {"image_error": 0.2, "texture_error": 0.3, "held_out_error": 0.2}  # end to start


@pytest.fixture(scope="module")
def results() -> dict:
    """What the cell tagged "results" prints, in the small settings."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VLNHIJACK_NOTEBOOK", "small")
        patch.setenv("OMP_NUM_THREADS", "1")
        notebook = nbformat.read(NOTEBOOK, as_version=4)
        NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    (cell,) = (c for c in notebook.cells if "results" in c.metadata.get("tags", []))
    return json.loads(cell.outputs[0].text)


@pytest.mark.parametrize("renderer", ["mitsuba", "frozen"])
@pytest.mark.parametrize("error", LARGEST_RATIO)
def test_texture_is_found(results: dict, renderer: str, error: str) -> None:
    start, end = results[renderer][error]
    assert end <= LARGEST_RATIO[error] * start


def test_operator_is_mitsuba(results: dict) -> None:
    assert results["linearity_error"] < 1e-5
    assert results["image_difference"] < 1e-4
    assert results["adjoint_error"] < 1e-10


def test_operator_is_faster(results: dict) -> None:
    assert results["frozen"]["seconds"] < results["mitsuba"]["seconds"]


def test_stored_outputs_are_complete_and_small() -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert all(cell.execution_count for cell in notebook.cells if cell.cell_type == "code")
    assert NOTEBOOK.stat().st_size < 1_000_000
