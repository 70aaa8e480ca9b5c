"""The notebooks run from start to end; their cells check what they promise."""
import json

import pytest

from conftest import ROOT

NOTEBOOKS = sorted((ROOT / "python/notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda f: f.stem)
def test_runs(file, monkeypatch):
    notebook = json.loads(file.read_text(encoding="utf-8"))
    code = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    if any("import torch" in text for text in code):
        pytest.importorskip("torch")
    monkeypatch.chdir(file.parent)
    variables = {"__name__": file.stem}
    for number, text in enumerate(code):
        exec(compile(text, f"{file.name}, code cell {number}", "exec"), variables)
