"""The toy method is there, as if an extension had registered it."""

import pytest
import spring

from dusttaichi import method


@pytest.fixture(autouse=True)
def known(monkeypatch):
    monkeypatch.setattr(method, "METHODS", dict(method.METHODS))
    method.register(spring.METHOD)
