"""What stands in ro-crate-metadata.json, against the profile's requirements and the files themselves."""

import hashlib
import json
from pathlib import Path

import opened
import pytest
import report_data as data

from hpcclear.base.errors import InputError
from hpcclear.results.crate import NAME, PROFILE, write_crate


@pytest.fixture
def results(tmp_path) -> Path:
    opened.write(data.samples(), tmp_path / "samples.nc")
    opened.write(data.timing(), tmp_path / "timing.nc")
    (tmp_path / "responses").mkdir()
    opened.write(data.response(2), tmp_path / "responses" / "original.nc")
    return tmp_path


def test_every_result_is_described_and_made_by_one_run(results):
    content = json.loads(write_crate(results).read_text(encoding="utf-8"))
    graph = {one["@id"]: one for one in content["@graph"]}
    assert len(graph) == len(content["@graph"])
    assert graph[NAME]["about"] == {"@id": "./"}
    root = graph["./"]
    assert root["conformsTo"] == {"@id": PROFILE}
    assert {"name", "description", "datePublished", "license"} <= set(root)
    names = ["samples.nc", "timing.nc", "responses/original.nc"]
    assert [part["@id"] for part in root["hasPart"]] == names
    run = graph[root["mentions"]["@id"]]
    assert run["@type"] == "CreateAction"
    assert run["result"] == root["hasPart"]
    assert graph[run["instrument"]["@id"]]["@type"] == "SoftwareApplication"
    samples = opened.read(results / "samples.nc")
    assert graph[run["object"]["@id"]]["text"] == samples.attrs["scene"]
    assert "mpiexec" in run["description"]
    for name in names:
        written = (results / name).read_bytes()
        assert graph[name]["@type"] == "File"
        assert graph[name]["contentSize"] == str(len(written))
        assert graph[name]["sha256"] == hashlib.sha256(written).hexdigest()


def test_equal_results_give_equal_crates_and_other_files_stay(results):
    first = write_crate(results).read_bytes()
    assert write_crate(results).read_bytes() == first
    (results / NAME).write_bytes(first.replace(b"not stated", b"CC-BY-4.0"))
    with pytest.raises(InputError, match="was not written by hpcclear"):
        write_crate(results)
    assert b"CC-BY-4.0" in (results / NAME).read_bytes()


def test_a_run_under_way_is_no_result(results):
    parts = results / ".samples.nc.parts"
    parts.mkdir()
    opened.write(data.samples(), parts / "part-00-000000.nc")
    assert "part-00" not in write_crate(results).read_text()


@pytest.mark.parametrize(
    ("place", "reason"), [("", "no result file"), ("nowhere", "no such directory")]
)
def test_without_results_there_is_nothing_to_describe(tmp_path, place, reason):
    with pytest.raises(InputError, match=reason):
        write_crate(tmp_path / place)
