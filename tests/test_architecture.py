"""Rules of the house that a machine can hold: who imports what, and what no module does."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import REPOSITORY

LIBRARY = REPOSITORY / "uxsim_geo"
MODULES = sorted([*LIBRARY.rglob("*.py"), *(REPOSITORY / "pipeline").rglob("*.py")])

#: compiled code, which knows arrays and nothing of tables
KERNELS = (
    "calendar",
    "changes",
    "choice",
    "close",
    "detours",
    "elimination",
    "foresight",
    "free_flow",
    "history",
    "link",
    "loop",
    "node",
    "random",
    "records",
    "routes",
    "searches",
    "sweep",
    "trees",
)
#: what turns tables into arrays, and back, and runs the kernels
PYTHON_SIDE = (
    "additions",
    "application",
    "arrays",
    "binding",
    "hierarchy",
    "memory",
    "plans",
    "population",
    "router",
    "saved",
    "setting",
    "sharing",
    "simulation",
    "sinks",
    "slots",
    "steering",
    "tables",
    "ways",
)
KERNELS_MAY_IMPORT = {
    "numpy",
    "numpy.typing",
    "uxsim_geo",
    "uxsim_geo.compiling",
    "uxsim_geo.draws",
} | {f"uxsim_geo.engine.{kernel}" for kernel in KERNELS}

#: what takes long to import and must wait until it is needed
HEAVY = {"geopandas", "matplotlib", "pyogrio", "pyproj", "pyvista", "vtk"}


def named(path: Path) -> str:
    return path.relative_to(REPOSITORY).as_posix()


def imported(nodes: Iterator[ast.AST]) -> set[str]:
    names: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(str(node.module))
    return names


def on_import(tree: ast.Module) -> Iterator[ast.AST]:
    """Statements that run when the module is imported; TYPE_CHECKING blocks do not."""
    for node in tree.body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        yield node


@pytest.mark.parametrize("kernel", KERNELS)
def test_kernels_import_numpy_numba_and_each_other(kernel: str) -> None:
    tree = ast.parse((LIBRARY / "engine" / f"{kernel}.py").read_text(encoding="utf-8"))
    names = imported(ast.walk(tree))
    others = {name for name in names if name.partition(".")[0] not in sys.stdlib_module_names}
    assert others <= KERNELS_MAY_IMPORT


def test_every_engine_module_is_a_kernel_or_its_python_side() -> None:
    names = {path.stem for path in (LIBRARY / "engine").glob("*.py")}
    assert names == {*KERNELS, *PYTHON_SIDE, "__init__"}


@pytest.mark.parametrize("path", MODULES, ids=named)
def test_heavy_imports_wait_until_they_are_needed(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    top_level = {name.partition(".")[0] for name in imported(on_import(tree))}
    assert top_level & HEAVY == set()


@pytest.mark.parametrize("path", MODULES, ids=named)
def test_no_module_is_a_drawer_for_everything(path: Path) -> None:
    assert path.stem not in ("utils", "util", "helpers", "misc", "common")
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


def test_the_library_imports_without_the_application() -> None:
    code = (
        "import importlib, pkgutil, sys, uxsim_geo\n"
        "for module in pkgutil.walk_packages(uxsim_geo.__path__, 'uxsim_geo.'):\n"
        "    importlib.import_module(module.name)\n"
        "print([name for name in sys.modules if name.partition('.')[0] == 'pipeline'])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, check=True, capture_output=True, text=True
    )
    assert done.stdout.strip() == "[]"
