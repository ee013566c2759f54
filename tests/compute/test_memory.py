"""The room of fields."""

import sys

import pytest
from program import python

FIELDS = """
import resource
from dusttaichi.compute.engine import ti
from dusttaichi.compute.memory import arrays_of
from dusttaichi.errors import DustError

ti.init(ti.cpu, offline_cache=False, log_level=ti.CRITICAL)
field = ti.field(ti.f64, shape=2**30)
resource.setrlimit(resource.RLIMIT_AS, (2**32, 2**32))
try:
    arrays_of({"field": field})
except DustError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="a limit on the memory of a process is needed")
def test_fields_that_a_process_cannot_have():
    found = python("-c", FIELDS)
    assert "need 8.59 GB in one piece" in found.stdout, found.stderr
