"""What differs between the compilers (dusttaichi/compiler.py) for tests."""

import pytest

from dusttaichi import compiler

taichi_alone = pytest.mark.skipif(compiler.name() != "taichi", reason="internals of Taichi")
