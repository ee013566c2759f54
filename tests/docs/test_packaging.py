"""What is installed elsewhere: the README of the wheel, the tutorials' lock; the hosted CI."""

import importlib.util
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import yaml

from dusttaichi import __version__

ROOT = Path(__file__).parents[2]


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
    assert len(re.findall(r"!\[[^\]]*\]\(data:image/png;base64,", own)) == pictures > 0
    # no address that starts nowhere
    assert not re.search(r"\]\((?!https?:|data:|#)", own)
    online = build.readme(ROOT, "https://example.org/v1/")
    assert "](https://example.org/v1/docs/figures/omni_static.png)" in online
    assert "](https://example.org/v1/docs/validation.md)" in online and "data:" not in online


def test_changelog_and_citation_have_the_version_and_its_date():
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert "\n## Unreleased\n" in changelog.split(f"\n## {__version__} - ")[0]
    date = re.search(rf"^## {re.escape(__version__)} - (\S+)$", changelog, re.MULTILINE)[1]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {__version__}\ndate-released: {date}\n" in citation


def test_the_lock_has_every_dependency():
    lines = (ROOT / "docs/tutorials/requirements.lock").read_text(encoding="utf-8").splitlines()
    locked = dict(line.split("==") for line in lines if not line.startswith("#"))
    assert set(project()) <= set(locked) and {"myst-nb", "ipykernel"} <= set(locked)
    assert all(re.fullmatch(r"[\d.a-z+]+", version) for version in locked.values())


def test_the_hosted_ci_calls_the_script():
    text = (ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8")
    job = yaml.safe_load(text)["jobs"]["ci"]
    assert [step["run"] for step in job["steps"] if "run" in step] == ["PYTHON=python .ci/run"]
    pyproject = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    low, high = re.search(r'requires-python = ">=(3\.\d+),<3\.(\d+)"', pyproject).groups()
    assert job["strategy"]["matrix"]["python"] == [low, f"3.{int(high) - 1}"]


def test_the_hooks_are_those_of_the_ci():
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    script = (ROOT / ".ci/run").read_text(encoding="utf-8")
    entries = [hook["entry"] for repo in hooks["repos"] for hook in repo["hooks"]]
    assert entries == ["ruff check", "ruff format --check"]
    assert all(f"\n{entry} .\n" in script for entry in entries)
