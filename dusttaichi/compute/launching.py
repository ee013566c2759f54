"""Launches of kernels without arguments, with little work of Python for each.

At every call Taichi inspects the arguments, finds the compiled kernel and creates a context of the
launch. That takes some 30 us, as long as a step of a small scene on a device.
"""

from dusttaichi.compute.engine import program, tested, ti

LOOK = 16  # steps that are launched before the host reads the progress of the device
REASONS = 4  # reasons why no further step may begin are numbers from 1 to below this


class Progress:
    """Progress of a device.

    (number in place `done` of the field `sync`, reason in place `stop`, 0 if a further step may
    begin).
    """

    def __init__(self, sync, done, stop):
        @ti.kernel
        def read() -> ti.i32:
            return REASONS * sync[done] + sync[stop]

        self._launch = Launch(read)

    def __call__(self):
        return divmod(self._launch(), REASONS)


class PassOnChange:
    """A kernel that writes its arguments to fields.

    It is launched if they are not the same objects as in the previous call.
    """

    def __init__(self, kernel):
        self.kernel, self._last = kernel, ()

    def __call__(self, *arguments):
        same = len(self._last) == len(arguments)
        if not (same and all(a is b for a, b in zip(self._last, arguments, strict=True))):
            self.kernel(*arguments)
            self._last = arguments


class Launch:
    """A kernel without arguments, which may return one integer; it is called like the kernel.

    The compiled kernel of the first call is reused until Taichi is restarted. In versions of Taichi
    that have not been tested, and with Quadrants, which is quick, every call is the compiler's own.
    """

    def __init__(self, kernel):
        self.kernel, self._returns = kernel, bool(kernel._primal.return_type)
        self._program, self._own, self._compiled, self._context = (None,) * 4

    def __call__(self):
        running = program()
        if self._own is None or running is not self._program:
            out = self.kernel()
            if tested():
                self._remember(running)
            return out
        if not self._returns:
            running.launch_kernel(self._compiled, self._context)
            return None
        # a launch redirects the result of its context to the device: each needs a new one
        context = self._own.make_launch_context()
        running.launch_kernel(self._compiled, context)
        ti.sync()
        return context.get_struct_ret_int((0,))

    def _remember(self, running):
        (self._own,) = self.kernel._primal.compiled_kernels.values()
        settings, device = running.config(), running.get_device_caps()
        self._program, self._context = running, self._own.make_launch_context()
        self._compiled = running.compile_kernel(settings, device, self._own)
