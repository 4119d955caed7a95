"""``python -m hpcclear``."""

from hpcclear.cli import main

if __name__ == "__main__":
    main()
