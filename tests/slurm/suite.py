"""Submits the job scripts of jobs/ to the Slurm that SLURM_CONF names, and checks what comes back: suite.py FOLDER."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

from hpcclear.results import dataset
from hpcclear.scene import load_scene

ROOT = Path(__file__).parents[2]
FOLDER = Path(sys.argv[1])
SMALL = ("--nodes=1", "--ntasks-per-node=2", "--mem-per-cpu=0", "--open-mode=append")
SCENE = "jobs/quickstart.toml"
ENDS = ("COMPLETED", "FAILED", "TIMEOUT", "CANCELLED", "OUT_OF_MEMORY", "NODE_FAIL")
CHEAP = ("--set", "numerics.max_steps=20000", "--checkpoint-interval", "1")


def submit(script: str, log: str, *words: str, options: tuple[str, ...] = ()) -> str:
    """Number of a new job on two ranks."""
    where = f"--output={FOLDER / log}"
    command = ["sbatch", "--parsable", *SMALL, where, *options, f"jobs/{script}", *words]
    return subprocess.check_output(command, cwd=ROOT, text=True).strip()


def state(job: str) -> dict[str, str]:
    """What Slurm knows of a job."""
    shown = subprocess.check_output(["scontrol", "--oneliner", "show", "job", job], text=True)
    return dict(re.findall(r"(\w+)=(\S*)", shown))


def wait(job: str, *states: str, seconds: float = 420.0) -> dict[str, str]:
    """Wait until a job is in one of the states."""
    deadline = time.monotonic() + seconds
    while (now := state(job))["JobState"] not in states:
        if time.monotonic() > deadline:
            raise SystemExit(f"job {job} is {now['JobState']} ({now['Reason']}), not {states}")
        time.sleep(0.5)
    return now


def wait_for(path: Path, seconds: float = 180.0) -> None:
    """Wait until files of a pattern are there."""
    deadline = time.monotonic() + seconds
    while not list(path.parent.glob(path.name)):
        if time.monotonic() > deadline:
            raise SystemExit(f"{path} did not appear")
        time.sleep(0.2)


def expect(what: str, holds: bool, log: str) -> None:
    """Say what was shown, or end with the job's log."""
    if not holds:
        print((FOLDER / log).read_text(errors="replace")[-4000:])
        raise SystemExit(f"FAILED: {what}")
    print(f"ok: {what}", flush=True)


def readable(log: str, what: str) -> None:
    """What the program said stands in 80 columns, and once: places apart, and what Slurm and the scripts said."""
    lines = (FOLDER / log).read_text(errors="replace").replace(str(FOLDER), ".").splitlines()
    said = [line for line in lines if not line.startswith(("srun:", "slurmstepd:", "slurm"))]
    wide = [line for line in said if len(line) > 80]
    twice = sorted({line for line in said if line.strip() and said.count(line) > 1})
    expect(f"{what}: {len(said)} lines fit 80 columns{wide or ''}", bool(said) and not wide, log)
    expect(f"{what}: nothing is said twice{twice or ''}", not twice, log)


def study(samples: int) -> tuple[str, ...]:
    return (*CHEAP, "--set", f"study.samples={samples}")


def finished() -> tuple[Path, float]:
    """A job under srun that is done in time; its result, and how many samples a rank does in a second."""
    output = FOLDER / "finished" / "samples.nc"
    job = submit("many_nodes.slurm", "finished.log", SCENE, str(output), *study(2000))
    end = wait(job, *ENDS)
    whole = end["JobState"] == "COMPLETED" and end["ExitCode"] == "0:0"
    expect("srun --mpi=pmi2: a job finishes", whole, "finished.log")
    timing = dataset.read(output.with_suffix(".timing.nc"), "timing")
    ranks = timing.sizes["rank"]
    expect("srun --mpi=pmi2: its two ranks are one run", ranks == 2, "finished.log")
    readable("finished.log", "srun")
    return output, 2000.0 / float(timing["busy"].sum())


def undisturbed(samples: int) -> bytes:
    """The result without Slurm."""
    output = FOLDER / f"alone-{samples}" / "samples.nc"
    output.parent.mkdir()
    words = [SCENE, "-o", str(output), *study(samples), "--progress", "quiet"]
    with open(FOLDER / "alone.log", "w") as log:
        subprocess.run(["mpiexec", "-n", "2", "hpcclear", "sample", *words], stdout=log, check=True)
    return output.read_bytes()


def array() -> None:
    """Two scenes side by side in one array, with one rank each."""
    scenes = [FOLDER / f"scene_{k}.toml" for k in (0, 1)]
    for k, scene in enumerate(scenes):
        small = load_scene(ROOT / SCENE, (f"study.samples={200 + k}", "numerics.max_steps=20000"))
        scene.write_text(small.to_toml())
    options = ("--array=0-1", "--ntasks-per-node=1", f"--export=ALL,RESULTS={FOLDER / 'array'}")
    job = submit("scene_array.slurm", "array.log", *map(str, scenes), options=options)
    for k, scene in enumerate(scenes):
        end = wait(f"{job}_{k}", *ENDS)
        output = FOLDER / "array" / scene.stem / "samples.nc"
        done = end["JobState"] == "COMPLETED"
        count = dataset.read(output, "samples").sizes["sample"] if done else 0
        expect(f"array: scene {k} has a result of its own", count == 200 + k, "array.log")


def parts(samples: int, expected: bytes) -> None:
    """A design in four parts, one of them cancelled and submitted again, then merged."""
    output, log = FOLDER / "parts" / "samples.nc", "parts.log"
    words = (SCENE, str(output), *study(samples))
    options = ("--ntasks-per-node=1",)
    job = submit("sample_array.slurm", log, *words, options=(*options, "--array=1-4"))
    subprocess.run(["scancel", f"{job}_3"], check=True)
    for k in (1, 2, 4):
        end = wait(f"{job}_{k}", *ENDS, seconds=600.0)
        expect(f"parts: part {k} of 4 is done", end["JobState"] == "COMPLETED", log)
    settings = [
        *CHEAP[:2],
        "--set",
        f"study.samples={samples}",
    ]  # in the order of the parts, as files quote them
    merge = ["hpcclear", "sample", "--merge", SCENE, "-o", str(output), *settings]
    short = subprocess.run(merge, cwd=ROOT, capture_output=True, text=True, check=False)
    expect("parts: --merge names the one that is missing", "'3/4'" in short.stderr, log)
    options = (*options, "--array=3", "--export=ALL,PARTS=4")
    job = submit("sample_array.slurm", log, *words, options=options)
    wait(f"{job}_3", *ENDS, seconds=600.0)
    subprocess.run(merge, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    expect("parts: same bytes as without Slurm", output.read_bytes() == expected, log)


def requeued(samples: int, expected: bytes) -> None:
    """A job whose wall time is cut while it runs: it requeues itself and goes on to the end."""
    output, log = FOLDER / "requeued" / "samples.nc", "requeued.log"
    options = ("--time=2", "--signal=B:USR1@30")  # Slurm counts in minutes
    words = (SCENE, str(output), *study(samples))
    job = submit("many_nodes.slurm", log, *words, options=options)
    wait_for(output.parent / ".samples.nc.parts" / "part-*.nc")
    subprocess.run(["scontrol", "update", f"JobId={job}", "TimeLimit=1"], check=True)
    deadline = time.monotonic() + 180.0
    while (now := state(job))["Restarts"] == "0" and now["JobState"] not in ENDS:
        if time.monotonic() > deadline:
            break  # below, it was requeued 0 times
        time.sleep(0.2)
    # Slurm looks at the clock every half minute: in a minute USR1 could come before the script listens
    subprocess.run(["scontrol", "update", f"JobId={job}", "TimeLimit=2"], check=False)
    end = wait(job, *ENDS, seconds=1200.0)
    text, turns = (FOLDER / log).read_text(errors="replace"), int(end["Restarts"])
    expect("wall time: the job ends complete", end["JobState"] == "COMPLETED", log)
    expect(f"wall time: it was requeued {turns} times", turns >= 1, log)
    stops = text.count("SIGUSR1 was received")
    expect("wall time: each turn ended with exit code 3 on USR1", stops == turns, log)
    expect("wall time: same bytes as without Slurm", output.read_bytes() == expected, log)


def cancelled(samples: int, expected: bytes) -> None:
    """A job under mpiexec that is cancelled by hand, then submitted again."""
    output, log = FOLDER / "cancelled" / "samples.nc", "cancelled.log"
    output.parent.mkdir()
    sample = f"mpiexec -n 2 hpcclear sample {SCENE} -o {output} {' '.join(study(samples))}"
    script = FOLDER / "mpiexec.slurm"
    script.write_text(f"#!/usr/bin/env bash\nexec bash jobs/until_done.sh {sample}\n")
    command = ["sbatch", "--parsable", *SMALL, f"--output={FOLDER / log}", str(script)]
    job = subprocess.check_output(command, text=True).strip()
    wait_for(output.parent / ".samples.nc.parts" / "part-*.nc")
    began = time.monotonic()
    subprocess.run(["scancel", job], check=True)
    wait(job, "CANCELLED")
    elapsed = time.monotonic() - began
    parts = list(output.parent.glob(".samples.nc.parts/part-*.nc"))
    kept = sum(dataset.read(part, "samples").sizes["sample"] for part in parts)
    expect(f"cancelled: ended in {elapsed:.1f} s with {kept} samples", 0 < kept < samples, log)
    stopped = "SIGTERM was received" in (FOLDER / log).read_text(errors="replace")
    expect("cancelled: the run stopped by itself, on TERM", stopped, log)
    job = subprocess.check_output(command, text=True).strip()
    end = wait(job, *ENDS, seconds=900.0)
    expect("mpiexec: submitted again by hand, it is done", end["JobState"] == "COMPLETED", log)
    expect("cancelled: same bytes as without Slurm", output.read_bytes() == expected, log)


def main() -> None:
    FOLDER.mkdir()
    os.chdir(ROOT)
    output, rate = finished()
    same = output.read_bytes() == undisturbed(2000)
    expect("srun: same bytes as without Slurm", same, "finished.log")
    array()
    parts(2000, output.read_bytes())
    # a minute and a half of work for two ranks: the wall time is cut to one minute, of which half is left
    samples = int(3 * rate * 60.0)
    expected = undisturbed(samples)
    requeued(samples, expected)
    cancelled(samples, expected)
    print("Slurm suite: passed")


if __name__ == "__main__":
    main()
