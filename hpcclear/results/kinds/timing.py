"""How the ranks spent their time."""

from hpcclear.results.rows import ResultKind, count, number, text

KIND = ResultKind(
    170, "Run time of the ranks", ("rank", "stage"), absent="the time of the ranks is not known",
    table={
        "rank": count("rank", "MPI rank"),
        "stage": text("stage", "stage of the run"),
        "busy": number("rank stage", "s", "time spent computing", required=True),
        "idle": number("rank stage", "s", "time spent waiting for other ranks", required=True),
        "compile": number("rank stage", "s", "time spent compiling", required=True),
        "write": number("rank stage", "s", "time spent writing checkpoints and results", required=True),
        "command": text("", "the command that was run", required=True),
    },
)
