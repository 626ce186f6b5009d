#!/usr/bin/env python3
"""Reads the results of nimbus into tables of numpy arrays.

    import nimbus_results as nr

    run = nr.read("run")                     # a folder of nimbus bench --out
    run.metadata.device, run.metadata.pass_times
    run.frames["frame_ms"]                   # a column of frames.csv, warm-up included
    nr.summary(run.times("frame_ms", loop="serial"))["p50"]
    run.cases["rmse"]                        # the error beside the time
    run.to_pandas("passes")                  # with pandas installed

`read` recognises what a path is and returns one of six classes:

    Run         nimbus bench --out DIR or --json, and the      frames, loops, passes, cases,
                merged bench of nimbus farm                    invocations, parts
    Study       nimbus error --out DIR or --json               configurations, times
    Ledger      nimbus ledger --out DIR or --json              rows
    Stress      nimbus stress --json or --csv                  cases
    Comparison  nimbus compare A B --json                      measures
    Frames      nimbus farm merge, nimbus render --frames      pictures

A table is a dict of numpy arrays by column. Numbers that were not measured are NaN, and texts are
object arrays. Times are in milliseconds and errors in units of full scale (premultiplied linear
RGBA), unless a column says otherwise. Columns that a CSV file of nimbus has too have its names;
docs/reference/results.md explains all of them.

`read` checks the folder's list of SHA-256 (run.sha256 and others) and the schema version, and
raises `ResultsError` with one sentence for a file that is missing, damaged or of another version.

Needs Python 3.9 and numpy; uses pandas and matplotlib only if asked for. As a program it prints a
table of each result: python3 tools/nimbus_results.py --help.
"""
from __future__ import annotations

import argparse
import csv
import hashlib
import io
import json
import math
import os
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Tuple, Union

try:
    import numpy as np
except ImportError:
    NEEDS = "nimbus_results needs numpy: pip install numpy, or the package python3-numpy"
    if __name__ == "__main__":
        print(f"error: {NEEDS}", file=sys.stderr)
        sys.exit(2)
    raise ImportError(NEEDS) from None

__all__ = [
    "Comparison",
    "Frames",
    "Interval",
    "Ledger",
    "Metadata",
    "ResultsError",
    "Run",
    "Stress",
    "Study",
    "lows",
    "median",
    "median_interval",
    "quantile",
    "ratio_of_medians",
    "read",
    "summary",
]

Table = Dict[str, np.ndarray]
"""Columns by name; all have the same length."""

SCHEMAS = {"run": 3, "study": 1, "ledger": 1, "stress": 1}
"""The schema version that this file reads, by kind of result."""

COMPARISON_SCHEMAS = (2, 3)
"""The schema versions of nimbus compare --json that this file reads."""

HISTORY_SCHEMAS = (1,)
"""Those of nimbus history --json."""

COMMANDS = {
    "run": "bench", "study": "error", "ledger": "ledger", "stress": "stress",
    "comparison": "compare", "history": "history", "frames": "farm merge",
}  # fmt: skip
"""The command of nimbus that writes a kind of result."""


class ResultsError(Exception):
    """A result that cannot be read. The message says where, what, and what was expected."""


# Statistics, by the rules of nimbus (src/measure/stats.rs, bootstrap.rs and lows.rs). The order of
# every sum is that of nimbus, so that results are equal to the last bit.

N_FRAMES_NEEDED = 30
"""Timed frames that an interval needs (src/timing/intervals.rs)."""

N_RESAMPLES = 2000
"""Resamples of a bootstrap."""

CHUNK_OF_RESAMPLES = 4_000_000
"""Values of resamples that are held at once: 32 MB an array."""


@dataclass(frozen=True)
class Interval:
    """An estimate and its 95 % interval, in the unit of the values."""

    estimate: float
    low: float
    high: float


def _finite(values: Sequence[float]) -> np.ndarray:
    array = np.asarray(values, dtype=np.float64).ravel()
    return array[np.isfinite(array)]


def _sum(values: np.ndarray) -> float:
    # From the first to the last. numpy.sum adds in pairs, which rounds differently.
    return float(np.add.accumulate(values)[-1]) if values.size else 0.0


def _of_sorted(ordered: np.ndarray, p: float) -> float:
    position = (ordered.size - 1) * min(max(p, 0.0), 1.0)
    below = math.floor(position)
    above = min(below + 1, ordered.size - 1)
    low, high = float(ordered[below]), float(ordered[above])
    return low + (position - below) * (high - low)


def quantile(values: Sequence[float], p: float) -> float:
    """Returns the quantile `p`, from 0 to 1, of the finite values; NaN if there are none.

    Linear interpolation between order statistics, type 7 of Hyndman and Fan (1996).
    """
    ordered = np.sort(_finite(values))
    return _of_sorted(ordered, p) if ordered.size else math.nan


def median(values: Sequence[float]) -> float:
    """Returns the median of the finite values, in their unit; NaN if there are none."""
    return quantile(values, 0.5)


def summary(values: Sequence[float]) -> Dict[str, Optional[float]]:
    """Returns the statistics that run.json has of a list of times, in the unit of the values.

    The keys are n, n_not_finite, mean, sd (divisor n - 1), min, p1, p5, p50, p95, p99, max, and
    p50_low and p50_high, the 95 % interval of the median. `values` are in the order in which they
    were measured. A statistic that is not defined is None.
    """
    given = np.asarray(values, dtype=np.float64).ravel()
    ordered = np.sort(_finite(given))
    result: Dict[str, Optional[float]] = {
        "n": int(ordered.size),
        "n_not_finite": int(given.size - ordered.size),
    }
    names = ("mean", "sd", "min", "p1", "p5", "p50", "p95", "p99", "max", "p50_low", "p50_high")
    result.update((name, None) for name in names)
    if ordered.size == 0:
        return result
    mean = _sum(ordered) / ordered.size
    if ordered.size > 1:
        distances = ordered - mean
        result["sd"] = math.sqrt(_sum(distances * distances) / (ordered.size - 1))
    result.update(mean=mean, min=float(ordered[0]), max=float(ordered[-1]))
    for name, p in (("p1", 0.01), ("p5", 0.05), ("p50", 0.5), ("p95", 0.95), ("p99", 0.99)):
        result[name] = _of_sorted(ordered, p)
    interval = median_interval(given)
    if interval is not None:
        result.update(p50_low=max(interval.low, 0.0), p50_high=interval.high)
    return result


def lows(frame_ms: Sequence[float]) -> Optional[Dict[str, float]]:
    """Returns the three meanings of "1 % low", in frames a second, of frame times in ms.

    The keys are p99_fps, slowest_mean_fps and slowest_time_fps (docs/reference/results.md). None
    if no time is finite, or a frame took no time.
    """
    ordered = np.sort(_finite(frame_ms))
    if ordered.size == 0 or ordered[0] <= 0.0:
        return None
    slowest = ordered[ordered.size - -(-ordered.size // 100) :]
    share = 0.01 * _sum(ordered)
    reached = np.add.accumulate(ordered[::-1]) >= share
    last = float(ordered[::-1][int(np.argmax(reached))]) if reached.any() else float(ordered[0])
    return {
        "p99_fps": 1000.0 / _of_sorted(ordered, 1.0 - 0.01),
        "slowest_mean_fps": 1000.0 / (_sum(slowest) / slowest.size),
        "slowest_time_fps": 1000.0 / last,
    }


def _random_below(first: int, shape: Tuple[int, int], limits: np.ndarray) -> np.ndarray:
    """Returns integers of SplitMix64 with seed 0, from its number `first` on, row by row.

    Column j is uniform in [0, limits[j]): the high half of a product of 128 bits, computed from two
    products with 32-bit factors.
    """
    n = shape[0] * shape[1]
    step = np.uint64(0x9E3779B97F4A7C15)
    z = (np.arange(first + 1, first + n + 1, dtype=np.uint64) * step).reshape(shape)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    half = np.uint64(32)
    high, low = z >> half, z & np.uint64(0xFFFFFFFF)
    return ((high * limits + ((low * limits) >> half)) >> half).astype(np.int64)


def _medians_of_rows(values: np.ndarray) -> np.ndarray:
    n = values.shape[1]
    middle = n // 2
    if n % 2 == 1:
        return np.partition(values, middle, axis=1)[:, middle]
    ordered = np.partition(values, (middle - 1, middle), axis=1)
    lower, upper = ordered[:, middle - 1], ordered[:, middle]
    return lower + 0.5 * (upper - lower)


def _student_by_normal(degrees: float) -> float:
    # The 97.5th percentile of Student's distribution by that of the normal one (Abramowitz and
    # Stegun 26.7.5).
    z2 = 1.959963984540054 * 1.959963984540054
    terms = (
        (z2 + 1.0) / 4.0,
        ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0,
        (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0,
        ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) / 92160.0,
    )
    total = 0.0
    for term in reversed(terms):
        total = (total + term) / degrees
    return 1.0 + total


def _bootstrap(
    lists: Sequence[np.ndarray], n_frames: int, statistic: Callable[..., np.ndarray]
) -> Optional[Interval]:
    """Returns the interval of a statistic of the medians of lists of finite values.

    Circular block bootstrap with blocks of ceil(sqrt(n_frames)) neighbours, widened for few blocks
    (src/measure/bootstrap.rs derives the factors). `statistic` gets an array of medians for each
    list.
    """
    block_len = max(math.ceil(math.sqrt(n_frames)), 1)
    sizes = [values.size for values in lists]
    n_blocks = [size / block_len for size in sizes]
    least = min(n_blocks)
    if not least > 1.0:
        return None
    degrees = 0.0
    for k in n_blocks:
        degrees += k - 1.0
    widening = math.sqrt(least / (least - 1.0)) * _student_by_normal(degrees)
    n_starts = [-(-size // block_len) for size in sizes]
    limits = np.repeat(np.array(sizes, dtype=np.uint64), n_starts)
    n_draws = sum(n_starts)
    estimates = np.empty(N_RESAMPLES)
    n_at_once = max(1, CHUNK_OF_RESAMPLES // max(sizes))
    for first in range(0, N_RESAMPLES, n_at_once):
        n = min(n_at_once, N_RESAMPLES - first)
        starts = _random_below(first * n_draws, (n, n_draws), limits)
        medians, begin = [], 0
        for values, size, k in zip(lists, sizes, n_starts):
            own = starts[:, begin : begin + k, None] + np.arange(block_len)
            rows = own.reshape(n, -1)[:, :size] % size
            medians.append(_medians_of_rows(values[rows]))
            begin += k
        estimates[first : first + n] = statistic(*medians)
    estimate = float(statistic(*[np.array([median(values)]) for values in lists])[0])
    if not math.isfinite(estimate) or not np.isfinite(estimates).all():
        return None
    low, high = quantile(estimates, 0.025), quantile(estimates, 0.975)
    return Interval(
        estimate, estimate - widening * (estimate - low), estimate + widening * (high - estimate)
    )


def median_interval(values: Sequence[float]) -> Optional[Interval]:
    """Returns the median and its 95 % interval, in the unit of the values.

    The interval is that of nimbus, to the last bit. `values` are in the order in which they were
    measured, because neighbouring frames are correlated. None for fewer than 30 values.
    """
    given = np.asarray(values, dtype=np.float64).ravel()
    if given.size < N_FRAMES_NEEDED:
        return None
    finite = _finite(given)
    interval = _bootstrap([finite], given.size, lambda of: of)
    if interval is None:
        return None
    # The widened interval can reach beyond the values, which no median does.
    low, high = max(interval.low, float(finite.min())), min(interval.high, float(finite.max()))
    return Interval(interval.estimate, low, high)


def ratio_of_medians(b: Sequence[float], a: Sequence[float]) -> Optional[Interval]:
    """Returns median(b) / median(a) and its 95 % interval, as nimbus compare does.

    Both lists are in the order in which they were measured. If the interval contains 1, it is
    not decided which is faster. None for fewer than 30 values of one of them, or if
    the median of `a` is 0, or is 0 in a resample.
    """
    lists = [np.asarray(values, dtype=np.float64).ravel() for values in (b, a)]
    n = min(values.size for values in lists)
    if n < N_FRAMES_NEEDED:
        return None

    def ratio(top: np.ndarray, bottom: np.ndarray) -> np.ndarray:
        result = np.full(top.shape, np.nan)
        np.divide(top, bottom, out=result, where=bottom > 0.0)
        return result

    numerator, denominator = (_finite(values) for values in lists)
    interval = _bootstrap([numerator, denominator], n, ratio)
    if interval is not None and (numerator >= 0.0).all():
        return Interval(interval.estimate, max(interval.low, 0.0), interval.high)
    return interval


# Text for messages and tables.


def _plain(text: Any) -> str:
    """Returns text of one line without characters that a terminal obeys or cannot show."""
    return "".join(c if c.isprintable() else f"\\u{{{ord(c):x}}}" for c in str(text))


def _shown(path: Path) -> str:
    return _plain(os.fsencode(path).decode("utf-8", "replace"))


def _error(path: Path, what: str) -> ResultsError:
    return ResultsError(f"{_shown(path)}: {what}")


def _number(value: float, digits: int = 3) -> str:
    return "-" if not math.isfinite(value) else f"{value:.{digits}f}"


def _small(value: float) -> str:
    return "-" if not math.isfinite(value) else "0" if value == 0.0 else f"{value:.2e}"


def _between(low: float, high: float, form: Callable[[float], str]) -> str:
    return f"{form(low)} to {form(high)}" if math.isfinite(low) else "-"


def _aligned(rows: Sequence[Sequence[str]], n_left: int) -> List[str]:
    """Returns rows as lines: the first `n_left` columns to the left, the others to the right."""
    cells = [[_plain(cell) for cell in row] for row in rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(cells[0]))]

    def line(row: Sequence[str]) -> str:
        parts = [
            cell.ljust(width) if i < n_left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths))
        ]
        return "  ".join(parts).rstrip()

    return [line(row) for row in cells]


# Files.


def _bytes_of(path: Path) -> bytes:
    # A pipe or device may never end.
    if path.exists() and not path.is_file():
        raise _error(path, "is no regular file; expected a file of results")
    try:
        return path.read_bytes()
    except OSError as cause:
        raise _error(path, f"cannot be read: {cause.strerror or cause}") from None


def _text_of(path: Path) -> str:
    try:
        return _bytes_of(path).decode("utf-8")
    except UnicodeDecodeError as cause:
        what = f"is damaged: byte {cause.start} is not UTF-8, and results are UTF-8 text"
        raise _error(path, what) from None


def _check_list(folder: Path, kind: str) -> bool:
    """Checks the files that the list of a folder names; returns whether there is a list."""
    path = folder / f"{kind}.sha256"
    if not path.exists():
        return False
    hint = "verify=False (--no-verify) reads the folder without this check"
    for i, line in enumerate(_text_of(path).rstrip("\n").split("\n"), 1):
        expected, _, name = line.partition("  ")
        is_hash = len(expected) == 64 and not set(expected) - set("0123456789abcdef")
        if not is_hash or not name or "/" in name or name in (".", ".."):
            what = f"line {i} is damaged: expected a SHA-256, two spaces and a file name"
            raise _error(path, what)
        file = folder / name
        if not file.exists():
            raise _error(file, f"is missing, and {path.name} lists it; {hint}")
        if hashlib.sha256(_bytes_of(file)).hexdigest() != expected:
            what = f"has changed since nimbus wrote it: its SHA-256 is not that in {path.name}"
            raise _error(file, f"{what}; {hint}")
    return True


class _Node:
    """A value of a JSON file with the place where it stands, for messages."""

    def __init__(self, value: Any, path: Path, at: str = "") -> None:
        self.value, self.path, self.at = value, path, at

    def fault(self, expected: str) -> ResultsError:
        found = "null" if self.value is None else type(self.value).__name__
        found = {"dict": "an object", "list": "a list", "str": "text"}.get(found, found)
        if isinstance(self.value, (bool, int, float)):
            found = _plain(json.dumps(self.value))[:40]
        place = f"`{_plain(self.at)}`: " if self.at else ""
        return _error(self.path, f"{place}expected {expected}, found {found}")

    def _of(self, key: Any, value: Any) -> _Node:
        return _Node(value, self.path, f"{self.at}.{key}" if self.at else str(key))

    def object(self) -> Dict[str, Any]:
        if not isinstance(self.value, dict):
            raise self.fault("an object")
        return self.value

    def __getitem__(self, key: str) -> _Node:
        if key not in self.object():
            place = f"`{_plain(self.at)}` has" if self.at else "it has"
            raise _error(self.path, f"{place} no key `{key}`; expected a whole file of nimbus")
        return self._of(key, self.value[key])

    def get(self, *keys: str) -> _Node:
        """Returns the value below keys, or null if one of them is missing or null."""
        node = self
        for key in keys:
            if node.value is None:
                return node
            node = node._of(key, node.object().get(key))
        return node

    def each(self) -> List[_Node]:
        if not isinstance(self.value, list):
            raise self.fault("a list")
        return [self._of(i, value) for i, value in enumerate(self.value)]

    def text(self) -> str:
        if not isinstance(self.value, str):
            raise self.fault("text")
        return self.value

    def one_of(self, *choices: str) -> str:
        if self.value not in choices:
            raise self.fault(f"one of {', '.join(choices)}")
        return self.text()

    def text_or_empty(self) -> str:
        return "" if self.value is None else self.text()

    def number(self) -> float:
        """Returns a number; null, which means not measured, is NaN."""
        if self.value is None:
            return math.nan
        if isinstance(self.value, bool) or not isinstance(self.value, (int, float)):
            raise self.fault("a number or null")
        try:
            result = float(self.value)
        except OverflowError:
            result = math.inf
        if not math.isfinite(result):
            raise self.fault("a finite number")
        return result

    def integer(self) -> int:
        is_integer = isinstance(self.value, int) and not isinstance(self.value, bool)
        if not is_integer or not 0 <= self.value < 2**63:
            raise self.fault("an integer from 0 to 2^63 - 1")
        return self.value

    def truth(self) -> bool:
        if not isinstance(self.value, bool):
            raise self.fault("true or false")
        return self.value


def _json_of(path: Path) -> _Node:
    def refuse(name: str) -> None:
        raise ValueError(f"{name} is no number of JSON")

    text = _text_of(path)
    try:
        value = json.loads(text, parse_constant=refuse)
    except RecursionError:
        raise _error(path, "is damaged: its JSON is nested too deeply") from None
    except ValueError as cause:
        if not text.strip():
            raise _error(path, "is empty; expected JSON of nimbus") from None
        what = f"is damaged or cut off: not JSON, or not all of it ({_plain(cause)})"
        raise _error(path, what) from None
    return _Node(value, path)


def _kind_of(record: _Node) -> str:
    """Returns the kind of a record by the key that only this kind has."""
    if isinstance(record.value, dict) and "schema" in record.value:
        for kind, key in (("run", "block_order"), ("study", "configurations"), ("ledger", "rows")):
            if key in record.value:
                return kind
        if "matrix" in record.value:
            what = "compares more than two runs; expected the output of nimbus compare A B --json"
            raise _error(record.path, what)
        if "modes" in record.value:
            return "comparison"
        if "series" in record.value:
            return "history"
        if "cases" in record.value and "scene" not in record.value:
            return "stress"
    if isinstance(record.value, dict) and "metrics" in record.value:
        what = "compares two pictures; its `metrics` are a table already, which json.load reads"
        raise _error(record.path, what)
    what = "is no result of nimbus; expected JSON of nimbus bench, error, ledger, stress, compare"
    what = f"{what} or history"
    raise _error(record.path, what)


def _check_schema(record: _Node, kind: str) -> None:
    """Raises if a record has another schema version, with which other messages would mislead."""
    if not isinstance(record.value, dict) or "schema" not in record.value:
        what = f"names no schema version; expected the JSON of nimbus {COMMANDS[kind]}"
        raise _error(record.path, what)
    several = {"comparison": COMPARISON_SCHEMAS, "history": HISTORY_SCHEMAS}
    known = several[kind] if kind in several else (SCHEMAS[kind],)
    version = record["schema"].integer()
    if version > known[-1]:
        what = f"has schema {version}, newer than {known[-1]}, which this reader knows"
        raise _error(record.path, f"{what}; use the tools/nimbus_results.py of that version")
    if version < known[0]:
        what = f"has schema {version} of an older nimbus, and this reader expects {known[0]}"
        raise _error(record.path, f"{what}; use the tools/nimbus_results.py of that version")


Convert = Callable[[List[str]], np.ndarray]


def _texts(fields: List[str]) -> np.ndarray:
    array = np.empty(len(fields), dtype=object)
    array[:] = fields
    return array


def _numbers(fields: List[str]) -> np.ndarray:
    return np.array([float(field) if field else math.nan for field in fields], dtype=np.float64)


def _times(fields: List[str]) -> np.ndarray:
    numbers = _numbers(fields)
    for field, number in zip(fields, numbers):
        if field and not math.isfinite(number):
            raise ValueError(field)
    return numbers


def _integers(fields: List[str]) -> np.ndarray:
    for field in fields:
        if not (field.isascii() and field.isdigit()) or int(field) >= 2**63:
            raise ValueError(field)
    return np.array([int(field) for field in fields], dtype=np.int64)


def _truths(fields: List[str]) -> np.ndarray:
    for field in fields:
        if field not in ("true", "false"):
            raise ValueError(field)
    return np.array([field == "true" for field in fields], dtype=bool)


EXPECTED = {
    _numbers: "a number or nothing",
    _times: "a finite number or nothing",
    _integers: "an integer from 0 to 2^63 - 1",
    _truths: "true or false",
}


def _convert(
    path: Path, name: str, convert: Convert, fields: List[str], lines: Sequence[int]
) -> np.ndarray:
    """Converts the fields of a column; a message names the line of the first wrong one."""
    try:
        return convert(fields)
    except ValueError:
        pass
    for line, field in zip(lines, fields):
        try:
            convert([field])
        except ValueError:
            found = _plain(field)[:40]
            what = f"line {line}: {name}: expected {EXPECTED[convert]}, found \"{found}\""
            raise _error(path, what) from None
    raise _error(path, f"{name}: cannot be read")


CHUNK = 10_000
"""Rows of a CSV file that are held as text at once."""


def _table_of(
    path: Path, needed: Sequence[str], kind_of_column: Callable[[str], Convert], what: str
) -> Table:
    """Reads a CSV file. `needed` names columns that it must have; `what` names the file's kind."""
    text = _text_of(path)
    if not text:
        raise _error(path, f"is empty; expected {what} with a line of column names")
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)

    def rows() -> Iterator[List[str]]:
        try:
            yield from reader
        except csv.Error as cause:
            what = f"line {reader.line_num}: is damaged or cut off: {_plain(cause)}"
            raise _error(path, what) from None

    lines = rows()
    header = next(lines, [])
    for name in needed:
        if name not in header:
            raise _error(path, f"has no column {name}; expected {what}")
    if len(set(header)) != len(header):
        raise _error(path, f"names a column twice; expected {what}")
    converts = [kind_of_column(name) for name in header]
    parts: List[List[np.ndarray]] = [[convert([])] for convert in converts]
    chunk: List[List[str]] = []
    numbers: List[int] = []

    def convert_chunk() -> None:
        for part, name, convert, fields in zip(parts, header, converts, zip(*chunk)):
            part.append(_convert(path, name, convert, list(fields), numbers))
        chunk.clear()
        numbers.clear()

    for row in lines:
        if len(row) != len(header):
            what = f"expected {len(header)} fields as in line 1, found {len(row)}: cut off?"
            raise _error(path, f"line {reader.line_num}: {what}")
        chunk.append(row)
        numbers.append(reader.line_num)
        if len(chunk) == CHUNK:
            convert_chunk()
    convert_chunk()
    return {name: np.concatenate(part) for name, part in zip(header, parts)}


def _column(values: Sequence[Any], of: type) -> np.ndarray:
    return _texts(list(values)) if of is str else np.array(list(values), dtype=of)


def _columns(rows: Sequence[Dict[str, Any]], types: Dict[str, type]) -> Table:
    return {name: _column([row[name] for row in rows], of) for name, of in types.items()}


def _settings(lists: Sequence[Sequence[_Node]]) -> Table:
    """Returns one column for each key of lists of settings: numbers if all values are numbers,
    with NaN where the key is not set, else texts, with "" there."""
    all_values = [
        {setting["key"].text(): setting["value"].text() for setting in settings}
        for settings in lists
    ]
    table: Table = {}
    for key in dict.fromkeys(key for values in all_values for key in values):
        fields = [values.get(key, "") for values in all_values]
        try:
            table[key] = _numbers(fields)
        except ValueError:
            table[key] = _texts(fields)
    return table


def _figure(node: _Node, name: str) -> Dict[str, float]:
    """Returns a value with its 95 % interval as three columns; NaN where it is null."""
    return {
        name: node.get("value").number(),
        f"{name}_low": node.get("low").number(),
        f"{name}_high": node.get("high").number(),
    }


# Results.


@dataclass(frozen=True)
class Metadata:
    """The conditions of a result. None: the file does not name them."""

    kind: str
    """run, study, ledger, stress, comparison, history or frames."""
    path: str
    """The file or folder, as it was named."""
    nimbus: Optional[str] = None
    """Version of nimbus."""
    revision: Optional[str] = None
    """Git revision that was built, with "-dirty" if sources differed from it."""
    tool: Optional[str] = None
    """Name and version of the program that drew; None: nimbus."""
    date: Optional[str] = None
    """Start, UTC, ISO 8601."""
    command: Optional[List[str]] = None
    """The command line."""
    device: Optional[str] = None
    """Name of the Vulkan device."""
    driver: Optional[str] = None
    """Name and version of its driver."""
    api: Optional[str] = None
    """Vulkan version."""
    device_type: Optional[str] = None
    """discrete, integrated, virtual, cpu or other."""
    device_uuid: Optional[str] = None
    """UUID of the device, in hex."""
    cpu: Optional[str] = None
    """Model of the processor."""
    logical_cores: Optional[int] = None
    """Logical cores that the process might use."""
    environment: Optional[Dict[str, str]] = None
    """Variables that change what drivers do."""
    scene_hash: Optional[str] = None
    """SHA-256 of the resolved scene, in hex."""
    clocks: Optional[Dict[str, Any]] = None
    """Precision of the clocks, in ns, and how passes were timed (`pass_times`)."""
    interrupted: Optional[bool] = None
    """Whether Ctrl-C or an error came before the end; tables then have what was finished."""
    verified: bool = False
    """Whether all files had the SHA-256 that the folder's list names."""

    @property
    def pass_times(self) -> Optional[str]:
        """How passes were timed: drained, overlapping or off."""
        return None if self.clocks is None else self.clocks["pass_times"]


def _metadata(kind: str, path: Path, record: Optional[_Node], verified: bool) -> Metadata:
    shown = _shown(path)
    if record is None:
        return Metadata(kind, shown, verified=verified)
    device, cpu = record["device"], record["cpu"]
    known: Dict[str, Any] = {}
    if kind != "stress":
        clocks = record["clocks"]
        names = ("resolution_ns", "overhead_ns", "timestamp_period_ns", "timestamp_overhead_ns")
        known["clocks"] = {name: clocks[name].number() for name in names}
        # Results from before there was a choice do not name it.
        known["clocks"]["pass_times"] = clocks.get("pass_times").text_or_empty() or "drained"
        known["command"] = [word.text() for word in record["command"].each()]
        environment = record["environment"]
        known["environment"] = {key: environment[key].text() for key in environment.object()}
        known["scene_hash"] = record["scene_hash"].text()
    return Metadata(
        kind,
        shown,
        nimbus=record["nimbus"].text(),
        revision=record["revision"].text(),
        tool=record.get("tool").text_or_empty() or None,
        date=record["date"].text(),
        device=device["name"].text(),
        driver=device["driver"].text(),
        api=device["api"].text(),
        device_type=device["type"].text(),
        device_uuid=device["uuid"].text(),
        cpu=cpu["model"].text(),
        logical_cores=cpu["logical_cores"].integer(),
        interrupted=record["interrupted"].truth(),
        verified=verified,
        **known,
    )


class _Result:
    """The base of all results."""

    TABLES: Tuple[str, ...] = ()
    """Names of the tables; the first one is that of `to_pandas()`."""

    def __init__(self, metadata: Metadata, record: Optional[_Node]) -> None:
        self.metadata = metadata
        self.record: Dict[str, Any] = {} if record is None else record.object()
        """The JSON file as it is; empty for a CSV file."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.metadata.path}>"

    def __str__(self) -> str:
        about = self.metadata
        lines = [f"{about.path}: nimbus {COMMANDS[about.kind]}"]
        if about.device is not None:
            lines.append(_plain(f"{about.device}; {about.driver}"))
            lines.append(_plain(f"nimbus {about.nimbus} ({about.revision}); {about.date}"))
        if about.tool is not None:
            lines.append(_plain(f"drawn by {about.tool}"))
        if about.scene_hash is not None:
            lines.append(f"scene {about.scene_hash[:12]}; pass times: {_plain(about.pass_times)}")
        if about.interrupted:
            lines.append("interrupted: the tables have what was finished")
        return "\n".join(lines + [""] + self._lines())

    def _lines(self) -> List[str]:
        raise NotImplementedError

    def table(self, name: Optional[str] = None) -> Table:
        """Returns a table by its name; without a name the first of `TABLES`."""
        name = self.TABLES[0] if name is None else name
        if name not in self.TABLES:
            raise ValueError(f"no table \"{name}\"; expected one of {', '.join(self.TABLES)}")
        table = getattr(self, name)
        if table is None:
            what = f"has no {name}: JSON alone was read; read the folder of --out instead"
            raise ResultsError(f"{self.metadata.path}: {what}")
        return table

    def to_pandas(self, name: Optional[str] = None) -> Any:
        """Returns a table as a pandas.DataFrame, with the metadata as its `attrs`.

        Raises ImportError if pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise ImportError("to_pandas needs pandas: pip install pandas") from None
        frame = pandas.DataFrame(self.table(name))
        frame.attrs = asdict(self.metadata)
        return frame

    def to_json(self) -> Dict[str, Any]:
        """Returns metadata and tables, without those of single frames, for json.dumps.

        A table is a list of objects. Numbers that are not finite are None.
        """
        names = [name for name in self.TABLES if name not in ("frames", "times")]
        tables = {name: list(_rows(getattr(self, name))) for name in names}
        return _jsonable({**asdict(self.metadata), "tables": tables})


def _rows(table: Table) -> Iterator[Dict[str, Any]]:
    columns = [column.tolist() for column in table.values()]
    for row in zip(*columns):
        yield dict(zip(table, row))


def _jsonable(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _jsonable(of) for key, of in value.items()}
    if isinstance(value, (list, tuple)):
        return [_jsonable(of) for of in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _axes(axes: Any) -> Any:
    """Returns the given axes of matplotlib, or new ones."""
    try:
        from matplotlib import pyplot
    except ImportError:
        raise ImportError("plot needs matplotlib: pip install matplotlib") from None
    return pyplot.subplots()[1] if axes is None else axes


FRAME_COLUMNS = (
    "phase sweep threading skip block frame time_s warm_up frame_ms game_ms record_ms submit_ms"
    " wait_ms gpu_ms latency_ms queue_depth n_drawn ran image_hash"
).split()


def _kind_of_frame_column(name: str) -> Convert:
    if name in ("i_row", "block", "frame", "queue_depth", "n_drawn"):
        return _integers
    if name in ("skip", "warm_up", "discarded"):
        return _truths
    return _times if name in ("time_s", "end_s") or name.endswith("_ms") else _texts


class Run(_Result):
    """The results of `nimbus bench`.

    `frames`: frames.csv, a row a frame in the order in which they ran, warm-up included. None if
    the JSON alone was read.

    `loops`: a row for each loop of each case: `frames` counts the timed ones. Each of frame_ms,
    game_ms, record_ms, submit_ms, wait_ms, render_ms, gpu_ms and latency_ms is the median, in ms,
    with its 95 % interval (`_low`, `_high`), `_mean`, `_sd`, `_p95` and `_p99`. The three kinds of
    "1 % low" are in frames a second.

    `passes`: a row for each pass of each loop, with the median GPU time (`p50_ms`) of the timed
    frames that ran it, its `share` of the GPU time, and `saved_ms` a frame. `bytes` and
    `operations` are the least that the pass moves and computes, and `roof_share` the share of the
    device's roof that its median time reaches; NaN where they are not known.

    `cases`: a row for each phase of the scene and point of the sweep, with one column for each
    swept key. `ratio` is parallel by serial median frame time. `verdict` says whether the pictures
    were right (right, wrong or not_checked), and `reason` why they are not. `rmse` is their root
    mean square error against the f64 reference, with its 95 % interval, `max` the greatest error of
    a number, and `magnitude` the root mean square of the reference. `drawing_rms` and `light_rms`
    are the parts of the drawing and of the light, each with its `_bound`; `settings_rms` is the
    change that the scene's settings of `draw` make. Results that were not checked have NaN.

    `invocations`: a row for each pass of each case that nimbus bench --invocations counted: the
    invocations of `compute`, `vertex` and `fragment` shaders in one frame, and triangles before
    (`primitives`) and after clipping (`clipped_primitives`). Empty without that option.

    `parts`: a row for each part of a bench that a node of nimbus farm timed: its cases from `first`
    to before `end`, and the `node`. Empty if one process ran all.
    """

    TABLES = ("frames", "loops", "passes", "cases", "invocations", "parts")
    INVOKED = ("compute", "vertex", "fragment", "primitives", "clipped_primitives")
    """What nimbus bench --invocations counts."""
    QUANTITIES = (
        "frame_ms", "game_ms", "record_ms", "submit_ms", "wait_ms", "render_ms", "gpu_ms",
        "latency_ms",
    )  # fmt: skip
    """The times that run.json summarizes, in ms."""

    def __init__(self, metadata: Metadata, record: _Node, frames: Optional[Table]) -> None:
        super().__init__(metadata, record)
        self.frames = frames
        cases = record["cases"].each()
        self.cases = self._cases(cases)
        loops, passes = self._loops(cases)
        self.loops = loops
        self.passes = passes
        self.invocations = self._invocations(cases)
        stages = record.get("stages")
        self.failed_stages: Optional[List[str]] = None
        """The cases of nimbus stress that failed on the device; None if none were run."""
        if stages.value is not None:
            self.failed_stages = [name.text() for name in stages["failed"].each()]
        parts = record.get("parts")
        rows = [
            {
                "first": part["first"].integer(),
                "end": part["end"].integer(),
                "node": part["node"].text(),
                "date": part["date"].text(),
            }
            for part in (parts.each() if parts.value is not None else [])
        ]
        self.parts = _columns(rows, {"first": int, "end": int, "node": str, "date": str})

    def _cases(self, cases: Sequence[_Node]) -> Table:
        types = {
            "case": int, "phase": str, "sweep": str, "scene_hash": str, "particles": int,
            "width": int, "height": int, "figure": str, "ratio": float, "ratio_low": float,
            "ratio_high": float, "bound_ms": float, "reached": float, "gpu_ms_mean": float,
            "gpu_no_skip_ms_mean": float, **self.CHECK_TYPES,
        }  # fmt: skip
        rows = [
            {
                "case": i,
                "phase": case["phase"].text_or_empty(),
                "sweep": self._sweep(case),
                "scene_hash": case["scene_hash"].text(),
                "particles": case["particles"].integer(),
                "width": case["width"].integer(),
                "height": case["height"].integer(),
                "figure": case.get("figure").text_or_empty(),
                "ratio": case["ratio"].get("parallel_by_serial").number(),
                "ratio_low": case["ratio"].get("low").number(),
                "ratio_high": case["ratio"].get("high").number(),
                "bound_ms": case["overlap"].get("bound_ms").number(),
                "reached": case["overlap"].get("reached", "share").number(),
                "gpu_ms_mean": case["skipping"].get("gpu_ms").number(),
                "gpu_no_skip_ms_mean": case["skipping"].get("gpu_no_skip_ms").number(),
                **self._check(case.get("check")),
            }
            for i, case in enumerate(cases)
        ]
        return {**_columns(rows, types), **_settings([case["sweep"].each() for case in cases])}

    CHECK_TYPES = {
        "verdict": str, "reason": str, "n_pixels": float, "rmse": float, "rmse_low": float,
        "rmse_high": float, "max": float, "magnitude": float, "drawing_rms": float,
        "drawing_bound": float, "settings_rms": float, "light_rms": float, "light_bound": float,
    }  # fmt: skip

    def _invocations(self, cases: Sequence[_Node]) -> Table:
        counted = [(i, case.get("invocations")) for i, case in enumerate(cases)]
        rows = []
        for i, passes in counted:
            for of in passes.each() if passes.value is not None else []:
                row: Dict[str, Any] = {"case": i, "name": of["name"].text()}
                row.update((name, of[name].integer()) for name in self.INVOKED)
                rows.append(row)
        return _columns(rows, {"case": int, "name": str, **{name: int for name in self.INVOKED}})

    @staticmethod
    def _check(check: _Node) -> Dict[str, Any]:
        """Returns the columns of the check of a case's pictures."""
        row: Dict[str, Any] = {"verdict": "not_checked"}
        if check.value is not None:
            row["verdict"] = check["verdict"].one_of("right", "wrong", "not_checked")
        row["reason"] = check.get("reason").text_or_empty()
        row["n_pixels"] = check.get("n_pixels").number()
        row.update(_figure(check.get("rmse"), "rmse"))
        row.update((key, check.get(key).number()) for key in ("max", "magnitude", "settings_rms"))
        for part in ("drawing", "light"):
            row[f"{part}_rms"] = check.get(part, "rms").number()
            row[f"{part}_bound"] = check.get(part, "bound").number()
        return row

    @staticmethod
    def _sweep(case: _Node) -> str:
        return ", ".join(f"{s['key'].text()}={s['value'].text()}" for s in case["sweep"].each())

    def _loops(self, cases: Sequence[_Node]) -> Tuple[Table, Table]:
        of_loop = {"case": int, "phase": str, "sweep": str, "loop": str}
        types = {
            **of_loop, "threading": str, "skip": bool, "simulate": str, "frames": int,
            "warm_up": int, "blocks": int,
        }  # fmt: skip
        ends = {"": "p50", "_low": "p50_low", "_high": "p50_high", "_mean": "mean", "_sd": "sd",
                "_p95": "p95", "_p99": "p99"}  # fmt: skip
        types.update((name + end, float) for name in self.QUANTITIES for end in ends)
        rates = ("p99_fps", "slowest_mean_fps", "slowest_time_fps")
        types.update((name, float) for name in rates)
        types.update(empty_frames=float, block_spread=float)
        pass_types = {
            **of_loop, "name": str, "p50_ms": float, "share": float, "n_run": int,
            "n_skipped": int, "reason": str, "saved_ms": float, "bytes": float,
            "operations": float, "roof_share": float,
        }  # fmt: skip
        loops, passes = [], []
        for i, case in enumerate(cases):
            for mode in case["modes"].each():
                threading = mode["threading"].one_of("serial", "parallel")
                skip = mode["skip"].truth()
                common = {
                    "case": i,
                    "phase": case["phase"].text_or_empty(),
                    "sweep": self._sweep(case),
                    "loop": threading if skip else f"{threading} no-skip",
                }
                row = {**common, "threading": threading, "skip": skip}
                row["simulate"] = mode["simulate"].text()
                row.update((key, mode[key].integer()) for key in ("frames", "warm_up", "blocks"))
                for name in self.QUANTITIES:
                    for end, key in ends.items():
                        row[name + end] = mode[name].get(key).number()
                row.update((name, mode["frame_lows"].get(name).number()) for name in rates)
                row["empty_frames"] = mode.get("empty_frames").number()
                row["block_spread"] = mode["block_spread"].number()
                loops.append(row)
                passes.extend({**common, **self._pass(of)} for of in mode["passes"].each())
        return _columns(loops, types), _columns(passes, pass_types)

    @staticmethod
    def _pass(of: _Node) -> Dict[str, Any]:
        return {
            "name": of["name"].text(),
            "p50_ms": of["p50_ms"].number(),
            "share": of["share"].number(),
            "n_run": of["n_run"].integer(),
            "n_skipped": of["n_skipped"].integer(),
            "reason": of["reason"].text_or_empty(),
            "saved_ms": of["saved_ms"].number(),
            **{key: of.get(key).number() for key in ("bytes", "operations", "roof_share")},
        }

    def _is_timed(self) -> np.ndarray:
        """Returns which rows of `frames` are in the statistics: neither warm-up nor throttled
        frames that --discard-throttled left out. Earlier versions have no column of these."""
        frames = self.table("frames")
        is_timed = ~frames["warm_up"]
        return is_timed & ~frames["discarded"] if "discarded" in frames else is_timed

    def _is_of(self, i: int) -> np.ndarray:
        """Returns which rows of `frames` are timed frames of row `i` of `loops`."""
        frames, loops = self.table("frames"), self.loops
        result = self._is_timed() & (frames["skip"] == loops["skip"][i])
        for name in ("threading", "phase", "sweep"):
            result &= (frames[name] == loops[name][i]).astype(bool)
        return result

    def check_frames(self, path: Path) -> None:
        """Raises ResultsError if `frames` are not those of the record; `path` is their file."""
        n_left = int(self._is_timed().sum())
        for i, expected in enumerate(self.loops["frames"]):
            n = int(self._is_of(i).sum())
            n_left -= n
            if n != expected:
                name = f"{self.loops['loop'][i]} of case {self.loops['case'][i]}"
                what = f"holds {n} timed frames of the loop {name}, and run.json names {expected}"
                raise _error(path, f"{what}: cut off, or another run's")
        if n_left != 0:
            what = f"holds {n_left} timed frames of loops that run.json does not name"
            raise _error(path, f"{what}; expected those of the same run")

    def times(self, column: str = "frame_ms", case: int = 0, loop: Optional[str] = None) -> Any:
        """Returns the times of the timed frames of a loop, in the order in which they ran.

        `column`: a column of frames.csv, or render_ms, in ms. `loop`: serial, parallel, "serial
        no-skip" or "parallel no-skip"; by default the loop that is the figure of the case. Frames
        that skipped the pass of the column, or were not timed by the device, are left out.
        """
        if not 0 <= case < self.cases["case"].size:
            raise ValueError(f"no case {case}; the run has {self.cases['case'].size}, from 0")
        loop = self.cases["figure"][case] if loop is None else loop
        rows = np.flatnonzero((self.loops["case"] == case) & (self.loops["loop"] == loop))
        if rows.size == 0:
            names = ", ".join(self.loops["loop"][self.loops["case"] == case])
            raise ValueError(f"no loop \"{loop}\" in case {case}; expected one of {names}")
        frames, chosen = self.table("frames"), self._is_of(int(rows[0]))
        if column == "render_ms":
            parts = [frames[name][chosen] for name in ("record_ms", "submit_ms", "wait_ms")]
            return parts[0] + parts[1] + parts[2]
        if column not in frames or frames[column].dtype != np.float64:
            names = [name for name, of in frames.items() if of.dtype == np.float64]
            raise ValueError(f"no times \"{column}\"; expected render_ms, {', '.join(names)}")
        times = frames[column][chosen]
        return times[~np.isnan(times)] if column.startswith("gpu_") else times

    def plot(self, column: str = "frame_ms", case: int = 0, axes: Any = None) -> Any:
        """Draws the distribution of a time for each loop of a case, and returns the axes.

        The curves are the share of frames that took at most so many ms; the median is at 0.5.
        Raises ImportError if matplotlib is not installed.
        """
        axes = _axes(axes)
        for loop in self.loops["loop"][self.loops["case"] == case]:
            times = np.sort(_finite(self.times(column, case, loop)))
            if times.size:
                share = np.arange(1, times.size + 1) / times.size
                axes.step(times, share, where="post", label=f"{loop} ({times.size})")
        axes.axhline(0.5, color="0.8", linewidth=1, zorder=0)
        axes.set(xlabel=f"{column[:-3]} time (ms)", ylabel="share of frames", ylim=(0, 1))
        axes.set_title(_plain(f"{self.metadata.device}"), fontsize="small")
        axes.legend()
        return axes

    def _lines(self) -> List[str]:
        header = ["case", "loop", "n", "frame ms", "95 %", "game ms", "render ms", "gpu ms"]
        rows = [header + ["RMSE", "95 %"]]
        for of in _rows(self.loops):
            case = ", ".join(part for part in (of["phase"], of["sweep"]) if part)
            interval = _between(of["frame_ms_low"], of["frame_ms_high"], _number)
            rest = [_number(of[name]) for name in ("game_ms", "render_ms", "gpu_ms")]
            ends = (self.cases[f"rmse{end}"][of["case"]] for end in ("", "_low", "_high"))
            rmse, low, high = ends
            error = [_small(rmse), _between(low, high, _small)]
            first = [case or "-", of["loop"], str(of["frames"])]
            rows.append(first + [_number(of["frame_ms"]), interval] + rest + error)
        lines = _aligned(rows, 2)
        for of in _rows(self.cases):
            if of["verdict"] == "wrong":
                lines.append(f"case {of['case']}: the picture is wrong: {_plain(of['reason'])}")
        if self.failed_stages:
            lines.append(f"stages that failed: {_plain(', '.join(self.failed_stages))}")
        return lines


class Study(_Result):
    """The results of `nimbus error`.

    `configurations`: a row for each setting of the knobs, the unchanged scene first, with the
    columns of configurations.csv and one column for each knob. gpu_ms and frame_ms are in ms;
    by_base is the time by that of the unchanged scene; rmse, max, relmse and cloud are errors.
    `_low` and `_high` are 95 % intervals. `front` is on, near, off or unknown.

    `times`: times.csv, a row for each timed frame, in ms. None if the JSON alone was read.
    """

    TABLES = ("configurations", "times")

    def __init__(self, metadata: Metadata, record: _Node, times: Optional[Table]) -> None:
        super().__init__(metadata, record)
        self.times = times
        self.metric = record["metric"].one_of("rmse", "max", "relmse", "cloud")
        """The error that decides who is on the front: rmse, max, relmse or cloud."""
        self.time = record["time"].one_of("gpu", "frame")
        """The time that decides: gpu or frame."""
        self.best = record["best"].value
        """The configurations that the budgets buy: a list of objects as in study.json."""
        configurations = record["configurations"].each()
        rows = [self._row(of) for of in configurations]
        types: Dict[str, type] = {"name": str, "front": str}
        for name in ("gpu_ms", "frame_ms", "by_base", "rmse", "cloud"):
            types.update((name + end, float) for end in ("", "_low", "_high"))
        types.update(max=float, relmse=float, reference_resolves=float, turns=int, failure=str)
        types.update(picture=str, error_map=str)
        knobs = _settings([of["settings"].each() for of in configurations])
        self.configurations = {**_columns(rows, types), **knobs}

    @staticmethod
    def _row(of: _Node) -> Dict[str, Any]:
        error = of["error"]
        is_resolved = error.get("is_resolved")
        front = of["front"].one_of("on", "near", "off", "unknown")
        row: Dict[str, Any] = {"name": of["name"].text(), "front": front}
        for name in ("gpu_ms", "frame_ms", "by_base"):
            row.update(_figure(of[name], name))
        for name in ("rmse", "cloud"):
            row.update(_figure(error.get(name), name))
        row["max"], row["relmse"] = error.get("max").number(), error.get("relmse").number()
        resolves = math.nan if is_resolved.value is None else float(is_resolved.truth())
        row["reference_resolves"], row["turns"] = resolves, of["n_turns"].integer()
        for name in ("failure", "picture", "error_map"):
            row[name] = of[name].text_or_empty()
        return row

    def check_times(self, path: Path) -> None:
        """Raises ResultsError if `times` are not those of the study; `path` is their file."""
        times, n = self.table("times"), self.configurations["name"].size
        if times["configuration"].size and times["configuration"].max() >= n:
            what = f"names configuration {times['configuration'].max()}, and study.json has {n}"
            raise _error(path, f"{what}: another study's")

    def time_column(self) -> str:
        """Returns the column of `configurations` with the time that decides: gpu_ms or frame_ms."""
        return f"{self.time}_ms"

    def front(self) -> np.ndarray:
        """Returns the rows of `configurations` on the Pareto front, the fastest first."""
        rows = np.flatnonzero(self.configurations["front"] == "on")
        return rows[np.argsort(self.configurations[self.time_column()][rows], kind="stable")]

    def plot(self, axes: Any = None) -> Any:
        """Draws time (ms) against error for each configuration, and returns the axes.

        The front is a line. Bars are the 95 % intervals. Raises ImportError if matplotlib is not
        installed.
        """
        axes, table = _axes(axes), self.configurations
        column, error = self.time_column(), self.metric
        known = np.flatnonzero(np.isfinite(table[column]) & np.isfinite(table[error]))

        def bars(name: str) -> np.ndarray:
            value = table[name][known]
            ends = [table.get(name + end, table[name])[known] for end in ("_low", "_high")]
            low, high = (np.where(np.isfinite(end), end, value) for end in ends)
            return np.maximum([value - low, high - value], 0.0)

        axes.errorbar(
            table[column][known], table[error][known], xerr=bars(column), yerr=bars(error),
            fmt="o", color="0.6", markersize=4, linewidth=0.7, label="configurations",
        )  # fmt: skip
        front = self.front()
        axes.plot(table[column][front], table[error][front], "o-", label="front")
        for i in front:
            place = (table[column][i], table[error][i])
            beside = {"xytext": (4, 4), "textcoords": "offset points"}
            axes.annotate(_plain(table["name"][i]), place, fontsize="x-small", **beside)
        axes.set(xlabel=f"{self.time} time (ms)", ylabel=error, xscale="log", yscale="log")
        axes.set_title(_plain(f"{self.metadata.device}"), fontsize="small")
        axes.legend()
        return axes

    def _lines(self) -> List[str]:
        column = self.time_column()
        rows = [["", "configuration", f"{self.time} ms", "95 %", "by base", "RMSE", "95 %"]]
        marks = {"on": "*", "near": "~"}
        for i in np.argsort(self.configurations[column], kind="stable"):
            of = {name: values[i] for name, values in self.configurations.items()}
            rows.append([
                marks.get(of["front"], ""),
                of["name"],
                _number(of[column]),
                _between(of[f"{column}_low"], of[f"{column}_high"], _number),
                _number(of["by_base"]),
                _small(of["rmse"]),
                _between(of["rmse_low"], of["rmse_high"], _small),
            ])
        return _aligned(rows, 2) + ["* on the front  ~ near it"]


class Ledger(_Result):
    """The results of `nimbus ledger`.

    `rows`: a row for each approximation, from the picture as it is drawn to the whole model.
    `error` is the RMSE of the two pictures, with and without it; `share` its part of the sum.
    `time_ratio` is the time of a frame with it by that without. `_low` and `_high` are 95 %
    intervals.
    """

    TABLES = ("rows",)

    def __init__(self, metadata: Metadata, record: _Node) -> None:
        super().__init__(metadata, record)
        types: Dict[str, type] = {"name": str, "from": str, "to": str}
        types.update((f"error{end}", float) for end in ("", "_low", "_high"))
        types.update(relative=float, share=float, own_error=float, is_resolved=bool)
        types.update((f"time_ratio{end}", float) for end in ("", "_low", "_high"))
        self.rows = _columns([self._row(of) for of in record["rows"].each()], types)
        total = record["total"]
        self.total = Interval(*(total[key].number() for key in ("value", "low", "high")))
        """RMSE of the picture as it is drawn against the last one, with its 95 % interval."""
        self.sum = record["sum"].number()
        """Sum of the errors of all rows."""
        self.quadrature = record["quadrature"].number()
        """Root of the sum of their squares."""
        self.holds = record["holds"].truth()
        """Whether the total is at most the sum, within rounding."""

    @staticmethod
    def _row(of: _Node) -> Dict[str, Any]:
        row: Dict[str, Any] = {key: of[key].text() for key in ("name", "from", "to")}
        row.update(_figure(of["error"], "error"))
        row.update((key, of[key].number()) for key in ("relative", "share", "own_error"))
        row["is_resolved"] = of["is_resolved"].truth()
        row.update(_figure(of["time_ratio"], "time_ratio"))
        return row

    def _lines(self) -> List[str]:
        rows = [["approximation", "is", "stands for", "RMSE", "95 %", "share", "time by without"]]
        for of in _rows(self.rows):
            rows.append([
                of["name"],
                of["from"],
                of["to"],
                ("" if of["is_resolved"] else "!") + _small(of["error"]),
                _between(of["error_low"], of["error_high"], _small),
                f"{100.0 * of['share']:.1f} %",
                _number(of["time_ratio"]),
            ])
        total = f"total {_small(self.total.estimate)}; sum of the rows {_small(self.sum)}, in "
        return _aligned(rows, 3) + [f"{total}quadrature {_small(self.quadrature)}"]


class Stress(_Result):
    """The results of `nimbus stress`.

    `cases`: a row for each case, with the columns of --csv: `n` values were compared, and `at`
    is the one that is furthest off relative to its `bound`, with the device's `value`, the f64
    `truth` and the `error`. `seconds` is the time that the case took. From JSON also `what` is
    tried and what is `allowed`.
    """

    TABLES = ("cases",)
    VERDICTS = ("passed", "failed", "broken", "not-here")
    """The verdicts of a case; not-here: the device lacks a feature that the case needs."""
    TYPES = {
        "name": str, "verdict": str, "n": int, "n_beyond": int, "at": str, "value": float,
        "truth": float, "error": float, "bound": float, "remark": str, "seconds": float,
    }  # fmt: skip

    def __init__(self, metadata: Metadata, record: Optional[_Node], cases: Table) -> None:
        super().__init__(metadata, record)
        self.cases = cases

    @classmethod
    def _of_json(cls, record: _Node) -> Table:
        rows = []
        for of in record["cases"].each():
            row: Dict[str, Any] = {"name": of["name"].text(), "what": of["what"].text()}
            row["verdict"] = of["verdict"].one_of(*cls.VERDICTS)
            row.update(n=of["n"].integer(), n_beyond=of["n_beyond"].integer())
            worst = of["worst"]
            row["at"] = worst.get("at").text_or_empty()
            for key in ("value", "truth", "error", "bound"):
                row[key] = worst.get(key).number()
            row["allowed"], row["remark"] = of["bound"].text(), of["remark"].text_or_empty()
            row["seconds"] = of["seconds"].number()
            rows.append(row)
        return _columns(rows, {**cls.TYPES, "what": str, "allowed": str})

    @classmethod
    def _of_csv(cls, path: Path) -> Table:
        converts = {str: _texts, int: _integers, float: _numbers}
        of = lambda name: converts[cls.TYPES.get(name, str)]  # noqa: E731
        return _table_of(path, list(cls.TYPES), of, "the CSV of nimbus stress")

    def _lines(self) -> List[str]:
        rows = [["family", "cases", *self.VERDICTS, "greatest error / bound"]]
        families = np.array([name.partition("/")[0] for name in self.cases["name"]], dtype=object)
        for family in dict.fromkeys(families):
            of = families == family
            counts = [int((self.cases["verdict"][of] == word).sum()) for word in self.VERDICTS]
            error, bound = self.cases["error"][of], self.cases["bound"][of]
            shares = error[bound > 0.0] / bound[bound > 0.0]
            worst = max([share for share in shares if math.isfinite(share)], default=math.nan)
            cells = [str(n) for n in [int(of.sum()), *counts]]
            rows.append([family, *cells, _number(worst)])
        return _aligned(rows, 1)


class Comparison(_Result):
    """The results of `nimbus compare A B --json`, of two benches.

    `measures`: a row for each measure of each loop that both ran, `frame` first: the medians
    `a_ms` and `b_ms` of `n_a` and `n_b` times, `b_by_a`, their ratio with its 95 % interval, and
    the `verdict`, in the words of nimbus. `more_frames` is about how many more frames would decide;
    NaN if the verdict is decided or the version of nimbus did not say.

    `errors`: a row for each case whose pictures both runs checked: the RMSE `a` and `b`, their
    ratio `b_by_a` and the `verdict`. Empty if the version of nimbus did not compare them.
    """

    TABLES = ("measures", "errors")

    def __init__(self, metadata: Metadata, record: _Node) -> None:
        super().__init__(metadata, record)
        self.headline = record["headline"].text()
        """The measure that decides; the others are not corrected for many comparisons."""
        self.margin = record.get("margin").number()
        """Relative difference up to which times count as the same; NaN if there is none."""
        self.sides = {side: record[side].object() for side in ("a", "b")}
        """Folder, date, version, device and scene of A and B."""
        rows = [
            self._row(loop["name"].text(), of)
            for loop in record["modes"].each()
            for of in loop["measures"].each()
        ]
        types = {
            "loop": str, "measure": str, "n_a": int, "n_b": int, "a_ms": float, "b_ms": float,
            **self.RATIO_TYPES, "verdict": str, "more_frames": float,
        }  # fmt: skip
        self.measures = _columns(rows, types)
        errors = record.get("errors")
        rows = [self._error(of) for of in (errors.each() if errors.value is not None else [])]
        types = {"case": str, "a": float, "b": float, **self.RATIO_TYPES, "verdict": str}
        self.errors = _columns(rows, types)

    RATIO_TYPES = {"b_by_a": float, "b_by_a_low": float, "b_by_a_high": float}

    @staticmethod
    def _ratio(of: _Node) -> Dict[str, float]:
        ends = (("", "estimate"), ("_low", "low"), ("_high", "high"))
        return {f"b_by_a{end}": of["b_by_a"].get(key).number() for end, key in ends}

    @classmethod
    def _error(cls, of: _Node) -> Dict[str, Any]:
        numbers = {key: of[key].number() for key in ("a", "b")}
        row = {"case": of["name"].text(), **numbers, **cls._ratio(of)}
        return {**row, "verdict": of["verdict"].text()}

    @classmethod
    def _row(cls, loop: str, of: _Node) -> Dict[str, Any]:
        row: Dict[str, Any] = {"loop": loop}
        row.update((key, of[key].text()) for key in ("measure", "verdict"))
        row.update((key, of[key].integer()) for key in ("n_a", "n_b"))
        row.update((key, of[key].number()) for key in ("a_ms", "b_ms"))
        row.update(cls._ratio(of))
        row["more_frames"] = of.get("more_frames").number()
        return row

    def _lines(self) -> List[str]:
        rows = [["loop", "measure", "A ms", "B ms", "B / A", "95 %", "B is"]]
        for of in _rows(self.measures):
            interval = _between(of["b_by_a_low"], of["b_by_a_high"], _number)
            times = [_number(of[key]) for key in ("a_ms", "b_ms", "b_by_a")]
            verdict = of["verdict"].replace("_", " ")
            rows.append([of["loop"], of["measure"], *times, interval, verdict])
        names = [f"{side.upper()}  {_plain(of.get('folder'))}" for side, of in self.sides.items()]
        return names + _aligned(rows, 2) + [f"{_plain(self.headline)} decides"]


class History(_Result):
    """The results of `nimbus history DIR… --json`.

    `runs`: a row for each run, in `order`: its number, folder, date, version, revision, device and
    scene.

    `points`: a row for each figure of each run: the `value` with its 95 % interval within the run,
    in `unit`, and the `level` between two changes. `quantity` is frame or RMSE, and `name` the case
    and the loop.

    `changes`: a row for each change: the first run after it (`run`), the runs that may as well be
    (`run_low` to `run_high`), the last run before it (`after`), and `by`, the level after by the
    level before, with its 95 % interval. `p` is the chance of such a change at one place if nothing
    had changed.
    """

    TABLES = ("points", "changes", "runs")

    def __init__(self, metadata: Metadata, record: _Node) -> None:
        super().__init__(metadata, record)
        self.order = record["order"].one_of("revision", "date")
        """What the runs are ordered by."""
        self.remarks = [remark.text() for remark in record["remarks"].each()]
        """Sentences on runs that may mislead."""
        texts = ("folder", "date", "nimbus", "revision", "device", "scene_hash")
        rows = [
            {"run": i, **{name: run[name].text() for name in texts}}
            for i, run in enumerate(record["runs"].each())
        ]
        self.runs = _columns(rows, {"run": int, **{name: str for name in texts}})
        points: List[Dict[str, Any]] = []
        changes: List[Dict[str, Any]] = []
        for of in record["series"].each():
            names = {name: of[name].text() for name in ("quantity", "unit", "name")}
            points.extend({**names, **self._point(point)} for point in of["points"].each())
            changes.extend({**names, **self._change(change)} for change in of["changes"].each())
        self.points = _columns(points, {**self.NAMES, **self.POINT_TYPES})
        self.changes = _columns(changes, {**self.NAMES, **self.CHANGE_TYPES})

    NAMES = {"quantity": str, "unit": str, "name": str}
    POINT_TYPES = {"run": int, "value": float, "low": float, "high": float, "level": float}
    CHANGE_TYPES = {
        "run": int, "run_low": int, "run_high": int, "after": int, "by": float, "by_low": float,
        "by_high": float, "p": float,
    }  # fmt: skip

    @staticmethod
    def _point(of: _Node) -> Dict[str, Any]:
        figure = of["figure"]
        ends = {key: figure.get(key).number() for key in ("low", "high")}
        numbers = {"value": figure["value"].number(), **ends, "level": of["level"].number()}
        return {"run": of["run"].integer(), **numbers}

    @staticmethod
    def _change(of: _Node) -> Dict[str, Any]:
        low, high = (run.integer() for run in of["runs"].each())
        ends = (("", "estimate"), ("_low", "low"), ("_high", "high"))
        row: Dict[str, Any] = {"run": of["run"].integer(), "run_low": low, "run_high": high}
        row.update((f"by{end}", of["by"][key].number()) for end, key in ends)
        return {**row, "after": of["after"].integer(), "p": of["p"].number()}

    def _lines(self) -> List[str]:
        rows = [["quantity", "name", "run", "value", "95 %", "level", "change"]]
        changed = {
            (of["quantity"], of["name"], of["run"]): f"x {_number(of['by'])}"
            for of in _rows(self.changes)
        }
        for of in _rows(self.points):
            form = _number if of["unit"] else _small
            interval = _between(of["low"], of["high"], form)
            change = changed.get((of["quantity"], of["name"], of["run"]), "")
            numbers = [str(of["run"]), form(of["value"]), interval, form(of["level"])]
            rows.append([of["quantity"], of["name"], *numbers, change])
        return _aligned(rows, 2) + [_plain(remark) for remark in self.remarks]


class Frames(_Result):
    """Frames of `nimbus farm merge` or `nimbus render --frames`: an animation, a picture a file.

    `pictures`: a row for each picture, in the order of frames: its number, `file`, `format` (png or
    exr), `bytes`, and `sha256` as frames.sha256 lists it. `missing` has the numbers between the
    first and the last frame that have no picture.
    """

    TABLES = ("pictures",)

    def __init__(self, metadata: Metadata, folder: Path, listed: Dict[str, str]) -> None:
        super().__init__(metadata, None)
        rows = []
        for name, sha256 in listed.items():
            stem, _, form = name.rpartition(".")
            number = stem[len("frame-") :]
            is_frame = stem.startswith("frame-") and number.isascii() and number.isdigit()
            if not is_frame or form not in ("png", "exr"):
                what = f"lists {_plain(name)}, which is no frame such as frame-00000007.png"
                raise _error(folder / "frames.sha256", what)
            size = (folder / name).stat().st_size if (folder / name).is_file() else -1
            if size < 0:
                raise _error(folder / name, "is missing, and frames.sha256 lists it")
            row = {"frame": int(number), "file": name, "format": form, "bytes": size}
            rows.append({**row, "sha256": sha256})
        rows.sort(key=lambda row: row["frame"])
        types = {"frame": int, "file": str, "format": str, "bytes": int, "sha256": str}
        self.pictures = _columns(rows, types)
        numbers = [row["frame"] for row in rows]
        span = range(numbers[0], numbers[-1] + 1) if numbers else range(0)
        self.missing: List[int] = [] if len(span) == len(numbers) else sorted(
            set(span) - set(numbers)
        )
        """Numbers between the first and the last frame that have no picture."""

    def _lines(self) -> List[str]:
        of = self.pictures
        n = of["frame"].size
        if n == 0:
            return ["no frames"]
        span = f"{n} frames, {of['frame'][0]} to {of['frame'][-1]}"
        lines = [f"{span}, {int(of['bytes'].sum())} bytes"]
        if self.missing:
            lines.append(f"missing: {', '.join(str(number) for number in self.missing[:20])}")
        return lines


Result = Union[Run, Study, Ledger, Stress, Comparison, History, Frames]


def _times_of_study(path: Path, record: _Node) -> Table:
    needed = ("round", "turn", "configuration", "name", "gpu_ms", "frame_ms")
    kinds = {"gpu_ms": _times, "frame_ms": _times, "name": _texts}
    # A study that was interrupted before its first turn has a file without a line.
    turns = [of["n_turns"].integer() for of in record["configurations"].each()]
    if not any(turns) and not _text_of(path):
        return {name: kinds.get(name, _integers)([]) for name in needed}
    of = lambda name: kinds.get(name, _integers if name in needed else _texts)  # noqa: E731
    return _table_of(path, needed, of, "the times.csv of nimbus error")


def _read_record(record_path: Path, path: Path, folder: Optional[Path], verify: bool) -> Result:
    """Reads a JSON file; with a folder, also the table beside it."""
    record = _json_of(record_path)
    kind = record_path.stem if folder is not None else _kind_of(record)
    _check_schema(record, kind)
    if kind == "comparison":
        return Comparison(_metadata(kind, path, None, False), record)
    if kind == "history":
        return History(_metadata(kind, path, None, False), record)
    verified = folder is not None and verify and _check_list(folder, kind)
    metadata = _metadata(kind, path, record, verified)
    if kind == "run":
        if folder is None:
            return Run(metadata, record, None)
        table = folder / "frames.csv"
        what = "the frames.csv of nimbus bench"
        run = Run(metadata, record, _table_of(table, FRAME_COLUMNS, _kind_of_frame_column, what))
        run.check_frames(table)
        return run
    if kind == "study":
        table = None if folder is None else folder / "times.csv"
        study = Study(metadata, record, None if table is None else _times_of_study(table, record))
        if table is not None:
            study.check_times(table)
        return study
    if kind == "ledger":
        return Ledger(metadata, record)
    return Stress(metadata, record, Stress._of_json(record))


def _read_frames(folder: Path, path: Path, verify: bool) -> Frames:
    """Reads pictures of frames."""
    verified = verify and _check_list(folder, "frames")
    lines = _text_of(folder / "frames.sha256").rstrip("\n").split("\n")
    pairs = (line.partition("  ") for line in lines if line)
    listed = {name: sha256 for sha256, _, name in pairs}
    return Frames(_metadata("frames", path, None, verified), folder, listed)


def _record_of_folder(folder: Path) -> Path:
    """Returns the record of a folder of results."""
    try:
        entries = sorted(folder.iterdir())
    except OSError as cause:
        raise _error(folder, f"cannot be read: {cause.strerror or cause}") from None
    names = [f"{kind}.json" for kind in ("run", "study", "ledger")]
    records = [folder / name for name in names if (folder / name).exists()]
    if len(records) == 1:
        return records[0]
    if records:
        found = ", ".join(record.name for record in records)
        raise _error(folder, f"holds several results, {found}; name one of these files")
    expected = "expected a folder that nimbus bench, error, ledger or farm merge wrote"
    deeper = [of for of in entries if any((of / name).exists() for name in names)]
    if deeper:
        expected = f"it has folders of results in it: name one, such as {_shown(deeper[0])}"
    raise _error(folder, f"holds no run.json, study.json or ledger.json; {expected}")


def read(path: Union[str, "os.PathLike[str]"], verify: bool = True) -> Result:
    """Reads a result of nimbus and returns an object of the class of its command.

    `path`: a folder of --out or of farm merge, its run.json, study.json or ledger.json, a file with
    the output of --json, or one with that of nimbus stress --csv. `verify`: whether the files must
    have the SHA-256 that the folder's list names, if it has a list.

    Raises ResultsError if something is missing, damaged, or of another schema version.
    """
    path = Path(path)
    try:
        is_there, is_folder = path.exists(), path.is_dir()
    except (OSError, ValueError) as cause:
        raise _error(path, f"cannot be read: {_plain(cause)}") from None
    if is_folder and (path / "frames.sha256").exists():
        return _read_frames(path, path, verify)
    if is_folder:
        return _read_record(_record_of_folder(path), path, path, verify)
    if not is_there:
        what = "there is no such file or folder; expected results of nimbus"
        partial = path.with_name(f"{path.name}.partial") if path.name else path
        if partial.is_dir():
            what = f"{what}; {_shown(partial)} has those of a run that ended early"
        raise _error(path, what)
    if path.name in ("frames.csv", "times.csv", "configurations.csv"):
        what = "is one table of a result, without device and scene; name its folder instead"
        raise _error(path, what)
    if path.suffix.lower() == ".csv" or _text_of(path).startswith("name,verdict,"):
        return Stress(_metadata("stress", path, None, False), None, Stress._of_csv(path))
    is_in_folder = path.name in ("run.json", "study.json", "ledger.json")
    if is_in_folder and path.with_suffix(".sha256").exists():
        return _read_record(path, path, path.parent, verify)
    return _read_record(path, path, None, verify)


# The program.

DESCRIPTION = """\
Prints a short table of each result of nimbus.

PATH is one of:
  a folder of        nimbus bench --out, nimbus error --out or nimbus ledger --out,
                     or of nimbus farm merge
  a JSON file from   nimbus bench, error, ledger, stress, compare or history with
                     --json
  a CSV file from    nimbus stress --csv
"""

EPILOG = """\
A run's table has the medians of each loop with their 95 % interval. A study's table is sorted by
time, and * marks the Pareto front. --json prints metadata and all tables but those of single
frames, as a list with one object for each PATH.

examples:
  nimbus bench scenes/threads.toml --out run
  python3 tools/nimbus_results.py run
  python3 tools/nimbus_results.py --json run study > results.json

In Python, with this file's folder on the path:
  import nimbus_results as nr
  run = nr.read("run")
  print(nr.median_interval(run.times("frame_ms", loop="serial")))

docs/how-to/read-results.ipynb is a worked example; docs/reference/results.md explains the columns.

exit codes: 0 done; 2 bad input: one line for each PATH that cannot be read, and the others are
still printed; 130 interrupted.
"""


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Runs the program and returns its exit code."""
    for stream in (sys.stdout, sys.stderr):
        # A name that the terminal's encoding lacks must not end the program.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    parser = argparse.ArgumentParser(
        prog="nimbus_results.py",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("paths", metavar="PATH", nargs="+", help="a folder or file of results")
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    parser.add_argument(
        "--no-verify", action="store_true", help="do not check the SHA-256 of the files"
    )
    args = parser.parse_args(arguments)
    results, code = [], 0
    for path in args.paths:
        try:
            results.append(read(path, verify=not args.no_verify))
        except ResultsError as error:
            print(f"nimbus_results: {error}", file=sys.stderr)
            code = 2
    if args.json:
        print(json.dumps([result.to_json() for result in results], indent=1))
    elif results:
        print("\n\n".join(str(result) for result in results))
    return code


if __name__ == "__main__":
    try:
        exit_code = main()
        sys.stdout.flush()
    except KeyboardInterrupt:
        exit_code = 130
    except BrokenPipeError:
        # The reader, such as head, has all that it wanted.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        exit_code = 0
    sys.exit(exit_code)
