"""What all of the program holds to: nothing from a file is run, and pages load nothing."""

from __future__ import annotations

import ast
import csv
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import REPOSITORY

from pipeline.table_formats import write_csv
from pipeline.yaml_source import yaml_of
from uxsim_geo.errors import Faults, InputError
from uxsim_geo.network.expressions import rows_where

MODULES = sorted([*REPOSITORY.glob("uxsim_geo/**/*.py"), *REPOSITORY.glob("pipeline/**/*.py")])
TEMPLATES = sorted(REPOSITORY.glob("uxsim_geo/**/*.html.jinja"))

#: what runs what it is given, or unpacks objects
RUNNING = {"eval", "exec", "compile", "__import__", "input"}
UNPACKING = {"pickle", "cloudpickle", "dill", "joblib", "marshal", "shelve", "runpy", "code"}
#: the one that keeps compiled code, which looks whose it is
KEEPING_CODE = "uxsim_geo/kept_code.py"
#: modules that begin other programs: in these alone, and by a list of words
STARTING = {"uxsim_geo/export/space_time/drawing.py", "uxsim_geo/export/mp4.py"}


def calls(tree: ast.Module) -> Iterator[ast.Call]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.Call))


def imports(tree: ast.Module) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(str(node.module).partition(".")[0])
    return found


def test_nothing_from_a_file_is_run_or_unpacked_as_objects() -> None:
    wrong = []
    for path in MODULES:
        name = path.relative_to(REPOSITORY).as_posix()
        tree = ast.parse(path.read_text(encoding="utf-8"))
        if name != KEEPING_CODE:
            wrong += [f"{name}: {one}" for one in imports(tree) & UNPACKING]
        if "subprocess" in imports(tree) and name not in STARTING:
            wrong.append(f"{name}: subprocess")
        for call in calls(tree):
            text = ast.unparse(call.func)
            if isinstance(call.func, ast.Name) and call.func.id in RUNNING:
                wrong.append(f"{name}:{call.lineno}: {text}")
            if text in ("os.system", "os.popen", "pd.read_pickle", "yaml.load", "yaml.unsafe_load"):
                wrong.append(f"{name}:{call.lineno}: {text}")
            for word in call.keywords:
                value = ast.unparse(word.value)
                if (word.arg, value) in {("shell", "True"), ("allow_pickle", "True")}:
                    wrong.append(f"{name}:{call.lineno}: {word.arg}")
            loads = text.endswith((".load", ".read_array")) and text.startswith("np.")
            if loads and "allow_pickle" not in {word.arg for word in call.keywords}:
                wrong.append(f"{name}:{call.lineno}: {text}")
    assert wrong == []


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.name)
def test_pages_may_load_nothing_but_map_tiles(path: Path) -> None:
    (policy,) = re.findall(
        r'http-equiv="Content-Security-Policy" content="([^"]+)"', path.read_text(encoding="utf-8")
    )
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["base-uri"] == rules["form-action"] == "'none'"
    sources = {source for value in rules.values() for source in value.split()}
    allowed = {"'none'", "'unsafe-inline'", "data:", "blob:", "https://tile.openstreetmap.org"}
    assert sources <= allowed


def test_ids_in_csv_are_those_of_the_network(tmp_path: Path) -> None:
    ids = ["=cmd|' /C calc'!A0", "+1", "-2", "@SUM(1)", '"a,b"', "\t=1"]
    write_csv(pd.DataFrame({"link_id": ids}), tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as file:
        assert [row["link_id"] for row in csv.DictReader(file)] == ids


@pytest.mark.parametrize(
    "text",
    [
        "a: &a [x]\nb: *a",
        "a: &a {<<: *a}",
        "a: !!python/object/apply:os.system [ls]",
        "a: !!python/name:os.system",
        "a: !!binary YQ==",
        "a: 1\na: 2",
        "a: " + "[" * 2000 + "]" * 2000,
        "a: " + "{b: " * 2000 + "1" + "}" * 2000,
        "".join(
            f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9) if n else 'x'}]\n" for n in range(30)
        ),
    ],
    ids=["alias", "loop", "call", "name", "tag", "twice", "deep list", "deep mapping", "laughs"],
)
def test_yaml_is_plain_values(text: str) -> None:
    with pytest.raises(InputError):
        yaml_of(text, "test")


@pytest.mark.parametrize(
    "expression",
    [
        "__import__('os').system('ls')",
        "lanes.__class__ == 1",
        "[x for x in (1,)] == lanes",
        "(lambda: 1)() == lanes",
        "f'{lanes}' == '1'",
        "lanes ** 9 ** 9 ** 9 > 1",
        "lanes == 'a' * 9999999999",
        "lanes[0] == 1",
        "(x := 1) == lanes",
        "lanes == " + "(" * 500 + "1" + ")" * 500,
        "not " * 1500 + "lanes == 1",
    ],
)
def test_expressions_are_read_and_not_run(expression: str) -> None:
    faults = Faults("test")
    rows = rows_where(pd.DataFrame({"lanes": [1, 2]}), expression, faults)
    assert faults.found
    assert not np.asarray(rows).any()
