"""What several studies are tested with."""

import pytest

from dusttaichi.studies import study_engine


@pytest.fixture(scope="module")
def one_core():
    """A study starts one process: the start of a second takes longer than it would compute."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_engine, "usable_cores", lambda: 1)
        yield


@pytest.fixture(scope="module")
def two_cores():
    """A study starts two processes on any machine, so that the same points are side by side."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_engine, "usable_cores", lambda: 2)
        yield


@pytest.fixture
def cluster():
    """A Dask cluster in this process, reached by TCP."""
    from distributed import LocalCluster  # which takes a second

    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as found:
        yield found
