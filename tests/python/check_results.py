#!/usr/bin/env python3
"""Compares what tools/nimbus_results.py computes from single frames with what nimbus wrote.

    check_results.py PATH…

Every number must be equal, to the last bit. Prints the number of comparisons of each result, and
ends with exit code 1 if two numbers differ or nothing could be compared.
"""
import csv
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))
import nimbus_results as nr  # noqa: E402


class Comparison:
    """Counts comparisons and keeps those that differ."""

    def __init__(self):
        self.n = 0
        self.differences = []

    def equal(self, what, computed, written):
        self.n += 1
        are_nan = all(isinstance(v, float) and math.isnan(v) for v in (computed, written))
        if computed != written and not are_nan:
            self.differences.append(f"{what}: computed {computed!r}, written {written!r}")


def check_loop(run, i_case, mode, found):
    """Compares the statistics of one loop of a case, and the medians of its passes."""
    loop = mode["threading"] if mode["skip"] else f"{mode['threading']} no-skip"
    what = f"case {i_case}, {loop}"
    for quantity in run.QUANTITIES:
        computed = nr.summary(run.times(quantity, i_case, loop))
        if mode[quantity] is None:
            found.equal(f"{what}: n of {quantity}", computed["n"], 0)
        for key, written in (mode[quantity] or {}).items():
            found.equal(f"{what}: {quantity}.{key}", computed[key], written)
    found.equal(f"{what}: frame_lows", nr.lows(run.times("frame_ms", i_case, loop)),
                mode["frame_lows"])
    for of in mode["passes"]:
        computed = nr.median(run.times(f"gpu_{of['name']}_ms", i_case, loop))
        written = math.nan if of["p50_ms"] is None else of["p50_ms"]
        found.equal(f"{what}: p50 of {of['name']}", computed, written)


def check_run(run, found):
    for i_case, case in enumerate(run.record["cases"]):
        for mode in case["modes"]:
            check_loop(run, i_case, mode, found)
        if case["ratio"] is None:
            continue
        end = "" if any(mode["skip"] for mode in case["modes"]) else " no-skip"
        serial, parallel = (
            run.times("frame_ms", i_case, f"{name}{end}") for name in ("serial", "parallel")
        )
        ratio = nr.median(parallel) / nr.median(serial)
        found.equal(f"case {i_case}: ratio", ratio, case["ratio"]["parallel_by_serial"])
        interval = nr.ratio_of_medians(parallel, serial)
        for key in ("low", "high"):
            computed = None if interval is None else getattr(interval, key)
            found.equal(f"case {i_case}: ratio.{key}", computed, case["ratio"][key])


def check_study(study, found):
    """Compares the table of configurations, which comes from study.json, with the CSV file."""
    path = Path(study.metadata.path) / "configurations.csv"
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    found.equal("configurations", len(rows), study.configurations["name"].size)
    for i, row in enumerate(rows):
        for name, written in row.items():
            value = study.configurations[name][i]
            if not isinstance(value, str):
                written = {"true": "1", "false": "0", "": "nan"}.get(written, written)
                value, written = float(value), float(written)
            found.equal(f"configuration {i}: {name}", value, written)
        turns = set(study.times["turn"][study.times["configuration"] == i])
        found.equal(f"configuration {i}: turns", len(turns), int(row["turns"]))


def check_other(result, found):
    """Compares the JSON of a table with the record, row by row."""
    key = result.TABLES[0]
    rows = result.to_json()["tables"][key]
    if result.record:
        found.equal(key, len(rows), len(result.record[key]))
    for row, written in zip(rows, result.record.get(key, rows)):
        figure = written.get("error")
        if isinstance(figure, dict):
            found.equal(f"{row['name']}: error", row["error"], figure["value"])
        found.equal(f"{row['name']}: name", row["name"], written["name"])
        if written.get("worst"):
            for of in ("value", "truth", "error", "bound"):
                found.equal(f"{row['name']}: {of}", row[of], written["worst"][of])


def main():
    code = 0
    for path in sys.argv[1:]:
        result, found = nr.read(path), Comparison()
        check = {nr.Run: check_run, nr.Study: check_study}.get(type(result), check_other)
        check(result, found)
        print(f"{path}: {found.n} comparisons, {len(found.differences)} differences")
        for difference in found.differences[:20]:
            print(f"  {difference}")
        if found.differences or found.n == 0:
            code = 1
    return code


if __name__ == "__main__":
    sys.exit(main())
