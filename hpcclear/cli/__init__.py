"""The commands. Each parses its words, calls one function of the package, and prints what a person wants to know.

Exit codes: 0 done, 1 failed, 2 bad input, 3 stopped early (the same command goes on from there), 4 done, but f is not
known to the target error.
"""

import importlib
import io
import os
import sys
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from hpcclear import __version__
from hpcclear.base.errors import (
    InputError,
    LimitError,
    StorageError,
    check_address_space,
    mendable,
    nearest,
)
from hpcclear.base.remarks import listen
from hpcclear.cli import commands
from hpcclear.cli.options import GROUPS, Command, Written, is_root, say
from hpcclear.ranks.launcher import end_job, is_launched, pin_threads
from hpcclear.ranks.stopping import Exit, StopSwitch
from hpcclear.ranks.terminal import clear

if TYPE_CHECKING:
    from hpcclear.scene import Scene

OLD = {
    "import": "init --import",
    "schema": "show schema",
    "laws": "show laws",
    "cite": "show citation",
    "merge": "sample --merge",
    "bifurcation": "map --bifurcation",
    "plan": "accuracy --plan",
    "crate": "reproduce --crate",
}
"""Former names of commands, not listed, and the words that stand for them."""


class Program(click.Group):
    """The commands: each is a file of `hpcclear.cli.commands`, loaded when it is called or listed."""

    def every(self) -> dict[str, Command]:
        """All commands by name, in the order of their groups."""
        found = {name: _load(name) for name in _names()}
        return dict(sorted(found.items(), key=lambda one: [*GROUPS].index(one[1].group)))

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands, in the order of their groups."""
        return list(self.every())

    def get_command(self, ctx: click.Context, cmd_name: str) -> Command | None:
        """The command of a name; None if there is none."""
        return _load(cmd_name) if cmd_name in _names() else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The name of a command, the command and its words, from those of the program."""
        new = OLD[args[0]].split() if args[0] in OLD else args[:1]
        if new[0] not in (known := _names()) and not ctx.resilient_parsing:
            raise click.UsageError(f"No such command {new[0]!r}. {nearest(new[0], known)}", ctx)
        return super().resolve_command(ctx, [*new, *args[1:]])

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands, a section for each group."""
        for group, title in GROUPS.items():
            own = ((name, one) for name, one in self.every().items() if one.group == group)
            with formatter.section(title):
                formatter.write_dl([(name, one.short_help or "") for name, one in own])


def _names() -> list[str]:
    names = os.listdir(commands.__path__[0])
    return sorted(name[:-3] for name in names if name.endswith(".py") and name[0] != "_")


def _load(name: str) -> Command:
    return importlib.import_module(f"{commands.__name__}.{name}").run


@click.group(
    cls=Program, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(__version__, prog_name="hpcclear")
def cli() -> None:
    """Robust design of mechanisms with clearance joints.

    Input files (scenes) are TOML; results are NetCDF files that open in xarray. To use more than one
    core, start commands of the group Compute, except simulate, under mpiexec:

        mpiexec -n 4 hpcclear sample jobs/quickstart.toml -o results/samples.nc
    """


def loaded(written: Written) -> "Scene":
    """Return the scene of a command, after printing the Python files that it runs, readings and likely slips of units."""
    from hpcclear.scene import load_scene
    from hpcclear.scene.describing import implausible
    from hpcclear.scene.plugged import files_run

    scene = load_scene(*written)
    for text in (*files_run(scene.plugins), *map(str, scene.readings)):
        say(f"Note: {text}")
    for text in implausible(scene):
        say(f"Warning: {text}")
    return scene


def _check_words(words: Sequence[str]) -> None:
    """Raise UsageError where a word is no text: it would have to stand in result files, which hold text only."""
    for word in words:
        if not word.isascii() and word != word.encode("utf-8", "replace").decode():
            raise click.UsageError(f"{word!r} is not UTF-8 text. Choose another name")


def _refused(error: click.ClickException) -> int:
    """Say what is wrong with the words of a command; ranks that got other words do not wait for this one."""
    context = getattr(error, "ctx", None)
    if is_launched() and (context is None or getattr(context.command, "ranks", True)):
        from hpcclear.ranks.boundary import refuse_together

        text = io.StringIO()
        error.show(text)
        return refuse_together(text.getvalue().rstrip())
    if is_root():
        error.show()
    return Exit.BAD_INPUT


def main(arguments: list[str] | None = None) -> None:
    """Entry point of both ``hpcclear`` and ``python -m hpcclear``; ends the process with the exit code."""
    listen(say)
    # one line, which may quote a file
    warnings.showwarning = lambda message, *_: say(f"Warning: {message}")  # type: ignore[assignment]
    pin_threads()  # before numpy is imported: ranks fill the cores, not threads
    # no plug-ins for pydantic, for which it looks through all that is installed
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "true")
    with StopSwitch(ends_process=True) as stop, warnings.catch_warnings():
        if not sys.warnoptions:  # of divisions and overflows: a status says why a number is NaN
            warnings.simplefilter("ignore", RuntimeWarning)
        try:
            check_address_space()
            _check_words(sys.argv[1:] if arguments is None else arguments)
            code = cli.main(arguments, prog_name="hpcclear", standalone_mode=False, obj=stop)
        except click.ClickException as error:
            code = _refused(error)
        except (click.Abort, KeyboardInterrupt):
            code = Exit.STOPPED
        except LimitError as error:
            end_job(f"Error: {error}", Exit.FAILED)
            code = Exit.FAILED
        except BrokenPipeError:  # the reader of a pipe has seen enough
            sys.stderr.close()
            code = Exit.DONE
        except (InputError, StorageError, MemoryError, OSError, ImportError, SystemError) as error:
            ours = isinstance(error, InputError | StorageError)
            known = error if ours else mendable(error)
            if known is None:
                raise
            say(f"Error: {known}")
            code = Exit.BAD_INPUT if isinstance(known, InputError) else Exit.FAILED
    clear()
    sys.exit(int(code or 0))
