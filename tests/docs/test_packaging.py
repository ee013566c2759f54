"""What is installed elsewhere: the README of the wheel, the conda recipe, the tutorials' lock."""

import importlib.util
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import yaml

from dusttaichi import __version__

ROOT = Path(__file__).parents[2]
# what conda calls otherwise, and what its recipe packs along
CONDA = {"netcdf4": "netcdf4", "matplotlib": "matplotlib-base", "taichi": None}


def project():
    """Names and versions of the dependencies in pyproject.toml."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    block = text.split("\ndependencies = [")[1].split("\n]")[0]
    block = re.sub(r"#.*", "", block)
    found = re.findall(r'"([\w.-]+?)((?:[<>=].*?)?)"', block)
    return {name.lower(): version for name, version in found}


def test_the_readme_of_a_wheel_needs_no_clone(monkeypatch):
    plugin = "hatchling.metadata.plugin.interface"  # which only a build has
    monkeypatch.setitem(sys.modules, plugin, SimpleNamespace(MetadataHookInterface=object))
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    given = (ROOT / "README.md").read_text(encoding="utf-8")
    pictures = len(re.findall(r"!\[", given))
    own = build.readme(ROOT)
    assert len(re.findall(r"!\[[^\]]*\]\(data:image/png;base64,", own)) == pictures > 2
    # no address that starts nowhere
    assert not re.search(r"\]\((?!https?:|data:|#)", own)
    online = build.readme(ROOT, "https://example.org/v1/")
    assert "](https://example.org/v1/docs/figures/omni_static.png)" in online
    assert "](https://example.org/v1/docs/validation.md)" in online and "data:" not in online


def test_the_conda_recipe_needs_what_the_package_needs():
    text = (ROOT / "packaging/conda/meta.yaml").read_text(encoding="utf-8")
    assert f'"{__version__}"' in text
    plain = re.sub(r"\{%.*?%\}|\{\{.*?\}\}", "", text)
    needed = {line.split()[0]: line for line in yaml.safe_load(plain)["requirements"]["run"]}
    for name, version in project().items():
        conda = CONDA.get(name, name)
        if conda is not None:
            assert needed[conda].removeprefix(conda).strip() == version, name


def test_the_lock_has_every_dependency():
    lines = (ROOT / "docs/tutorials/requirements.lock").read_text(encoding="utf-8").splitlines()
    locked = dict(line.split("==") for line in lines if not line.startswith("#"))
    assert set(project()) <= set(locked) and {"myst-nb", "ipykernel"} <= set(locked)
    assert all(re.fullmatch(r"[\d.a-z+]+", version) for version in locked.values())
