"""`cite`: how to cite the program, and the paper whose method it implements."""

import click

from hpcclear import __version__
from hpcclear.cli.options import of_one_process, show
from hpcclear.ranks.stopping import Exit

PROGRAM = f"""@software{{hpcclear,
  author  = {{{{The hpcclear developers}}}},
  title   = {{hpcclear: MPI-parallel robust design of mechanisms with clearance joints}},
  version = {{{__version__}}},
  license = {{BSD-3-Clause}},
}}"""


@click.command(short_help="Print how to cite the program and the paper.")
@of_one_process
def cite() -> int:
    """Print BibTeX entries of this version of the program and of the paper whose method it implements.

    Each contact and friction law has a source of its own: hpcclear laws.

    Example: hpcclear cite > hpcclear.bib
    """
    from hpcclear.scene.citation import BIBTEX

    show(f"{PROGRAM}\n\n{BIBTEX}")
    return Exit.DONE
