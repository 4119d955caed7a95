"""Functions written out as one text: it does what their calls do, holds what is on, and is kept for the next process."""

import os
import subprocess
import sys
from pathlib import Path

from patience import crowded

from hpcclear.base import code_folder


def test_a_source_that_was_written_is_noticed_whatever_its_size_and_time(tmp_path):
    path = tmp_path / "law.py"
    path.write_text("k = 1.0\n")
    about, before = path.stat(), code_folder._listing(tmp_path)
    assert code_folder._listing(tmp_path) == before
    path.write_text("k = 2.0\n")
    os.utime(path, ns=(about.st_atime_ns, about.st_mtime_ns))
    assert code_folder._listing(tmp_path) != before


def test_the_key_of_the_sources_is_the_same_read_or_computed(tmp_path):
    tmp_path.chmod(0o700)
    code = "from hpcclear.base import code_folder as c; print(c.source_key(), c._place()[0])"
    found, kept = [], None
    for line in (None, "another key\n", "damaged", None):
        if line is not None and kept is not None:
            kept.write_text(line)
        done = subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "HPCCLEAR_CACHE": str(tmp_path)},
            capture_output=True, text=True, check=True, timeout=crowded(120),
        )  # fmt: skip
        key, folder = done.stdout.split()
        kept = Path(folder) / "sources"
        assert kept.read_text().split()[1] == key
        found.append(key)
    assert set(found) == {code_folder.source_key()}
