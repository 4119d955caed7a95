"""The description for the package index: README with absolute links. All else is in pyproject.toml."""

import re
import tomllib
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).parent
REPOSITORY = tomllib.loads((HERE / "pyproject.toml").read_text("utf-8"))["project"]["urls"][
    "Repository"
]


def absolute(page: str) -> str:
    """A page whose links and pictures lead to the repository, and whose code blocks have no marks of the tests."""
    files = re.sub(r"^https://github\.com", "https://raw.githubusercontent.com", REPOSITORY)
    page = re.sub(r"(!\[[^]]*\]\()(?!https?:|#)", rf"\1{files}/main/", page)
    page = re.sub(r"((?<!!)\[[^]]*\]\()(?!https?:|#)", rf"\1{REPOSITORY}/blob/main/", page)
    page = re.sub(r'(\bsrc=")(?!https?:)', rf"\1{files}/main/", page)
    return re.sub(r"^(`{3,}\w+) (?:slow|no-run|from)\b.*$", r"\1", page, flags=re.MULTILINE)


setup(
    long_description=absolute((HERE / "README.md").read_text("utf-8")),
    long_description_content_type="text/markdown",
)
