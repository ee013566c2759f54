"""The command `dust`.

Closed standard streams are opened on the null device first, so that no other file of the program
gets their numbers.
"""

import os
import sys

for _number, (_name, _mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
    if getattr(sys, _name) is None:
        _descriptor = os.open(os.devnull, os.O_RDWR)
        if _descriptor != _number:
            os.dup2(_descriptor, _number)
            os.close(_descriptor)
        setattr(sys, _name, os.fdopen(_number, _mode))
