"""Commands and options of earlier versions: what to use instead of them."""

from typer.core import TyperGroup

from dusttaichi.errors import DustError

REMOVED = {
    "selftest": "dust bench states the energy ledger of its two scenes; to check a device, "
    "compare a run with numerics.backend: cuda with one with cpu (dust compare)",
}
"""Message by "COMMAND" or "COMMAND --option"."""


class Commands(TyperGroup):
    """The group of commands; a removed command or option is answered by its message."""

    def resolve_command(self, ctx, args):
        """The command of these words. Raises DustError for a removed one."""
        _refuse(args[0])
        return super().resolve_command(ctx, args)

    def invoke(self, ctx):
        """Run the command. Raises DustError for a removed option."""
        try:
            return super().invoke(ctx)
        except Exception as error:  # NoSuchOption, of click or of the one that typer brings along
            option = getattr(error, "option_name", None)
            if option is not None and error.ctx is not None:
                _refuse(f"{error.ctx.info_name} {option}")
            raise


def _refuse(words):
    if words in REMOVED:
        raise DustError(f"dust {words} was removed: {REMOVED[words]}")
