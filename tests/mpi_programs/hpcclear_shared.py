"""The real command, where leaders of nodes share samples out however few ranks there are: hpcclear_shared.py ARGUMENTS."""

from hpcclear.cli import main
from hpcclear.ensemble import statistics

if __name__ == "__main__":
    statistics.SHARED_FROM = 2
    main()
