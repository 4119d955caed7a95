"""A run that is told to stop: stopping.py WHERE FOLDER [TIME_LIMIT]; see long_run.py."""

import sys

from hpcclear.ranks.stopping import StopSwitch


def main() -> int:
    with StopSwitch(ends_process=True) as stop:  # before the slow imports
        from long_run import program

        from hpcclear.ranks.boundary import run_on_ranks

        if len(sys.argv) > 3:
            stop.limit_time(float(sys.argv[3]))
        return run_on_ranks(program, stop)


if __name__ == "__main__":
    sys.exit(main())
