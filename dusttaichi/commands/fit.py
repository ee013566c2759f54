"""`dust fit`: a number of the model from a measurement."""

from typing import Annotated

import typer

from dusttaichi.commands.console import say
from dusttaichi.errors import DustError


def fit(
    what: Annotated[str, typer.Argument(help="asperities", metavar="WHAT")],
    material: Annotated[str, typer.Option(help="a named material")] = "silica_pd08",
    speed: Annotated[str, typer.Option(help="sticking speed on a flat wall")] = "1.2 m/s",
):
    """Fit a number of the model: `asperities`, their volume, to a sticking speed."""
    from pydantic import TypeAdapter, ValidationError

    from dusttaichi.scene import quantities
    from dusttaichi.studies import asperity_fit

    if what != "asperities":
        raise DustError(f"fit {what}: there is nothing to fit of that name; allowed: asperities")
    mark = Annotated[float, quantities.Quantity("speed", gt=0)]
    try:
        wanted = TypeAdapter(mark).validate_python(speed)
    except ValidationError as error:
        raise DustError(f"--speed = {speed!r}: {error.errors()[0]['msg']}") from None
    for text in asperity_fit.report(material, wanted):
        say(text)
