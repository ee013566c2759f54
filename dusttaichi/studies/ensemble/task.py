"""Task of a worker process for a run of an ensemble."""


def run(parent, *, scene, directory, mode, error_bar):
    """Run a scene (text of its YAML) into a directory.

    mode: "new", "force" (start anew) or "resume". error_bar: estimate the error of the time step at
    the end. The share that is done is reported on the way. Raises what `execute` raises.
    """
    from dusttaichi.run import execute
    from dusttaichi.scene import from_yaml

    def report(progress):
        if progress.end and not progress.task:
            parent.progress(share=progress.step / progress.end)

    execute(
        from_yaml(scene),
        directory,
        force=mode == "force",
        resume=mode == "resume",
        error_bar=error_bar,
        report=report,
    )
