"""A removed command or option is answered with what to use instead."""

import re

import pytest

from dusttaichi.commands import app as cli
from dusttaichi.commands.removed import REMOVED
from dusttaichi.errors import DustError


@pytest.mark.parametrize("words", REMOVED)
def test_what_was_removed_says_what_to_use(words):
    said = f"dust {re.escape(words)} was removed: {re.escape(REMOVED[words])}"
    with pytest.raises(DustError, match=said):
        cli.app(words.split(), standalone_mode=False)
