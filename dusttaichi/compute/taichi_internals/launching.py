"""Launches of kernels with little overhead in Python.

At every call Taichi inspects the arguments, finds the compiled kernel and creates a context of the
launch. That takes 30 to 100 us, as long as many steps of a small scene.
"""

from dusttaichi.compute.engine import is_tested, program, settings, ti

LOOK = 16  # steps that are launched before the host reads the progress of the device


class Launch:
    """A kernel that takes numbers and structs, and may return one integer; called like the kernel.

    The compiled kernel of the first call is reused until Taichi is restarted, and so is the context
    of a launch: only those arguments are passed that are other objects than in the call before, so
    that a struct must not be changed. In versions of Taichi that have not been tested, with
    numerics.debug, and with Quadrants, which is quick, every call is the compiler's own.
    """

    def __init__(self, kernel):
        self.kernel, self._returns = kernel, bool(kernel._primal.return_type)
        self._program, self._kernel_data, self._compiled, self._context, self._last = (None,) * 5
        self._passes, self._renews = None, False

    def __call__(self, *arguments):
        running = program()
        if self._program is None or running is not self._program:
            out = self.kernel(*arguments)
            if is_tested() and not settings().debug:
                self._remember(running)
            return out
        # a launch redirects result and arguments of its context to the device: each needs a new one
        if self._renews:
            self._renew()
        # interrupted, the context has some of these arguments: the next call passes all
        last, self._last = self._last, (None,) * len(arguments)
        for pass_argument, argument, last_argument in zip(
            self._passes, arguments, last, strict=True
        ):
            if argument is not last_argument:
                pass_argument(self._context, argument)
        self._last = arguments
        running.launch_kernel(self._compiled, self._context)
        if not self._returns:
            return None
        ti.sync()
        return self._context.get_struct_ret_int((0,))

    def _remember(self, running):
        primal, self._program = self.kernel._primal, None
        if self._passes is None:
            self._passes = [
                _choose_passing(n, parameter.annotation)
                for n, parameter in enumerate(primal.arguments)
            ]
        if None in self._passes:
            return
        (self._kernel_data,) = primal.compiled_kernels.values()
        config, device = running.config(), running.get_device_caps()
        self._compiled = running.compile_kernel(config, device, self._kernel_data)
        self._renews = self._returns or (bool(self._passes) and settings().arch != ti.cpu)
        self._renew()
        self._program = running  # last: an exception between any two lines leaves it None

    def _renew(self):
        self._last = (None,) * len(self._passes)
        self._context = self._kernel_data.make_launch_context()


def _choose_passing(number, annotation):
    """Function that passes an argument of a type to a context; None for other types."""
    if annotation in (ti.f64, ti.f32):
        return lambda context, value: context.set_arg_float((number,), float(value))
    if annotation in (ti.i64, ti.i32):
        return lambda context, value: context.set_arg_int((number,), int(value))
    if isinstance(annotation, ti.lang.struct.StructType):
        return lambda context, value: annotation.set_kernel_struct_args(value, context, (number,))
    return None
