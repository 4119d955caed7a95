"""Check the table words_before_after.md: no old sentence is left in the product, and each new one is there.

    python analysis/words_before_after.py
    python analysis/words_before_after.py --counts COMMIT   # lines with private words there and now

Prints what is wrong, and how many rows are right; exit code 1 if any is not.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PLACES = ("README.md", "docs", "hpcclear", "jobs")
ENDINGS = (".md", ".py", ".toml", ".html", ".js")


WORDS = {
    "tell, told": r"\btells?\b|\btold\b", "kick": r"\bkick", "limits": r"\blimits\b", "play": r"\bplays?\b",
    "deviation, not standard": r"(?<!standard )(?<!std\. )\bdeviation",
}  # fmt: skip
PARTS = {
    "README": ["README.md"], "docs": ["docs", ":!docs/reference"], "commands": ["hpcclear/cli"],
    "report": ["hpcclear/report"], "all source": ["hpcclear"],
}  # fmt: skip


def counts(before: str) -> None:
    """Print the lines of the parts with each word, at a commit and in the last one, as rows of a table."""
    for part, paths in PARTS.items():
        cells = []
        for word in WORDS.values():
            found = []
            for commit in (before, "HEAD"):
                command = ["git", "grep", "-Pih", word, commit, "--", *paths]
                done = subprocess.run(
                    command, capture_output=True, text=True, check=False, cwd=ROOT
                )
                found.append(str(len(done.stdout.splitlines())))
            cells.append(" to ".join(found))
        print(f"| {part} | {' | '.join(cells)} |")


def plain(text: str) -> str:
    """Text on one line, in small letters, without quotation marks; strings of adjacent lines are joined."""
    return re.sub(r"\s+", " ", re.sub(r"[\"'`“”]", "", text)).lower()


def product() -> str:
    """All that users read, and its source."""
    files = [ROOT / place for place in PLACES]
    paths = [path for place in files for path in ([place] if place.is_file() else place.rglob("*"))]
    return "\n".join(plain(path.read_text()) for path in paths if path.suffix in ENDINGS)


def main() -> int:
    """Check every row, or count."""
    if "--counts" in sys.argv:
        counts(sys.argv[-1])
        return 0
    table = (ROOT / "analysis" / "words_before_after.md").read_text().splitlines()
    rows = [line.strip("| ").split(" | ") for line in table if re.match(r"\| \d", line)]
    text, wrong = product(), 0
    for number, _, before, now in rows:
        parts = re.split(r"\.\.\.| / |\d[\d.e%-]*|\(eq", plain(before))
        parts = [part.strip(" ;:,.") for part in parts]
        if re.search(r"\b" + ".{0,40}".join(map(re.escape, filter(None, parts))), text):
            print(f"{number}: still there: {before}")
            wrong += 1
        if now != "-" and plain(now).strip(" .") not in text:
            print(f"{number}: not found: {now}")
            wrong += 1
    print(f"{len(rows)} rows, {wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
