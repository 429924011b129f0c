"""The notebooks run from their first cell to their last, on a sweep made here."""

import json
import os
import re
from pathlib import Path

import nbformat
import pytest
from jupyter_client.manager import KernelManager
from nbclient import NotebookClient

from ffd_lightning.app.training_run import train
from ffd_lightning.run_folder import RunFolder

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))


@pytest.fixture(scope="module")
def sweep(tiny_config, tmp_path_factory):
    """A regime on two counts of templates, and another on one of them."""
    folder = tmp_path_factory.mktemp("sweep")
    for regime, templates in (("b", "t1"), ("b", "t2"), ("e", "t2")):
        overrides = (
            f"regime={regime}",
            f"templates={templates}",
            "split.train_fraction=0.7",
            "schedule.steps=4",
            "evaluation.references=true",
            "templates.hold_out=2",
            "protocol.points=64",
        )
        train(tiny_config(*overrides), RunFolder(folder / regime / templates))
    return folder


@pytest.fixture(scope="module")
def kernel(sweep, data_root):
    """A kernel that all notebooks share, which loads torch once."""
    kernel = KernelManager()
    environment = {"SWEEP": str(sweep), "DATA": str(data_root)}
    kernel.start_kernel(cwd=str(NOTEBOOKS[0].parent), env=os.environ | environment)
    yield kernel
    kernel.shutdown_kernel(now=True)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_is_kept_without_outputs(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code)
    assert "parameters" in code[0]["metadata"]["tags"]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs(path, kernel, sweep):
    notebook = nbformat.read(path, 4)
    # Nothing is left of the names of the notebook before.
    notebook.cells.insert(0, nbformat.v4.new_code_cell("%reset -f"))
    NotebookClient(notebook, km=kernel, timeout=900, startup_timeout=600).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in outputs), "it shows something"
    texts = [output.get("text", "") for output in outputs]
    texts += [v for output in outputs for k, v in output.get("data", {}).items() if "png" not in k]
    assert not any(str(sweep) in text for text in texts), "no paths"
    assert not any(re.search(r">\s*nan\s*<", text, re.IGNORECASE) for text in texts), (
        "no empty cells"
    )
    saved = re.findall(r'FIGURES / "(\w+)"', "".join(cell.source for cell in notebook.cells))
    assert saved
    for name in saved:
        assert (sweep / "figures" / f"{name}.png").stat().st_size > 1000
