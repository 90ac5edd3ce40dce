"""Recordings as tables of pandas and data sets of xarray, and the ground over time. Both packages are optional."""

from typing import NamedTuple

import numpy as np

from ._terraglue import matching
from .errors import Error, InputError


class PointCloud(NamedTuple):
    """The points of one message of a scanner, in its own frame."""

    #: Time of the message, s.
    t: float
    #: The body that the scanner sits on, `subsystem/body`.
    frame: str
    #: Place of the scanner on it, m.
    position: np.ndarray
    #: Its orientation there, quaternion w, x, y, z.
    orientation: np.ndarray
    #: A structured array with the fields of the message: `data["x"]`, m, `data["intensity"]`, …
    data: np.ndarray

    @property
    def xyz(self):
        """Places in the frame of the scanner, a row for each point, m."""
        return np.stack([self.data[axis] for axis in "xyz"], axis=-1)

    @classmethod
    def _of(cls, head, fields, stride, data):
        names, formats, offsets = zip(*fields) if fields else ((), (), ())
        t, frame, position, orientation = head
        try:
            layout = np.dtype({"names": list(names), "formats": list(formats), "offsets": list(offsets), "itemsize": stride})
            points = np.frombuffer(data, dtype=layout)
        except ValueError as error:
            raise InputError(f"the points of {frame} at t = {t} s are not those that their fields describe: {error}") from None
        return cls(t, frame, np.array(position), np.array(orientation), points)


class GroundSeries:
    """The ground of a recording over time, (time, y, x), m: heights are put together where they are asked for, a time or a slice at once.

        ground = recording.ground_series()
        ground[-1]                        # the ground at ground.t[-1], (y, x)
        ground[10:20, :, 40]              # ten times, one column
    """

    dtype = np.dtype(np.float32)
    ndim = 3

    def __init__(self, recording):
        self._recording = recording
        self.x, self.y, _ = recording.ground("start")
        #: Times of the start and of each change, s.
        self.t = recording.ground_times
        self.shape = (len(self.t), len(self.y), len(self.x))

    def __len__(self):
        return self.shape[0]

    def __getitem__(self, index):
        index = index if isinstance(index, tuple) else (index,)
        time, rest = (index[0], index[1:]) if index and index[0] is not Ellipsis else (slice(None), index)
        wanted = np.arange(len(self))[time]
        if wanted.size == 0:
            return np.empty((0, *self.shape[1:]), dtype=self.dtype)[(slice(None), *rest)]
        first = int(wanted.min())
        ground = self._recording.grounds(first, int(wanted.max()) + 1)
        return ground[(wanted - first, *rest)] if wanted.ndim == 0 else ground[wanted - first][(slice(None), *rest)]

    def at(self, t):
        """The ground at a time, s: as it was recorded last before."""
        return self[max(int(np.searchsorted(self.t, t, side="right")) - 1, 0)]

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self[:], dtype=dtype)


def _package(name):
    try:
        return __import__(name)
    except ImportError:
        raise Error(f"`{name}` is not installed: pip install {name}") from None


def _series(recording, names):
    chosen = recording.names if names is None else matching(recording.names, names)
    return {name: recording.series(name) for name in chosen}


def to_pandas(recording, names=None):
    pandas = _package("pandas")
    series = {name: pandas.Series(values, index=t) for name, (t, values) in _series(recording, names).items()}
    frame = pandas.concat(series, axis=1) if series else pandas.DataFrame()
    frame.index.name = "t"
    frame.attrs["units"] = {"t": "s", **{name: recording.unit(name) for name in series}}
    return frame


def to_xarray(recording, names=None):
    xarray = _package("xarray")
    data = xarray.Dataset()
    all_series = _series(recording, names)
    arrays = {name: xarray.DataArray(values, {"t": t}, ("t",), attrs={"units": recording.unit(name)}) for name, (t, values) in all_series.items()}
    data = xarray.merge([xarray.Dataset({name: array}) for name, array in arrays.items()], join="outer") if arrays else data
    if len(recording.ground_times):
        data = data.assign(ground=_lazy(xarray, GroundSeries(recording)))
    for name in {"t", "ground_t"} & set(data.coords):
        data[name].attrs["units"] = "s"
    return data


def _lazy(xarray, ground):
    """The ground as an array of xarray that is read where it is used."""
    from xarray.core import indexing

    class Backend(xarray.backends.BackendArray):
        shape, dtype = ground.shape, ground.dtype

        def __getitem__(self, key):
            return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, ground.__getitem__)

    lazy = xarray.Variable(("ground_t", "y", "x"), indexing.LazilyIndexedArray(Backend()), {"units": "m"})
    metres = {"units": "m"}
    coordinates = {"ground_t": ground.t, "y": ("y", ground.y, metres), "x": ("x", ground.x, metres)}
    return xarray.DataArray(lazy, coordinates)
