"""Scenes as files: those that come with the program; what is no file, has no end or is large."""

import os
import re
from pathlib import Path

import pytest
from program import invoke
from scenes import ROOT, extensions_forgotten

from dusttaichi import __version__
from dusttaichi.errors import DustError
from dusttaichi.method import make_sample
from dusttaichi.scene import from_yaml, load, shipped, yaml_text

BASE = """
name: strange
material: silicate_s12
boundary: {kind: open}
stop: {steps: 10}
"""
CHAIN = BASE + "sample: {kind: chain, grains: 3}\n"
CONTINUUM = """
name: strange
method: continuum
material: FILE
sample: {kind: block, size: [1 mm, 1 mm, 1 mm]}
boundary: {kind: open}
stop: {time: 1 us}
numerics: {spacing: 0.1 mm}
"""


def pipe(path):
    os.mkfifo(path)


def loop(path):
    path.symlink_to(path)


def device(path):
    path.symlink_to("/dev/zero")


def folder(path):
    path.mkdir()


def huge(path):
    """A hundred gigabytes that are nowhere."""
    with path.open("w") as file:
        file.truncate(10**11)


KINDS = (pipe, loop, device, folder, huge, "x" * 5000)
USES = {
    "yaml": (".yaml", lambda path: load(path)),
    "extension": (".py", lambda path: from_yaml(f"{CHAIN}extensions: ['{path}']")),
    "csv": (
        ".csv",
        lambda path: make_sample(
            from_yaml(f"{BASE}sample: {{kind: explicit, file: '{path}'}}", check_files=True)
        ),
    ),
    "material": (".yaml", lambda path: from_yaml(CONTINUUM.replace("FILE", f"'{path}'"))),
}


@pytest.mark.skipif(os.name != "posix", reason="pipes and devices are of POSIX systems")
@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize(
    "file_type", KINDS, ids=lambda file_type: getattr(file_type, "__name__", "long name")
)
def test_what_is_no_file_is_refused_at_once(tmp_path, file_type, use):
    suffix, read = USES[use]
    path = tmp_path / f"{file_type if isinstance(file_type, str) else 'strange'}{suffix}"
    if not isinstance(file_type, str):
        file_type(path)
    # what reads a hundred gigabytes, or a device, does not come back
    with pytest.raises(DustError) as refused:
        read(path)
    assert len(str(refused.value)) < 3000
    if file_type in (pipe, device):
        assert "it is a device or a pipe" in str(refused.value)


def test_an_extension_may_raise_anything(tmp_path):
    (tmp_path / "law.py").write_text("class Own(BaseException): pass\nraise Own('no')")
    with pytest.raises(DustError, match="its code raises") as refused:
        from_yaml(CHAIN + "extensions: [law.py]", tmp_path)
    assert "(line 7)" in str(refused.value)


# -- large texts: libyaml scans them, and says the same ------------------------------------------


def large(text):
    return text + "#" * 10 + "\n# filling".join([""] * (yaml_text.LARGE // 9)) + "\n"


@pytest.mark.parametrize(
    "text, words",
    [
        ("sample: {kind: chain, grains: 3}", ()),
        ("sample: {kind: chain, grains: 3.5}", ["sample.grains = 3.5", "(line 6)"]),
        ("sample: {kind: chain, grains: 3}\nzz: 1e-3\nyes: off", ["zz = 1e-3", "yes"]),
        ("sample: " + "[" * 2000 + "]" * 2000, ["more than 50 blocks"]),
        ("sample: {kind: chain", ["is not valid YAML", "(line "]),
        ("zz: a\x00b", ["U+0000 is not allowed (line 6)"]),
        ("ü: a\x07b", ["U+0007 is not allowed (line 6)"]),
        ("zz: &a [*a]", ["an anchor refers to itself"]),
        ("zz: 1\nzz: 2", ["the key is given twice, in lines 6 and 7"]),
        ("zz: !!int 1.5", ["'1.5' cannot be read as !!int"]),
        ("replicas:", ["nothing is written here"]),
        ("zz\u00a0z: 1", ["the character U+00A0 (no-break space) is in"]),
    ],
)
def test_a_large_text_reads_as_a_small_one(text, words):
    messages = []
    for full_text in (BASE + text + "\n", large(BASE + text + "\n")):
        try:
            messages.append(from_yaml(full_text).to_yaml())
        except DustError as error:
            messages.append(str(error))
    assert len(large("")) > yaml_text.LARGE
    assert all(word in message for message in messages for word in words), messages
    if not words:
        assert messages[0] == messages[1]


def test_comments_and_empty_lines_of_csv_files(tmp_path):
    text = "# a comment\nx [um], y [um],z [um]\n\n0,0, 0\n# x\n 3 ,0,0\n\n"
    (tmp_path / "a.csv").write_text(text)
    scene = from_yaml(f"{BASE}sample: {{kind: explicit, file: {tmp_path / 'a.csv'}}}")
    assert make_sample(scene).positions.tolist() == [[0, 0, 0], [3e-6, 0, 0]]


def dust(*words):
    result = invoke(*words)
    if isinstance(result.exception, DustError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


def test_a_scene_is_found_by_its_name_after_ones_own_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("smoke", "smoke.yaml", "configs/smoke.yaml"):
        assert load(name).name == "smoke"
    assert load("seizinger2012/dynamic_5ms").name == "seizinger2012_dynamic_5ms"
    monkeypatch.chdir(tmp_path)
    text = load("smoke").source.replace("name: smoke", "name: mine")
    Path("smoke").write_text(text)
    assert load("smoke").name == "mine"
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DustError, match=r"no such file. Do you mean the bundled scene smoke"):
        load("smok")
    with pytest.raises(DustError, match=r"no scene omni_statik: do you mean omni_static"):
        dust("new", "omni_statik")


@pytest.mark.parametrize(
    ("word", "names"),
    [
        ("tensile", ["tensile_ice", "kimura2020/size", "trade/tensile"]),  # names, descriptions
        ("BEAD elastic", ["guettler2009/bead_elastic"]),  # both words, in any case
        ("lognormal", ["mixture"]),  # in the text alone
        ("seizinger", ["seizinger2012/static_modified"]),
    ],
)
def test_new_lists_the_scenes_that_have_a_word(word, names):
    listed = dust("new", word)
    assert all(f"\n{name} " in listed for name in names)
    assert "sound_chain" not in listed and "wrote" not in listed


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("compresion", r"or the word compression \(`dust new compression`\)\?"),
        ("dynamic_5mz", "do you mean seizinger2012/dynamic_5ms"),
        ("xyzzy", "no scene xyzzy: `dust new` lists all"),
    ],
)
def test_new_suggests_scenes_and_words(text, hint):
    with pytest.raises(DustError, match=hint):
        dust("new", text)


def test_new_writes_no_file_for_a_word(tmp_path):
    with pytest.raises(DustError, match="no scene omni: do you mean omni_box or omni_static or"):
        dust("new", "omni", "--output", str(tmp_path / "a.yaml"))
    assert not list(tmp_path.iterdir())


def test_every_shipped_scene_has_its_line():
    listed = dust("new")
    for name in shipped.list_names():
        about = shipped.read_summary(shipped.get_folder() / f"{name}.yaml")
        assert name in listed and 10 < len(about) < 240, name
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text()


def test_new_writes_a_file_that_is_the_same_scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = dust("new", "omni_static")
    assert "wrote omni_static.yaml" in text and "\n      dust run omni_static.yaml" in text
    # `dust run` would ignore the block of a study
    assert "\n      dust collide collide.yaml\n" in dust("new", "collide")
    assert load("omni_static.yaml") == load(ROOT / "configs/omni_static.yaml")
    schema = re.search(r"\$schema=(\S+)", Path("omni_static.yaml").read_text())[1]
    assert Path(schema.removeprefix("file://")).samefile(ROOT / "configs/scene.schema.json")
    with pytest.raises(DustError, match="exists; --force"):
        dust("new", "omni_static")
    dust("new", "omni_static", "--force")
    dust("new", "omni_static", "--output", "deep/er/mine.yaml")
    assert load("deep/er/mine.yaml").name == "omni_static"


def test_new_brings_the_extensions_along(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source = (ROOT / "configs/reissl2024/spin_up.py").read_text()
    assert "wrote deep/spin_up.py" in dust("new", "reissl2024/spin_up", "-o", "deep/mine.yaml")
    assert Path("deep/spin_up.py").read_text() == source
    dust("new", "reissl2024/spin_up", "-o", "deep")  # the same file is no other one
    with extensions_forgotten():
        assert load("deep/mine.yaml") == load("deep/spin_up.yaml")
    Path("deep/spin_up.py").write_text("# changed\n")
    with pytest.raises(DustError, match="deep/spin_up.py exists; --force"):
        dust("new", "reissl2024/spin_up", "-o", "deep/other.yaml")
    assert not Path("deep/other.yaml").exists()
