"""What several studies are tested with."""

import pytest


@pytest.fixture
def cluster():
    """A Dask cluster in this process, reached by TCP."""
    from distributed import LocalCluster  # which takes a second

    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as found:
        yield found
