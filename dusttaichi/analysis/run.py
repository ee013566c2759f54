"""One run as its result file has it."""

from pathlib import Path

import numpy as np
import xarray as xr
import yaml

from dusttaichi.errors import DustError


class Run:
    """A result file, open for reading. Close it, or use it as a context manager.

    series, profiles: xr.Dataset in memory (profiles None where there are none).
    tree: xr.DataTree of the whole file, read when used. attrs: the global attributes.
    """

    def __init__(self, path):
        self.path = Path(path)
        try:
            self.tree = xr.open_datatree(self.path, engine="netcdf4")
            self.series = self.tree.to_dataset(inherit=False).load()
            self.profiles = self._group("profiles")
        except (OSError, RuntimeError, ValueError, KeyError) as error:
            raise DustError(f"{self.path} cannot be read as a result: {error}.") from error
        if "time" not in self.series or "step" not in self.series:
            self.close()
            raise DustError(f"{self.path} is not a result of dusttaichi: it has no time series.")
        self.attrs = dict(self.series.attrs)

    def _group(self, name):
        if name not in self.tree.children:
            return None
        group = self.tree[name].to_dataset(inherit=False).load()
        return group if group.sizes.get("profile", 0) else None

    @property
    def name(self):
        """The run's title, or the name of its folder."""
        return self.attrs.get("title") or self.path.resolve().parent.name

    @property
    def status(self):
        """State of the run: "running", "finished: ...", "interrupted" ..."""
        return self.attrs.get("status", "unknown")

    @property
    def scene(self):
        """The resolved scene as plain dicts, {} where the file has none."""
        return yaml.safe_load(self.attrs.get("scene_resolved", "")) or {}

    @property
    def grains(self):
        """Number of grains, or None where the file does not tell."""
        grains = self.attrs.get("grains")
        return None if grains is None else int(grains)

    @property
    def compresses(self):
        """True where there is a filling factor that grew, and a pressure on the top wall."""
        if not {"filling_factor", "pressure"} <= set(self.series) or len(self.series.time) < 2:
            return False
        phi = self.series.filling_factor.values
        return bool(np.nanmax(phi) > 1.001 * phi[0])

    def contacts(self, snapshot=-1, group="contacts"):
        """Rows of /contacts (or group="wall_contacts") of one snapshot, as an xr.Dataset.

        Raises DustError where the run kept none, IndexError for a snapshot that is not there.
        """
        if group not in self.tree.children:
            raise DustError(f"{self.path} holds no {group} (output: contacts: false, or no walls).")
        name = "contact_count" if group == "contacts" else "wall_contact_count"
        ends = np.cumsum(self.tree["snapshots"][name].values)
        end = int(ends[snapshot])
        start = end - int(self.tree["snapshots"][name].values[snapshot])
        dim = "contact" if group == "contacts" else "wall_contact"
        # not with the labels of the root: `wall` there would take the place of the group's own
        rows = self.tree[group].to_dataset(inherit=False).isel({dim: slice(start, end)})
        return rows.assign_coords(xyz=self.series.xyz).load()

    def close(self):
        """Close the file. `series` and `profiles` stay usable."""
        self.tree.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def open_run(path):
    """The run at `path`, a result file or the directory that holds result.nc. Returns a Run.

    Raises DustError where there is none, or it cannot be read.
    """
    path = Path(path)
    file = path / "result.nc" if path.is_dir() else path
    if not file.exists():
        raise DustError(f"There is no result at {file}.")
    return Run(file)
