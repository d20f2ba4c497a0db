"""Storm tracks in HURDAT2, the text format of NOAA's best-track database."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

_SYNOPTIC = np.timedelta64(6, "h")


@dataclass(frozen=True)
class Storm:
    """The fixes of one storm, in the order of time.

    Attributes:
        key: basin, number and year, e.g. ``"AL092021"``.
        name: e.g. ``"Ida"``.
        times: of the fixes, ``datetime64[m]``, UTC.
        lon: degrees east, which the database rounds to 0.1.
        lat: degrees north, likewise.
    """

    key: str
    name: str
    times: NDArray[np.datetime64]
    lon: NDArray[np.float64]
    lat: NDArray[np.float64]

    @property
    def label(self) -> str:
        """Name and year."""
        return f"{self.name} {self.key[-4:]}"

    def __len__(self) -> int:
        return len(self.times)

    def spaced(self, gap: np.timedelta64) -> Storm:
        """The storm without extra fixes that are less than ``gap`` from a fix that is kept.

        The six-hourly (synoptic) fixes always stay; the extra ones between them, mostly landfalls, are
        looked at in the order of time.
        """
        synoptic = (self.times - self.times[0].astype("datetime64[D]")) % _SYNOPTIC == np.timedelta64(0)
        keep = synoptic.copy()
        for i in np.flatnonzero(~synoptic):
            keep[i] = np.abs(self.times[keep] - self.times[i]).min() >= gap
        return replace(self, times=self.times[keep], lon=self.lon[keep], lat=self.lat[keep])


def parse(text: str) -> list[Storm]:
    """The storms of a HURDAT2 text: a header line with the number of fixes, then one line a fix."""
    lines = iter(text.splitlines())
    return [_storm(header, [next(lines) for _ in range(int(header.split(",")[2]))]) for header in lines]


def read_sample() -> list[Storm]:
    """The 37 Atlantic storms of 2021 and 2022 that come with the package."""
    return parse((files("symspline") / "data" / "hurdat2_sample.txt").read_text("ascii"))


def _storm(header: str, fixes: list[str]) -> Storm:
    key, name = (field.strip() for field in header.split(",")[:2])
    rows = [[field.strip() for field in fix.split(",")] for fix in fixes]
    return Storm(
        key,
        name.capitalize(),
        np.array([_time(row[0], row[1]) for row in rows], dtype="datetime64[m]"),
        np.array([_degrees(row[5]) for row in rows]),
        np.array([_degrees(row[4]) for row in rows]),
    )


def _time(day: str, clock: str) -> str:
    return f"{day[:4]}-{day[4:6]}-{day[6:]}T{clock[:2]}:{clock[2:]}"


def _degrees(text: str) -> float:
    """``"55.5W"`` is -55.5."""
    return float(text[:-1]) * (-1 if text[-1] in "SW" else 1)
