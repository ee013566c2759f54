"""The progress bar of the commands."""

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


def progress_bar(console, quiet):
    """A rich Progress with a description, a share, a `state` text and the time left."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>5.1f} %"),
        TextColumn("{task.fields[state]}"),
        TimeRemainingColumn(),
        console=console,
        disable=quiet,
    )
