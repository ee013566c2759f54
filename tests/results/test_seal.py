"""The seal of a result file: what is damaged is refused before HDF5 looks at it."""

import shutil

import netCDF4
import pytest
import synthetic

from dusttaichi import files
from dusttaichi.analysis import open_run
from dusttaichi.errors import DustError
from dusttaichi.results import Writer, reading, seal, writer

GRAINS = 4


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A result that has no records itself, and five parts with forty of the series each."""
    path = tmp_path_factory.mktemp("sealed") / "run" / "result.nc"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "PIECE", 1000)
        with synthetic.writer(path, GRAINS, features=set()) as writing:
            for start in range(0, 200, 40):
                for step in range(start, start + 40):
                    writing.append("series", synthetic.series_record(step, set()))
                writing.flush()
    return path.parent


@pytest.fixture
def run(made, tmp_path):
    return shutil.copytree(made, tmp_path / "run")


def parts(run):
    return sorted(files.parts_folder(run / "result.nc").iterdir())


def change(path, at, new):
    raw = bytearray(path.read_bytes())
    raw[at : at + len(new)] = new
    path.write_bytes(raw)


def test_texts_that_make_hdf5_never_end_are_refused(run):
    """Zeros where the texts of a part are: HDF5 looks for the next one for ever."""
    change(parts(run)[1], parts(run)[1].read_bytes().index(b"GCOL") + 32, bytes(4000))
    with pytest.raises(DustError, match=r"000002\.nc is damaged.*--force.*can be read"):
        open_run(run)
    for part in parts(run)[1:]:
        part.unlink()
    assert open_run(run).series.sizes["time"] == 40  # as the message says


def test_every_byte_of_a_part_counts(run):
    whole, part = open_run(run).series, parts(run)[2]
    raw = part.read_bytes()
    seal_begins = seal.seal_of(part)["size"]
    places = [*range(0, len(raw), 997), *range(seal_begins, len(raw))]
    for at in places:
        part.write_bytes(raw[:at] + bytes([raw[at] ^ 4]) + raw[at + 1 :])
        with pytest.raises(DustError, match="damaged"):
            seal.check_whole(part)
    for size in (0, 5, 1000, seal_begins, len(raw) - 1):
        part.write_bytes(raw[:size])
        with pytest.raises(DustError, match="damaged"):
            open_run(run)
    part.write_bytes(raw)
    assert open_run(run).series.equals(whole)


def test_a_part_that_is_gone_is_missed(run):
    parts(run)[1].unlink()
    with pytest.raises(DustError, match=r"missing between .*000001\.nc and .*000003\.nc"):
        open_run(run)


def test_a_run_does_not_go_on_from_what_is_damaged(run):
    counts = dict.fromkeys(("series",), 200)
    change(parts(run)[0], 3000, b"xyz")
    with pytest.raises(DustError, match=r"000001\.nc is damaged"):
        Writer.resume(run / "result.nc", counts)
    assert not (run / ".lock").exists()


def test_a_file_changed_by_another_program_says_so(run):
    shutil.rmtree(files.parts_folder(run / "result.nc"))
    with netCDF4.Dataset(run / "result.nc", "a") as file:
        file.comment = "mine"
    with pytest.raises(DustError, match="another program has changed it.*remove its attribute"):
        open_run(run)
    with netCDF4.Dataset(run / "result.nc", "a") as file:
        file.delncattr(seal.DIGEST)
    assert open_run(run).attrs["comment"] == "mine"


def test_a_file_from_before_there_were_seals(run):
    path = run / "result.nc"
    shutil.rmtree(files.parts_folder(path))
    with netCDF4.Dataset(path, "a") as file:
        file.delncattr(seal.DIGEST)
        file.digest = seal._digest_of_texts(file)
    assert open_run(run).attrs["digest"] != seal.SEALED
    with netCDF4.Dataset(path, "a") as file:
        file.title = "another"
    with pytest.raises(DustError, match="texts are not those"):
        open_run(run)


def test_a_look_is_taken_once_and_only_where_numbers_are_read(run, monkeypatch):
    looked, real = [], seal._digest
    monkeypatch.setattr(seal, "_digest", lambda file, n: looked.append(file.name) or real(file, n))
    assert len(reading.pieces_of(run / "result.nc")) == 6 and not looked
    for _ in range(2):
        open_run(run)
        assert looked == [str(part) for part in parts(run)[-1:] + parts(run)[:-1]]


def test_a_flush_looks_at_no_other_part(made, tmp_path, monkeypatch):
    """The work of a flush does not grow with what has been written."""
    seen = []
    real = writer.pieces._parts
    monkeypatch.setattr(writer, "PIECE", 1000)
    monkeypatch.setattr(writer.pieces, "_parts", lambda path: seen.append(path) or real(path))
    with synthetic.writer(tmp_path / "result.nc", GRAINS, features=set()) as writing:
        for step in range(3):
            writing.append("series", synthetic.series_record(step, set()))
            writing.flush()
            assert len(seen) == 1  # as the file was made
