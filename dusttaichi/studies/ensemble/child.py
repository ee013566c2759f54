"""One run of an ensemble in a process of its own: Taichi and the handlers of signals are its own.

The request comes as a line of JSON on the standard input. Progress goes as lines of JSON to the
standard output, {"share": 0.4}, and at last the outcome, {"code": 0, "text": ""}; whatever else is
printed goes to the standard error. When the input ends, also because the process that asked is
gone, the run stops as after Ctrl-C, with its checkpoint written.
"""

import json
import os
import signal
import sys
import threading
import time

from dusttaichi.errors import DustError

TELL_EVERY = 0.5  # s


def main():
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be inherited as ignored
    request = json.loads(sys.stdin.readline())
    threading.Thread(target=stop_with_the_input, daemon=True).start()

    def tell(**what):
        print(json.dumps(what), file=answers, flush=True)

    try:
        _run(request, tell)
        tell(code=0, text="")
    except DustError as error:
        tell(code=error.exit_code, text=str(error))
    except KeyboardInterrupt:
        tell(code=130, text="interrupted")


def stop_with_the_input():
    # not sys.stdin, whose lock would be held when the interpreter ends
    os.read(0, 1)
    os.kill(os.getpid(), signal.SIGINT)


def _run(request, tell):
    from dusttaichi import analysis, plots
    from dusttaichi.run.loop import execute
    from dusttaichi.scene import from_yaml

    told = 0.0

    def watch(progress):
        nonlocal told
        if time.monotonic() - told > TELL_EVERY and progress.end and not progress.task:
            told = time.monotonic()
            tell(share=progress.step / progress.end)

    directory, mode = request["directory"], request["mode"]
    execute(
        from_yaml(request["scene"]),
        directory,
        force=mode == "force",
        resume=mode == "resume",
        error_bar=request["error_bar"],
        watch=watch,
    )
    with analysis.open_run(directory) as result:
        plots.save_all(result, directory)


if __name__ == "__main__":
    main()
