"""The progress bar of the commands."""

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from dusttaichi.commands.console import err

SHOWN = 4  # tasks side by side that the bar tells of


class ProgressBar:
    """One line that tells how far a command is: what it does, a share, a state, the time left.

    A context manager. quiet: show nothing; then `log` is silent, too, if `log_quietly` is false.
    The bar is seen from the first `show` on.
    """

    def __init__(self, quiet=False, description=None, *, log_quietly=True):
        self._logs = log_quietly or not quiet
        self._bar = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.percentage:>5.1f} %", markup=False),
            TextColumn("{task.fields[state]}", markup=False),
            TimeRemainingColumn(),
            console=err,
            disable=quiet,
        )
        self._task = self._bar.add_task(
            description or "", total=None, state="", visible=description is not None
        )

    def __enter__(self):
        self._bar.start()
        return self

    def __exit__(self, *_):
        self._bar.stop()

    def show(self, description, completed, total, state=""):
        """Show that `completed` of `total` is done; total None where it is not known."""
        self._bar.update(
            self._task,
            description=description,
            completed=completed,
            total=total,
            state=state,
            visible=True,
        )

    def log(self, text):
        """Print a line above the bar."""
        if self._logs:
            self._bar.console.print(text, soft_wrap=True)


def shares_text(running):
    """The first few of what runs side by side. running: label -> share that is done."""
    return "  ".join(f"{label} {share:.0%}" for label, share in list(running.items())[:SHOWN])
