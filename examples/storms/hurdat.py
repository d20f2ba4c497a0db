"""Storm tracks in HURDAT2, the text format of NOAA's best-track database."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from symspline import ValidationError
from symspline._base.arrays import short_repr

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
    """Read the storms of a HURDAT2 text: a header line with the number of fixes, then one line per fix.

    Parameters
    ----------
    text : str
        What is in the file.

    Returns
    -------
    list of Storm
        The storms in the order of the text.

    Raises
    ------
    ValidationError
        A line is not what the format says; the message has its number.

    Notes
    -----
    The format is described in Landsea and Franklin, Atlantic Hurricane Database Uncertainty and Presentation of a New
    Database Format, Monthly Weather Review 141 (2013).
    """
    if not isinstance(text, str):
        raise TypeError(f"text must be the text of a HURDAT2 file, not {short_repr(text)}")
    lines, storms, start = text.splitlines(), [], 0
    while start < len(lines):
        fields = lines[start].split(",")
        count = fields[2].strip() if len(fields) > 2 else ""
        if not (count.isascii() and count.isdecimal()) or not int(count[:9]) >= 1:
            raise ValidationError(
                f"line {start + 1} of text is {short_repr(lines[start])}, but must be the header of a storm, such as "
                "'AL092021, IDA, 40,'"
            )
        stop = start + 1 + int(count[:9])
        if stop > len(lines):
            raise ValidationError(
                f"line {start + 1} of text announces {count} fixes, but {len(lines) - start - 1} lines follow; the "
                "text is cut off"
            )
        storms.append(_storm(lines[start], lines[start + 1 : stop], start + 2))
        start = stop
    return storms


def read_sample() -> list[Storm]:
    """The 37 Atlantic storms of 2021 and 2022 in the file beside this one."""
    return parse((Path(__file__).parent / "hurdat2_sample.txt").read_text("ascii"))


def _storm(header: str, fixes: list[str], first: int) -> Storm:
    """One storm; its fixes begin in a line of this number."""
    key, name = (field.strip() for field in header.split(",")[:2])
    rows = [_fix(fix, number) for number, fix in enumerate(fixes, first)]
    times, lat, lon = zip(*rows, strict=True)
    return Storm(key, name.capitalize(), np.array(times), np.array(lon), np.array(lat))


def _fix(line: str, number: int) -> tuple[np.datetime64, float, float]:
    """Time, latitude and longitude of a fix."""
    row = [field.strip() for field in line.split(",")]
    try:
        return np.datetime64(_time(row[0], row[1]), "m"), _degrees(row[4], "NS"), _degrees(row[5], "EW")
    except (IndexError, ValueError):
        raise ValidationError(
            f"line {number} of text is {short_repr(line)}, but must be a fix, such as '20210829, 1655, L, HU, 29.1N, "
            "90.2W, 130, 931'"
        ) from None


def _time(day: str, clock: str) -> str:
    return f"{day[:4]}-{day[4:6]}-{day[6:]}T{clock[:2]}:{clock[2:]}"


def _degrees(text: str, directions: str) -> float:
    """``"55.5W"`` is -55.5."""
    sign = {directions[0]: 1, directions[1]: -1}.get(text[-1:])
    number = float(text[:-1])
    if sign is None or not abs(number) <= 360:
        raise ValueError
    return number * (-1 if text[-1] in "SW" else 1)
