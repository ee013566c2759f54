"""The toy method is there, as if an extension had registered it."""

import pytest
import spring

from dusttaichi import method


@pytest.fixture(autouse=True)
def known(monkeypatch):
    monkeypatch.setattr(method.METHODS, "added", dict(method.METHODS.added))
    method.register(spring.METHOD)
