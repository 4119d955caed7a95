"""Documentation: every block of code and every command on its pages runs, what they name exists, and the site builds."""

import os
import re
import subprocess
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import click
import hooks
import matplotlib.pyplot as plt
import outputs
import pytest
import reference
import start_page
from doc_pages import PAGES, ROOT, Block, Reader, blocks, tokens
from markdown_it import MarkdownIt
from patience import crowded

from hpcclear.cli import cli

BLOCKS = {str(page.relative_to(ROOT)): blocks(page) for page in PAGES}
RUN = [name for name, found in BLOCKS.items() if any(b.runs and not b.slow for b in found)]
SLOW = [name for name, found in BLOCKS.items() if any(b.runs and b.slow for b in found)]


def follow(todo: list[Block], place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Do what a page says, from top to bottom."""
    reader = Reader(place)
    monkeypatch.chdir(place)
    for block in todo:
        reader.do(block)
    plt.close("all")


@pytest.mark.nightly
@pytest.mark.parametrize("name", RUN)
def test_blocks_of_a_page_run_in_their_order(name, tmp_path, monkeypatch):
    todo = [block for block in BLOCKS[name] if block.runs and not block.slow]
    follow(todo, tmp_path / "checkout", monkeypatch)


@pytest.mark.full
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("name", SLOW)
def test_slow_blocks_run_too(name, tmp_path, monkeypatch):
    follow([b for b in BLOCKS[name] if b.runs], tmp_path / "checkout", monkeypatch)


def inline(page: Path) -> list[str]:
    """Code within sentences and tables."""
    return [
        child.content
        for token in tokens(page)
        for child in token.children or ()
        if child.type == "code_inline"
    ]


@pytest.mark.parametrize("page", PAGES, ids=list(BLOCKS))
def test_files_that_are_named_exist(page):
    text = " ".join(inline(page) + [b.text for b in blocks(page) if b.language == "bash"])
    for name in re.findall(r"(?<![\w./-])(?:tests|analysis|jobs|docs|hpcclear)/[\w./-]+\w", text):
        assert (ROOT / name).exists(), f"{page} names {name}"


@pytest.mark.full
def test_pictures_of_pages_are_drawn_of_their_scenes(tmp_path):
    program = [sys.executable, ROOT / "analysis" / "page_pictures.py", "-o", tmp_path]
    subprocess.run(program, check=True, timeout=crowded(600.0))
    drawn = {path.name: plt.imread(path).shape for path in tmp_path.iterdir()}
    assert len(drawn) == 2
    assert drawn == {name: plt.imread(ROOT / "docs" / "images" / name).shape for name in drawn}


@pytest.mark.parametrize("page", PAGES, ids=list(BLOCKS))
def test_commands_and_options_that_are_named_exist(page):
    options = {
        word
        for command in (cli, *cli.every().values())
        for parameter in command.params
        if isinstance(parameter, click.Option)
        for word in parameter.opts
    }
    for text in inline(page):
        if found := re.match(r"(?:mpiexec -n \S+ )?hpcclear ([a-z]+)", text):
            command = cli.every()[found[1]]
            known = {word for p in command.params for word in (*p.opts, *p.secondary_opts)} | {
                "--help",
                "-h",
            }
            used = {word for word in text.split() if word.startswith("-") and word != "-n"}
            assert used <= known, f"{page}: {text}"
        elif re.fullmatch(r"--[a-z-]+( \S+)?", text) and "sbatch" not in text:
            assert text.split()[0] in options | FOREIGN, f"{page}: {text}"


FOREIGN = {
    "--kill-on-bad-exit", "--mpi", "--help", "--contain", "--bind", "--full", "--last-bits", "--quick", "--nightly", "--tests",
    "--tagged", "--changes", "--only", "--shm-size", "--latest", "--lowest", "--with",
}  # fmt: skip
"""Options of other programs: srun, apptainer, the two commands, tests/elsewhere.sh."""


@cache
def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    found = tokens(page)
    headings = [
        found[k + 1].content for k, token in enumerate(found) if token.type == "heading_open"
    ]
    return {re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-") for text in headings}


@pytest.mark.parametrize("page", PAGES, ids=list(BLOCKS))
def test_links_lead_somewhere(page):
    for token in tokens(page):
        for child in token.children or ():
            target = child.attrs.get("href") or child.attrs.get("src") or ""
            path, _, anchor = str(target).partition("#")
            if not target or re.match(r"https?:", path):
                continue
            place = (page.parent / path).resolve() if path else page
            assert place.exists(), f"{page} links to {target}"
            if anchor and place.name != "python.md":  # headings there are made by the site
                assert anchor in anchors(place), f"{page} links to {target}"


@pytest.mark.parametrize("page", PAGES, ids=list(BLOCKS))
def test_measured_results_fill_the_pages(page):
    """Each line that stands for a table has a file, and the site shows it whole."""
    text = page.read_text(encoding="utf-8")
    shown = hooks.on_page_markdown(text)
    assert "[measured:" not in shown.replace("`[measured:", "")
    for match in hooks.MEASURED.finditer(text):
        parsed = MarkdownIt().enable("table").parse(hooks.table(match[1]))
        assert sum(token.type == "tr_open" for token in parsed) > 1, match[1]
        assert hooks.table(match[1]) in shown


@pytest.mark.parametrize("page", start_page.PAGES, ids=lambda page: page.name)
def test_start_pages_begin_with_a_film_and_a_sentence_with_the_numbers_of_its_file(page):
    """`python analysis/start_page.py` makes both anew."""
    text = page.read_text(encoding="utf-8")
    assert text == start_page.filled(page)
    places = [text.index(f"images/{start_page.FILM.name}"), start_page.PLACE.search(text).start()]
    assert places == sorted(places)
    assert places[1] < text.index("| you want to | read |") < text.index("\n## ")
    assert start_page.FILM.stat().st_size < 600_000


@pytest.mark.parametrize("name", ["tutorial", "how-to/effects", "how-to/identify"])
def test_sample_outputs_are_those_that_were_recorded(name):
    """`python analysis/outputs.py` makes them anew."""
    page = ROOT / "docs" / f"{name}.md"
    assert "```text from analysis/results/output_" in page.read_text(encoding="utf-8")
    assert page.read_text(encoding="utf-8") == outputs.filled(page)


class Site(HTMLParser):
    """What a page of the site loads, and its text."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.text = ""
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = dict(attrs)
        if tag in ("script", "img") and known.get("src"):
            self.loads.append(str(known["src"]))
        if tag == "link" and known.get("rel") == "stylesheet":
            self.loads.append(str(known["href"]))

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built with every warning an error."""
    place = tmp_path_factory.mktemp("site")
    program = str(Path(sys.executable).with_name("mkdocs"))
    done = subprocess.run(
        [program, "build", "--strict", "-f", ROOT / "docs/mkdocs/mkdocs.yml", "-d", place],
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        timeout=crowded(300),
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return place


@pytest.mark.nightly
def test_the_site_has_every_page_and_loads_nothing_from_elsewhere(site):
    made = {str(path.relative_to(site).with_suffix("")) for path in site.rglob("*.html")}
    pages = {str(page.relative_to(ROOT / "docs").with_suffix("")) for page in PAGES[2:]}
    assert made == pages | {"404"}
    for path in site.rglob("*.html"):
        for address in Site(path).loads:
            assert not re.match(r"(https?:)?//", address), f"{path} loads {address}"


@pytest.mark.parametrize("name", reference.MADE)
def test_the_reference_is_what_the_package_says(name):
    """`python docs/mkdocs/reference.py` writes it anew."""
    path, wanted = reference.page(name)
    assert path.read_text(encoding="utf-8") == wanted


def test_every_table_of_a_scene_has_an_example_and_every_entry_a_meaning():
    tables = {name: "\n".join(lines) for name, lines in reference.scene_sections().items()}
    without = [name for name, part in tables.items() if "```toml" not in part]
    # Their tables stand below them, each with its own example; the program writes those of plug-ins into result files.
    written = ["[plugins]", "[plugins.files.NAME]", "[plugins.packages.NAME]"]
    assert sorted(without) == sorted(["The file", *written])
    for name, part in tables.items():
        for row in re.findall(r"^\| `.*$", part, re.M):
            assert row.startswith("| `kind`") or not row.endswith("|  |"), f"{name}: {row}"
