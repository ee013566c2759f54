"""`python -m dusttaichi` is the command `dust`."""

from dusttaichi.commands.app import main

main()
