"""The toy method is there, as if a package had brought it along."""

import pytest
import spring

from dusttaichi import method


@pytest.fixture(autouse=True)
def known(monkeypatch):
    monkeypatch.setattr(method, "METHODS", dict(method.METHODS))
    method.register(spring.METHOD)
