"""Options that the commands of studies share, the run with its bar, and its end."""

import inspect
from dataclasses import dataclass
from functools import wraps
from pathlib import Path

from dusttaichi.commands import options
from dusttaichi.commands.console import remark, say, say_json, say_written
from dusttaichi.commands.progress import progress_bar
from dusttaichi.errors import DustError

KEYWORD_ONLY = inspect.Parameter.KEYWORD_ONLY
# options of a study command: name -> type with its help text, default
SHARED = {
    "force": (options.ForceResults, False),
    "resume": (options.ResumeMissing, False),
    "part": (options.Part, None),
    "output": (options.Output, None),
    "threads": (options.Threads, None),
    "jobs": (options.Jobs, None),
    "scheduler": (options.Scheduler, None),
    "extensions": (options.Extensions, None),
    "as_json": (options.Json, False),
    "figures": (options.Figures, True),
    "quiet": (options.Quiet, False),
}


@dataclass(frozen=True)
class StudyRun:
    """The shared options of a study command, as given, and what it does with them.

    noun: plural noun for the points of the study. The other attributes are those of SHARED.
    """

    noun: str
    force: bool = False
    resume: bool = False
    part: str | None = None
    output: Path | None = None
    threads: int | None = None
    jobs: int | None = None
    scheduler: str | None = None
    extensions: bool | None = None
    as_json: bool = False
    figures: bool = True
    quiet: bool = False

    def load_scene(self, file, settings=None):
        """The scene of a YAML file with the settings and threads of the command. Raises DustError.

        Refuses --force together with --resume.
        """
        if self.force and self.resume:
            raise DustError("--force starts again, --resume continues: give only one of them")
        return options.load_scene(file, self.threads, settings, self.extensions)

    def find_folder(self, scene, word):
        """Directory of the results of a study of a scene, named after the study by default."""
        from dusttaichi.running import study_directory

        return study_directory(scene, word, self.output)

    def writing(self, *inputs):
        """Context in which files of others, and these inputs, are not overwritten."""
        return options.writing(force=self.force, inputs=inputs)

    @property
    def log(self):
        """Function that prints a line beside the progress bar; nothing with --quiet."""
        return (lambda text: None) if self.quiet else remark

    @property
    def is_partial(self):
        """True where only a part of the points is run."""
        return options.part_of(self.part) != (1, 1)

    def run(self, study, *, onward=None, every=None, log=None, **changes):
        """Run a study (study_types.Study) with a progress bar; returns label -> PointResult.

        onward: command that continues, by default this command with --resume. every: time [s]
        between two lines of progress in a log. changes: other arguments of `study_engine.run`.
        Raises DustError, Interrupted.
        """
        from dusttaichi.studies import finish

        arguments = {"force": self.force, "resume": self.resume, "scheduler": self.scheduler}
        arguments |= {"jobs": self.jobs, "part": options.part_of(self.part), "log": log}
        arguments |= {"onward": onward or options.resume_command("--resume"), "noun": self.noun}
        bar_options = {} if every is None else {"every": every}
        with progress_bar(self.quiet, **bar_options) as bar:
            return finish.run_study(study, bar, **arguments | changes)

    def run_again(self, study, **changes):
        """Run a study as `run`, of a command that always continues; --force starts again."""
        return self.run(study, resume=not self.force, onward=options.resume_command(), **changes)

    def gathering(self):
        """Context after the last run, in which an interruption says that all are computed."""
        from dusttaichi.running.interrupts import all_computed

        return all_computed(f"Dataset and figures: {options.resume_command('--resume')}")

    def say_part(self, point_results, total):
        """Print how many of `total` points a part has run, and the command that gathers all."""
        onward = options.resume_command("--resume", without="--part")
        say(f"{len(point_results)} of {total} {self.noun}; when all are done: {onward}")

    def say_result(self, data, show, paths, failure=None):
        """Print a dataset, or plain data, as JSON, or call show() instead; list the written files.

        Raises the failure of some runs, if any.
        """
        from dusttaichi.analysis.plain import convert_dataset, convert_value

        if self.as_json:
            say_json(convert_dataset(data) if hasattr(data, "data_vars") else convert_value(data))
        else:
            show()
        say_written(paths, remark if self.as_json else say)
        if failure:
            raise failure


def study_command(noun="runs", *, omit="", **changes):
    """Decorator of a command: it has the options of SHARED, and gets them as its `run`.

    noun: plural noun for the points. omit: names of options that it does not have. changes: name ->
    (type, default) of others in their place.
    """
    shared = {name: row for name, row in (SHARED | changes).items() if name not in omit.split()}

    def decorate(command):
        signature = inspect.signature(command)
        parameters = [p for name, p in signature.parameters.items() if name != "run"]
        parameters += [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind
            )
            for name, (kind, default) in shared.items()
        ]

        @wraps(command)
        def call_with_run(*arguments, **values):
            run = StudyRun(noun, **{name: values.pop(name) for name in shared})
            return command(*arguments, **values, run=run)

        call_with_run.__signature__ = signature.replace(parameters=parameters)
        call_with_run.__annotations__ = {p.name: p.annotation for p in parameters}
        return call_with_run

    return decorate
