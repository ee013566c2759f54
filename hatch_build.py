"""The README as a wheel has it: outside of a clone relative addresses lead nowhere, so pictures are
in the text itself and links to pages of the clone are their names alone. With DUST_URL, the address
of the files of the version, both are absolute instead: what a package index shows."""

import base64
import os
import re
from pathlib import Path

from hatchling.metadata.plugin.interface import MetadataHookInterface


class ReadmeHook(MetadataHookInterface):
    """Called by hatchling when it makes the metadata of a wheel or a source archive."""

    def update(self, metadata):
        text = readme(Path(self.root), os.environ.get("DUST_URL"))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}


def readme(root, url=None):
    """The text of README.md below `root`. url: what relative addresses start at, or None."""

    def link(found):
        picture, text, address = found.groups()
        if re.match(r"\w+:|#", address):
            return found[0]
        if url:
            return f"{picture}[{text}]({url.rstrip('/')}/{address})"
        if not picture:
            return text
        raw = base64.b64encode((root / address).read_bytes()).decode()
        return f"![{text}](data:image/png;base64,{raw})"

    text = (root / "README.md").read_text(encoding="utf-8")
    return re.sub(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)", link, text)
