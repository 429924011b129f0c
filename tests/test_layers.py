"""The layers of ARCHITECTURE.md, held against the imports."""

import ast
from pathlib import Path

import pytest

import ffd_lightning

ROOT = Path(ffd_lightning.__file__).parent
LAYERS = (
    "errors files parallel pretrained progress terminal run_folder components geometry",
    "palette shapes imaging losses nn metrics",
    "data",
    "checkpoint evaluation",
    "training inference",
    "analysis",
    "app",
)
RANK = {name: rank for rank, names in enumerate(LAYERS) for name in names.split()}
FILES = sorted(ROOT.rglob("*.py"))


def imports(path, when_loaded=False):
    """Yield the names of imported modules: all, or those that are imported with the module."""
    queue = [ast.parse(path.read_text(encoding="utf-8"))]
    while queue:
        node = queue.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield str(node.module)
        later = isinstance(node, ast.FunctionDef) or (
            isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
        )
        if not (when_loaded and later):
            queue += ast.iter_child_nodes(node)


def home(path):
    name = path.relative_to(ROOT).parts[0].removesuffix(".py")
    return {"__init__": "app", "__main__": "app"}.get(name, name)  # they stand above all rooms


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_go_down_only_and_frameworks_stay_where_they_belong(path):
    own, names = home(path), list(imports(path))
    for name in names:
        package, _, rest = name.partition(".")
        if package == "ffd_lightning" and rest:
            other = rest.split(".")[0]
            assert other == own or RANK[other] < RANK[own] or RANK[own] == RANK[other] == 0, (
                f"{path} imports {name}"
            )
    roots = {name.split(".")[0] for name in names}
    assert own == "app" or not {"hydra", "omegaconf"} & roots
    if own not in ("training", "app") and path != ROOT / "data" / "datamodule.py":
        assert "lightning" not in roots


DATA = {
    "categories": (),
    "source": (),
    "splits": ("categories",),
    "reading": ("source",),
    "sources": ("categories", "source", "reading"),
    "preparation": ("categories", "source", "reading"),
    "templates": ("categories", "source", "preparation"),
    "batches": ("preparation", "templates"),
    "twins": ("preparation",),
    "datamodule": ("source", "splits", "preparation", "templates", "batches", "twins"),
}


def test_imports_within_data_go_one_way():
    for path in (ROOT / "data").rglob("*.py"):
        own = path.relative_to(ROOT / "data").parts[0].removesuffix(".py")
        for name in imports(path):
            if name.startswith("ffd_lightning.data."):
                other = name.split(".")[2]
                assert other == own or other in DATA[own], f"{path} imports {name}"


def test_workers_of_the_preparation_do_not_load_torch():
    """Each worker process imports these; torch alone would cost it seconds and 200 MB."""
    seen, queue = set(), ["ffd_lightning.data.preparation.preparation"]
    while queue:
        name = queue.pop()
        if name in seen:
            continue
        seen.add(name)
        assert name.split(".")[0] not in ("torch", "lightning"), sorted(seen)
        if name.startswith("ffd_lightning"):
            path = ROOT.parent / Path(*name.split("."))
            file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
            queue += list(imports(file, when_loaded=True))
