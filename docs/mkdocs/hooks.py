"""What the site shows otherwise than the repository: fences without our marks, and why a test does not run them."""

import re
from typing import Any

NOT_RUN = re.compile(r"^(`{3,})(\w+) no-run: (.*)$", re.MULTILINE)
MARKED = re.compile(r"^(`{3,})(\w+) (?:slow\b|from ).*$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Fences without our marks, the reason of those that no test runs beside them."""
    text = NOT_RUN.sub(r"*(not run by the tests: \3)*\n\n\1\2", markdown)
    return MARKED.sub(r"\1\2", text)
