"""The page that lists what is checked: every check names a test that is there."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def functions_of(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_every_check_of_the_page_names_a_test_that_is_there():
    page = (ROOT / "docs" / "checks.md").read_text(encoding="utf-8")
    rows = []
    for section in page.split("\n## ")[1:]:
        table = [row for row in section.splitlines() if row.startswith("| ") and "---" not in row]
        if table and not table[0].startswith("| check |"):  # one test checks the table as a whole
            table = [f"`{name}` |" for name in re.findall(r"`(tests/test_\w+\.py)`", section)[:1]]
            assert table, f"no test is named in {section.splitlines()[0]!r}"
        rows += [row for row in table if not row.startswith("| check |")]
    named = [re.search(r"`(tests/test_\w+\.py)(?:::(\w+))?` \|$", row) for row in rows]
    assert len(rows) > 30
    assert all(named), [row for row, found in zip(rows, named, strict=True) if not found]
    missing = [
        found.group(0)
        for found in named
        if not (ROOT / found.group(1)).exists()
        or (found.group(2) and found.group(2) not in functions_of(ROOT / found.group(1)))
    ]
    assert not missing
