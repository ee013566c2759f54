"""`python -m dusttaichi` is the command `dust`."""

from dusttaichi.cli import main

main()
