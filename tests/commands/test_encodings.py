"""Terminals whose encoding lacks characters of the tables: words in their place."""

import os

import pytest
from program import python

ENCODINGS = [{"PYTHONIOENCODING": "ascii"}, {"PYTHONIOENCODING": "cp1252"}]
ENCODINGS += [{"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}]
PRINT = r"""
from dusttaichi.commands.app import main
import typer
from dusttaichi.commands.console import err, say, say_json, say_table
from dusttaichi.errors import DustError
app = typer.Typer()

@app.command()
def show():
    say("\u03c6 = 0.3 \u00b5m \u00b1 1 \u2603")
    say_table([("\u03c6", "1 \u00b5m")], "\u03c1", "\u03a3")
    say_json({"\u03c6": "\u00b5"})
    raise DustError("\u03c6 is wrong")

main(app)
"""


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_characters_that_an_encoding_lacks(encoding):
    process = python("-c", PRINT, env=os.environ | encoding, encoding="latin-1")
    assert process.returncode == 2 and "Traceback" not in process.stderr, process.stderr
    assert (
        "phi = 0.3" in process.stdout and "?" in process.stdout and "phi is wrong" in process.stderr
    )
    assert '"\\u03c6": "\\u00b5"' in process.stdout
