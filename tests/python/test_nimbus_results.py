"""Tests of tools/nimbus_results.py: statistics, tables, damaged files, and the program.

The results in docs/how-to/sample-results are copied and damaged in one way each.
"""
import contextlib
import csv
import hashlib
import io
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
TOOL = ROOT / "tools/nimbus_results.py"
SAMPLES = ROOT / "docs/how-to/sample-results"
sys.path.insert(0, str(TOOL.parent))
import nimbus_results as nr  # noqa: E402


class InFolder(unittest.TestCase):
    """A test with a copy of the sample results."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name) / "samples"
        shutil.copytree(SAMPLES, self.folder)

    def edit(self, name, change):
        """Changes the text of a file and the list of its folder."""
        path = self.folder / name
        text = path.read_text(encoding="utf-8")
        changed = change(text)
        self.assertNotEqual(changed, text, "the test changes something")
        path.write_text(changed, encoding="utf-8")
        self.relist(path)

    def relist(self, path):
        """Writes the SHA-256 of a changed file to the list of its folder."""
        for listing in path.parent.glob("*.sha256"):
            lines = listing.read_text(encoding="utf-8").splitlines()
            own = hashlib.sha256(path.read_bytes()).hexdigest()
            lines = [f"{own}  {path.name}" if line.endswith(f"  {path.name}") else line
                     for line in lines]
            listing.write_text("\n".join(lines) + "\n", encoding="utf-8")

    def edit_json(self, name, change):
        """Changes the value of a JSON file in place."""

        def changed(text):
            value = json.loads(text)
            change(value)
            return json.dumps(value)

        self.edit(name, changed)

    def refused(self, name, *expected, **options):
        """Asserts that a path cannot be read, and that the message has the expected parts."""
        with self.assertRaises(nr.ResultsError) as caught:
            nr.read(self.folder / name, **options)
        message = str(caught.exception)
        self.assertNotIn("\n", message)
        for part in expected:
            self.assertIn(part, message)
        return message


class Statistics(unittest.TestCase):
    def test_hand_worked_summary(self):
        s = nr.summary([4.0, 1.0, 3.0, 2.0])
        self.assertEqual((s["n"], s["min"], s["max"], s["mean"]), (4, 1.0, 4.0, 2.5))
        # The squares of -1.5, -0.5, 0.5 and 1.5 sum to 5.
        self.assertEqual(s["sd"], math.sqrt(5.0 / 3.0))
        for key, expected in (("p1", 1.03), ("p5", 1.15), ("p50", 2.5), ("p95", 3.85)):
            self.assertAlmostEqual(s[key], expected, delta=4e-15)
        self.assertIsNone(s["p50_low"])

    def test_values_that_are_not_finite_are_counted_and_left_out(self):
        s = nr.summary([1.0, math.nan, 3.0, math.inf])
        self.assertEqual((s["n"], s["n_not_finite"], s["p50"]), (2, 2, 2.0))
        empty = nr.summary([])
        self.assertEqual((empty["n"], empty["p50"]), (0, None))
        self.assertTrue(math.isnan(nr.median([math.nan])))
        self.assertIsNone(nr.summary([7.0])["sd"])

    def test_quantiles_are_those_of_numpy(self):
        values = np.random.default_rng(1).normal(size=101)
        for p in (0.0, 0.013, 0.5, 0.77, 1.0):
            self.assertAlmostEqual(nr.quantile(values, p), np.quantile(values, p), delta=1e-12)

    def test_random_numbers_are_those_of_splitmix(self):
        """The first outputs for seed 0 of the reference implementation of SplitMix64."""
        outputs = (0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F)
        for limit in (1, 7, 1000, 500_000, 2**32 - 1):
            got = nr._random_below(0, (1, 3), np.full(3, limit, dtype=np.uint64))
            self.assertEqual(got.tolist(), [[(output * limit) >> 64 for output in outputs]])
        got = nr._random_below(1, (2, 1), np.full(1, 1000, dtype=np.uint64))
        self.assertEqual(got.tolist(), [[(of * 1000) >> 64] for of in outputs[1:]])

    def test_an_interval_needs_thirty_values(self):
        values = np.linspace(1.0, 2.0, 30)
        interval = nr.median_interval(values)
        self.assertTrue(interval.low < interval.estimate == 1.5 < interval.high)
        self.assertIsNone(nr.median_interval(values[1:]))
        self.assertIsNone(nr.ratio_of_medians(values, values[1:]))
        self.assertIsNone(nr.median_interval([math.nan] * 40))

    def test_an_interval_does_not_depend_on_the_size_of_a_chunk(self):
        values = np.random.default_rng(2).lognormal(size=3000)
        whole = nr.median_interval(values)
        with mock.patch.object(nr, "CHUNK_OF_RESAMPLES", 10_000):
            self.assertEqual(nr.median_interval(values), whole)

    def test_ratio_of_medians(self):
        a = np.random.default_rng(3).normal(10.0, 0.1, 60)
        ratio = nr.ratio_of_medians(2.0 * a, a)
        self.assertEqual(ratio.estimate, 2.0)
        self.assertTrue(1.9 < ratio.low < 2.0 < ratio.high < 2.1)
        self.assertIsNone(nr.ratio_of_medians(a, 0.0 * a))

    def test_lows_by_three_definitions(self):
        # 99 frames of 10 ms and one of 100 ms: 1 % of the 1090 ms is reached by the longest.
        found = nr.lows([10.0] * 99 + [100.0])
        self.assertAlmostEqual(found["p99_fps"], 1000.0 / 10.9, delta=1e-9)
        self.assertEqual((found["slowest_mean_fps"], found["slowest_time_fps"]), (10.0, 10.0))
        self.assertIsNone(nr.lows([0.0, 1.0]))
        self.assertIsNone(nr.lows([]))


class Tables(InFolder):
    def test_schemas_are_those_of_the_documentation(self):
        for kind, version in nr.SCHEMAS.items():
            path = ROOT / f"docs/reference/schemas/{kind}.schema.json"
            schema = json.loads(path.read_text(encoding="utf-8"))
            self.assertEqual(schema["properties"]["schema"]["const"], version, kind)

    def test_samples_are_small(self):
        files = [path for path in SAMPLES.rglob("*") if path.is_file()]
        self.assertLessEqual(sum(path.stat().st_size for path in files), 220 * 1024)

    def test_statistics_of_the_frames_are_those_of_run_json(self):
        run = nr.read(self.folder / "run")
        for mode in run.record["cases"][0]["modes"]:
            loop = mode["threading"] if mode["skip"] else f"{mode['threading']} no-skip"
            for quantity in run.QUANTITIES:
                self.assertEqual(nr.summary(run.times(quantity, loop=loop)), mode[quantity])
            self.assertEqual(nr.lows(run.times(loop=loop)), mode["frame_lows"])
            self.assertIsNotNone(mode["frame_ms"]["p50_low"], "the sample has intervals")

    def test_columns_of_frames(self):
        run = nr.read(self.folder / "run")
        with open(self.folder / "run/frames.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(list(run.frames), list(rows[0]))
        kinds = {"i_row": np.int64, "skip": bool, "frame_ms": np.float64, "ran": object}
        for name, kind in kinds.items():
            self.assertEqual(run.frames[name].dtype, kind)
        self.assertEqual(run.frames["frame_ms"].tolist(), [float(row["frame_ms"]) for row in rows])
        is_empty = [row["gpu_generate_ms"] == "" for row in rows]
        self.assertEqual(np.isnan(run.frames["gpu_generate_ms"]).tolist(), is_empty)
        self.assertTrue(any(is_empty) and not all(is_empty))
        self.assertEqual(run.frames["ran"].tolist(), [row["ran"] for row in rows])

    def test_chunks_of_rows_are_joined(self):
        whole = nr.read(self.folder / "run").frames
        with mock.patch.object(nr, "CHUNK", 7):
            parts = nr.read(self.folder / "run").frames
        for name, column in whole.items():
            np.testing.assert_array_equal(parts[name], column)
            self.assertEqual(parts[name].dtype, column.dtype)

    def test_metadata(self):
        about = nr.read(self.folder / "run").metadata
        record = json.loads((self.folder / "run/run.json").read_text(encoding="utf-8"))
        self.assertEqual((about.kind, about.verified, about.interrupted), ("run", True, False))
        self.assertEqual(about.device, record["device"]["name"])
        self.assertEqual(about.driver, record["device"]["driver"])
        self.assertEqual(about.revision, record["revision"])
        self.assertEqual(about.scene_hash, record["scene_hash"])
        self.assertEqual(about.pass_times, record["clocks"]["pass_times"])
        self.edit_json("run/run.json", lambda run: run["clocks"].pop("pass_times"))
        self.assertEqual(nr.read(self.folder / "run").metadata.pass_times, "drained")

    def test_configurations_are_those_of_the_csv(self):
        study = nr.read(self.folder / "study")
        with open(self.folder / "study/configurations.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        for name in rows[0]:
            written = [row[name] for row in rows]
            column = study.configurations[name].tolist()
            if not isinstance(column[0], str):
                words = {"true": 1.0, "false": 0.0}
                written = [words[of] if of in words else float(of) for of in written]
            self.assertEqual(column, written, name)
        grid = study.configurations["lighting.grid"]
        self.assertTrue(math.isnan(grid[0]) and sorted(set(grid[1:])) == [16.0, 32.0])
        front = study.front()
        self.assertEqual(set(study.configurations["front"][front]), {"on"})
        self.assertTrue((np.diff(study.configurations["gpu_ms"][front]) >= 0).all())

    def test_rows_of_a_ledger(self):
        ledger = nr.read(self.folder / "ledger")
        errors = [row["error"]["value"] for row in ledger.record["rows"]]
        self.assertEqual(ledger.rows["error"].tolist(), errors)
        self.assertAlmostEqual(ledger.rows["share"].sum(), 1.0, delta=1e-12)
        self.assertTrue(ledger.holds and ledger.total.estimate <= ledger.sum)

    def test_stress_as_json_and_as_csv(self):
        stress = nr.read(self.folder / "stress.json")
        self.assertEqual(stress.cases["name"].tolist(),
                         [case["name"] for case in stress.record["cases"]])
        lines = ["name,verdict,n,n_beyond,at,value,truth,error,bound,remark,seconds",
                 "a/b,passed,3,0,\"x = 1, y = 2\",1,NaN,inf,0.5,,0.25",
                 "a/c,not-here,0,0,,,,,,no subgroups,0"]
        for name in ("stress.csv", "stress-of-csv"):
            path = self.folder / name
            path.write_text("\n".join(lines) + "\n", encoding="utf-8")
            cases = nr.read(path).cases
            self.assertEqual(cases["at"].tolist(), ["x = 1, y = 2", ""])
            self.assertEqual((cases["n"][0], cases["error"][0]), (3, math.inf))
            self.assertTrue(np.isnan(cases["truth"]).all())
            self.assertIn("a ", str(nr.read(path)))

    def test_sweeps_and_phases_have_columns_and_loops_of_their_own(self):
        def two_cases(run):
            first = run["cases"][0]
            first["sweep"] = [{"key": "lighting.grid", "value": "32"}]
            second = json.loads(json.dumps(first))
            second["sweep"][0]["value"] = "64"
            second["phase"] = "dense"
            for mode in second["modes"]:
                mode["frames"] = 0
            run["cases"].append(second)

        self.edit_json("run/run.json", two_cases)
        old, new = ",,,serial", ",,lighting.grid=32,serial"
        self.edit("run/frames.csv", lambda text: text.replace(old, new)
                  .replace(old.replace("serial", "parallel"), new.replace("serial", "parallel")))
        run = nr.read(self.folder / "run")
        self.assertEqual(run.cases["lighting.grid"].tolist(), [32.0, 64.0])
        self.assertEqual(run.times(case=0, loop="serial").size, 32)
        self.assertEqual(run.times(case=1, loop="serial").size, 0)
        self.assertIn("dense, lighting.grid=64", str(run))

    def test_wrong_arguments_name_what_there_is(self):
        run = nr.read(self.folder / "run")
        for expected, call in (
            ("serial, parallel, serial no-skip", lambda: run.times(loop="both")),
            ("no case 1", lambda: run.times(case=1)),
            ("render_ms", lambda: run.times("n_drawn")),
            ("frames, loops, passes, cases, invocations, parts", lambda: run.table("blocks")),
        ):
            with self.assertRaisesRegex(ValueError, expected):
                call()

    def test_json_alone_has_no_frames(self):
        path = self.folder / "printed.json"
        shutil.copy(self.folder / "run/run.json", path)
        run = nr.read(path)
        self.assertIsNone(run.frames)
        self.assertFalse(run.metadata.verified)
        with self.assertRaisesRegex(nr.ResultsError, "has no frames"):
            run.times()
        # The record of a folder stands for the folder.
        self.assertIsNotNone(nr.read(self.folder / "run/run.json").frames)

    def test_an_interrupted_run_is_read_and_says_so(self):
        def interrupt(run):
            run["interrupted"] = True
            run["cases"][0]["modes"][1]["frames"] -= 3

        self.edit_json("run/run.json", interrupt)

        def without_last_parallel_frames(text):
            lines = text.splitlines(keepends=True)
            parallel = [i for i, line in enumerate(lines) if ",parallel," in line]
            return "".join(line for i, line in enumerate(lines) if i not in parallel[-3:])

        self.edit("run/frames.csv", without_last_parallel_frames)
        run = nr.read(self.folder / "run")
        self.assertTrue(run.metadata.interrupted)
        self.assertIn("interrupted", str(run))
        self.assertEqual(run.times(loop="parallel").size, 29)

    def test_a_study_without_a_turn_has_no_times(self):
        def untimed(study):
            study["interrupted"] = True
            for of in study["configurations"]:
                of.update(gpu_ms=None, frame_ms=None, by_base=None, n_turns=0, front="unknown")

        self.edit_json("study/study.json", untimed)
        self.edit("study/times.csv", lambda text: "")
        study = nr.read(self.folder / "study")
        self.assertEqual((study.times["gpu_ms"].size, study.front().size), (0, 0))
        self.assertTrue(np.isnan(study.configurations["gpu_ms"]).all())
        self.assertIn("draw.cutoff=2", str(study))

    def test_pandas_and_charts_are_made_or_named(self):
        run, study = nr.read(self.folder / "run"), nr.read(self.folder / "study")
        os.environ["MPLBACKEND"] = "Agg"
        for module, call in (
            ("pandas", lambda: run.to_pandas("passes")),
            ("matplotlib", run.plot),
            ("matplotlib", study.plot),
        ):
            with mock.patch.dict(sys.modules, {module: None}):
                with self.assertRaisesRegex(ImportError, f"needs {module}: pip install"):
                    call()
            try:
                __import__(module)
            except ImportError:
                continue
            self.assertIsNotNone(call())


CHECK = {
    "verdict": "right", "reason": None, "frame": 7, "n_pixels": 3072,
    "rmse": {"value": 2e-3, "low": 1e-3, "high": 3e-3}, "max": 0.25, "magnitude": 0.5,
    "drawing": {"rms": 1e-5, "bound": 4e-5, "n_shown": 100, "n_beyond": 0, "most_beyond": 1},
    "settings_rms": 1.5e-3, "light": None, "n_second": 0, "is_light_whole": True, "seconds": 0.5,
    "from_cache": False,
}  # fmt: skip


def comparison(schema, **more):
    """Returns the JSON of nimbus compare of two runs."""
    side = {"folder": "one", "date": "2026-01-01T00:00:00Z", "nimbus": "0.1.0",
            "revision": "abc", "device": "a device", "scene_hash": "0" * 64}
    frame = {"measure": "frame", "n_a": 60, "n_b": 50, "a_ms": 8.0, "b_ms": 4.0,
             "b_by_a": {"estimate": 0.5, "low": 0.45, "high": 0.55}, "block_len": 8,
             "verdict": "faster"}
    gpu = {**frame, "measure": "gpu", "n_b": 0, "b_ms": None, "b_by_a": None,
           "verdict": "not_measured_in_b"}
    modes = [{"name": "serial", "measures": [frame, gpu]}]
    return {"schema": schema, "a": side, "b": {**side, "folder": "two"}, "allowed": [],
            "n_resamples": 2000, "headline": "frame", "modes": modes, "remarks": [], **more}


class Errors(InFolder):
    """The error beside the time."""

    def with_check(self, **changes):
        check = {**CHECK, **changes}
        self.edit_json("run/run.json", lambda run: run["cases"][0].update(check=check))
        return nr.read(self.folder / "run")

    def test_the_check_of_a_case_has_columns(self):
        run = self.with_check()
        of = {name: column[0] for name, column in run.cases.items()}
        self.assertEqual((of["verdict"], of["reason"], of["n_pixels"]), ("right", "", 3072.0))
        self.assertEqual((of["rmse"], of["rmse_low"], of["rmse_high"]), (2e-3, 1e-3, 3e-3))
        self.assertEqual((of["max"], of["magnitude"], of["settings_rms"]), (0.25, 0.5, 1.5e-3))
        self.assertEqual((of["drawing_rms"], of["drawing_bound"]), (1e-5, 4e-5))
        self.assertTrue(math.isnan(of["light_rms"]) and math.isnan(of["light_bound"]))
        lines = str(run).splitlines()
        self.assertTrue(all("2.00e-03  1.00e-03 to 3.00e-03" in line for line in lines[-3:]))

    def test_a_wrong_picture_is_told(self):
        run = self.with_check(verdict="wrong", reason="its light differs", rmse=None)
        self.assertTrue(math.isnan(run.cases["rmse"][0]))
        self.assertIn("case 0: the picture is wrong: its light differs", str(run))
        stages = {"n_cases": 9, "failed": ["brdf/lobe"], "seconds": 2.0, "from_cache": False}
        self.edit_json("run/run.json", lambda run: run.update(stages=stages))
        run = nr.read(self.folder / "run")
        self.assertEqual(run.failed_stages, ["brdf/lobe"])
        self.assertIn("stages that failed: brdf/lobe", str(run))

    def test_results_without_a_check_are_read(self):
        def unchecked(run):
            run.pop("stages", None)
            run["cases"][0].pop("check", None)

        self.with_check()
        self.edit_json("run/run.json", unchecked)
        run = nr.read(self.folder / "run")
        self.assertEqual((run.cases["verdict"][0], run.failed_stages), ("not_checked", None))
        self.assertTrue(math.isnan(run.cases["rmse"][0]))

    def test_a_damaged_check_is_refused_with_its_place(self):
        self.with_check()
        self.edit_json("run/run.json", lambda run: run["cases"][0]["check"].update(verdict="fine"))
        self.refused("run", "cases.0.check.verdict`: expected one of right, wrong, not_checked")
        self.edit_json("run/run.json", lambda run: run["cases"][0].update(check={"rmse": 1}))
        self.refused("run", "`cases.0.check` has no key `verdict`")


class Others(InFolder):
    """Comparisons, and what a farm has merged."""

    def write(self, name, value):
        (self.folder / name).write_text(json.dumps(value), encoding="utf-8")
        return self.folder / name

    def test_a_comparison_of_two_runs(self):
        for schema in nr.COMPARISON_SCHEMAS:
            found = nr.read(self.write("compared.json", comparison(schema)))
            of = found.measures
            self.assertEqual(of["measure"].tolist(), ["frame", "gpu"])
            self.assertEqual((of["b_by_a"][0], of["b_by_a_low"][0], of["n_b"][0]), (0.5, 0.45, 50))
            self.assertTrue(math.isnan(of["b_ms"][1]) and math.isnan(of["b_by_a"][1]))
            self.assertEqual((found.errors["a"].size, math.isnan(found.margin)), (0, True))
            self.assertIn("not measured in b", str(found))
            self.assertIn("B  two", str(found))
        errors = [{"name": "dense", "a": 1e-3, "b": 2e-3, "b_by_a": None, "verdict": "larger"}]
        value = comparison(3, margin=0.01, errors=errors)
        value["modes"][0]["measures"][0]["more_frames"] = 12
        found = nr.read(self.write("compared.json", value))
        self.assertEqual((found.margin, found.errors["case"][0]), (0.01, "dense"))
        self.assertEqual(found.measures["more_frames"][0], 12.0)

    def test_other_comparisons_are_refused(self):
        value = comparison(3)
        self.write("a.json", {**value, "matrix": value.pop("modes")})
        self.refused("a.json", "compares more than two runs")
        self.write("b.json", comparison(99))
        self.refused("b.json", "has schema 99, newer than 3")
        self.write("c.json", {"schema": 1, "metrics": {"rmse": 0.0}})
        self.refused("c.json", "compares two pictures")
        value = comparison(2)
        del value["modes"][0]["measures"][0]["verdict"]
        self.write("d.json", value)
        self.refused("d.json", "`modes.0.measures.0` has no key `verdict`")

    def test_a_history(self):
        side = {"folder": "night", "date": "2026-01-01T00:00:00Z", "nimbus": "0.1.0",
                "revision": "abc", "device": "llvmpipe", "scene_hash": "00"}
        figures = [(10.0, 9.9, 10.1, 10.0), (12.0, None, None, 12.0)]
        points = [
            {"run": i, "figure": {"value": value, "low": low, "high": high}, "level": level}
            for i, (value, low, high, level) in enumerate(figures)
        ]
        by = {"estimate": 1.2, "low": 1.1, "high": 1.3}
        change = {"after": 0, "run": 1, "runs": [1, 1], "by": by, "p": 1e-9}
        series = {"quantity": "frame", "unit": "ms", "name": "serial", "points": points,
                  "changes": [change]}
        value = {"schema": 1, "runs": [side, {**side, "folder": "later"}], "order": "date",
                 "remarks": ["run 1: interrupted"], "series": [series], "next": None}
        found = nr.read(self.write("history.json", value))
        self.assertEqual(found.runs["folder"].tolist(), ["night", "later"])
        self.assertEqual(found.points["value"].tolist(), [10.0, 12.0])
        self.assertTrue(found.points["low"][0] == 9.9 and math.isnan(found.points["low"][1]))
        of = found.changes
        self.assertEqual((of["run"][0], of["after"][0], of["by"][0], of["p"][0]), (1, 0, 1.2, 1e-9))
        self.assertEqual((of["by_low"][0], of["by_high"][0], of["run_high"][0]), (1.1, 1.3, 1))
        self.assertTrue("x 1.2" in str(found) and "run 1: interrupted" in str(found), str(found))
        del value["series"][0]["changes"][0]["by"]
        self.write("damaged.json", value)
        self.refused("damaged.json", "`series.0.changes.0` has no key `by`")

    def merged(self, numbers):
        folder = self.folder / "frames"
        folder.mkdir()
        lines = []
        for number in numbers:
            data = b"picture %d" % number
            name = f"frame-{number:08}.png"
            (folder / name).write_bytes(data)
            lines.append(f"{hashlib.sha256(data).hexdigest()}  {name}\n")
        (folder / "frames.sha256").write_text("".join(lines), encoding="utf-8")
        return folder

    def test_merged_frames(self):
        folder = self.merged([11, 8, 9])
        frames = nr.read(folder)
        of = frames.pictures
        self.assertEqual(of["frame"].tolist(), [8, 9, 11])
        self.assertEqual(of["bytes"].tolist(), [9, 9, 10])
        self.assertEqual((of["format"][0], of["file"][2]), ("png", "frame-00000011.png"))
        self.assertEqual((frames.missing, frames.metadata.verified), ([10], True))
        self.assertIn("3 frames, 8 to 11, 28 bytes", str(frames))
        (folder / "frame-00000009.png").write_bytes(b"another")
        self.refused("frames", "frame-00000009.png: has changed since nimbus wrote it")
        self.assertFalse(nr.read(folder, verify=False).metadata.verified)
        (folder / "frame-00000009.png").rename(folder / "away")
        self.refused("frames", "frame-00000009.png: is missing", verify=False)
        (folder / "away").rename(folder / "frame-00000009.png")
        with open(folder / "frames.sha256", "a", encoding="utf-8") as listing:
            listing.write(f"{'0' * 64}  other.txt\n")
        self.refused("frames", "lists other.txt, which is no frame", verify=False)

    def test_counts_of_invocations(self):
        self.assertEqual(nr.read(self.folder / "run").invocations["compute"].size, 0)
        counts = {"compute": 0, "vertex": 24, "fragment": 90, "primitives": 12,
                  "clipped_primitives": 11}
        passes = [{"name": "sprites", **counts}, {**counts, "name": "place", "compute": 64}]
        self.edit_json("run/run.json", lambda run: run["cases"][0].update(invocations=passes))
        found = nr.read(self.folder / "run").invocations
        self.assertEqual(found["name"].tolist(), ["sprites", "place"])
        self.assertEqual((found["compute"].tolist(), found["primitives"][0]), ([0, 64], 12))

    def test_a_merged_bench_has_its_parts(self):
        clocks = json.loads((self.folder / "run/run.json").read_text(encoding="utf-8"))["clocks"]
        part = {"first": 0, "end": 1, "node": "n7", "date": "2026-01-01T00:00:00Z",
                "clocks": clocks, "base": []}
        self.assertEqual(nr.read(self.folder / "run").parts["node"].size, 0)
        self.edit_json("run/run.json", lambda run: run.update(parts=[part]))
        parts = nr.read(self.folder / "run").parts
        self.assertEqual((parts["node"][0], parts["end"][0]), ("n7", 1))


class Damage(InFolder):
    def test_a_missing_path(self):
        self.refused("nothing", "nothing: there is no such file or folder")
        (self.folder / "gone.partial").mkdir()
        self.refused("gone", "gone.partial has those of a run that ended early")
        self.refused("", "it has folders of results in it: name one, such as", "ledger")
        (self.folder / "empty").mkdir()
        self.refused("empty", "holds no run.json", "nimbus bench")
        shutil.copy(self.folder / "run/run.json", self.folder / "study")
        self.refused("study", "several results, run.json, study.json")

    def test_a_missing_file(self):
        for name, options in (("frames.csv", {}), ("frames.csv", {"verify": False}),
                              ("case-0.png", {})):
            with self.subTest(name=name, **options):
                (self.folder / "run" / name).rename(self.folder / "away")
                expected = "cannot be read" if options else "is missing, and run.sha256 lists it"
                self.refused("run", f"{name}: {expected}", **options)
                (self.folder / "away").rename(self.folder / "run" / name)
        (self.folder / "run/case-0.png").unlink()
        self.assertFalse(nr.read(self.folder / "run", verify=False).metadata.verified)
        (self.folder / "run/run.sha256").unlink()
        self.assertFalse(nr.read(self.folder / "run").metadata.verified)

    def test_a_changed_file(self):
        for name in ("run/frames.csv", "run/case-0.png", "study/times.csv", "ledger/ledger.svg"):
            with self.subTest(name=name):
                path = self.folder / name
                data = path.read_bytes()
                path.write_bytes(data[:-20] + b"0" + data[-19:])
                self.refused(name.split("/")[0], f"{name}: has changed", "--no-verify")
                path.write_bytes(data)
        listing = self.folder / "run/run.sha256"
        for text in ("what", f"{'0' * 64}  ../run.json", f"{'0' * 64} run.json", ""):
            listing.write_text(text + "\n", encoding="utf-8")
            self.refused("run", "run.sha256: line 1 is damaged")

    def test_another_schema(self):
        for name, key, new, old in (("run/run.json", "schema", 4, 2),
                                    ("study/study.json", "schema", 2, 0),
                                    ("stress.json", "schema", 99, 0)):
            self.edit_json(name, lambda value: value.update({key: new}))
            self.refused(name, f"has schema {new}, newer than", "of that version")
            self.edit_json(name, lambda value: value.update({key: old}))
            self.refused(name, f"has schema {old} of an older nimbus")
            self.edit_json(name, lambda value: value.pop(key))
            self.refused(name, "no ")

    def test_damaged_json(self):
        for text, expected in (
            ("", "is empty"),
            ('{"schema": 3, "nimb', "cut off"),
            ("[" * 100_000, "nested too deeply"),
            ('{"schema": NaN}', "NaN is no number of JSON"),
            ("[]", "names no schema version"),
            ('{"schema": "3"}', "`schema`: expected an integer from 0 to 2^63 - 1, found text"),
            ('{"schema": 3}', "it has no key `device`"),
        ):
            with self.subTest(text=text[:40]):
                self.edit("run/run.json", lambda _: text)
                self.refused("run", "run.json: ", expected)
        (self.folder / "run/run.json").write_bytes(b'{"schema": \xff}')
        self.refused("run", "byte 11 is not UTF-8")
        (self.folder / "other.json").write_text('{"schema": 1, "a": 2}', encoding="utf-8")
        self.refused("other.json", "is no result of nimbus")
        self.refused("run/case-0.png", "is not UTF-8")

    def test_a_wrong_value_is_named_with_its_place(self):
        def at(value, *keys):
            def change(record):
                for key in keys[:-1]:
                    record = record[key]
                record[keys[-1]] = value
            return change

        mode = ("cases", 0, "modes", 1)
        for change, expected in (
            (at(7, "device", "name"), "`device.name`: expected text, found 7"),
            (at({}, "cases"), "`cases`: expected a list, found an object"),
            (at(None, *mode, "skip"), "`cases.0.modes.1.skip`: expected true or false, found null"),
            (at("1", *mode, "frame_ms", "p50"), "frame_ms.p50`: expected a number or null"),
            (at([], *mode, "gpu_ms"), "`cases.0.modes.1.gpu_ms`: expected an object, found a list"),
            (at(-1, *mode, "frames"), "frames`: expected an integer from 0 to 2^63 - 1, found -1"),
            (at(10**400, *mode, "block_spread"), "block_spread`: expected a finite number"),
            (at(31, *mode, "frames"), "frames.csv: holds 32 timed frames of the loop parallel"),
            (at("gpu", *mode, "threading"), "threading`: expected one of serial, parallel, found"),
            (at(False, *mode, "skip"), "frames.csv: holds 0 timed frames of the loop parallel no-"),
        ):
            original = (self.folder / "run/run.json").read_text(encoding="utf-8")
            with self.subTest(expected=expected):
                self.edit_json("run/run.json", change)
                self.refused("run", expected)
            self.edit("run/run.json", lambda _: original)

    def test_every_cut_of_a_record_is_refused(self):
        for name in ("run/run.json", "study/study.json", "ledger/ledger.json", "stress.json"):
            path = self.folder / name
            text = path.read_text(encoding="utf-8")
            for n in range(0, len(text) - 2, len(text) // 25):
                path.write_text(text[:n], encoding="utf-8")
                self.refused(name, path.name)

    def test_every_missing_or_wrong_key_is_refused_or_read(self):
        """A record with a missing or wrong key is read, or raises ResultsError and nothing else."""
        for name in ("run/run.json", "study/study.json", "ledger/ledger.json", "stress.json"):
            record = json.loads((self.folder / name).read_text(encoding="utf-8"))
            path = self.folder / "printed.json"
            n_refused = 0
            for parent, key in places(record):
                value = parent[key]
                for wrong in (None, "x", [1], {"a": 1}, -1.5, True, remove):
                    if wrong is remove:
                        if isinstance(parent, list):
                            continue
                        del parent[key]
                    else:
                        parent[key] = wrong
                    path.write_text(json.dumps(record), encoding="utf-8")
                    try:
                        str(nr.read(path))
                    except nr.ResultsError:
                        n_refused += 1
                    parent[key] = value
            self.assertGreater(n_refused, 40, name)

    def test_damaged_tables(self):
        frames = (self.folder / "run/frames.csv").read_text(encoding="utf-8")
        header, first = frames.splitlines()[:2]
        for change, expected in (
            (lambda text: "", "is empty; expected the frames.csv of nimbus bench"),
            (lambda text: text.replace("frame_ms", "time"), "has no column frame_ms"),
            (lambda text: text.replace("gpu_sort_ms", "gpu_ms"), "names a column twice"),
            (lambda text: header + "\n", "holds 0 timed frames of the loop serial"),
            (lambda text: text[: len(text) // 2], "fields as in line 1, found"),
            (lambda text: text.replace("\n0,", "\nx,", 1), "line 2: i_row: expected an integer"),
            (lambda text: text.replace(",true,", ",yes,", 1), "line 2: skip: expected true or"),
            (lambda text: text + text.splitlines(True)[-1], "holds 33 timed frames"),
            (lambda text: text.replace(first.split(",")[9], "inf"),
             "line 2: frame_ms: expected a finite number or nothing, found \"inf\""),
            (lambda text: text.replace(",parallel,", ',"parallel,', 1), "cut off"),
            (lambda text: text.replace(first.split(",")[9], "1\x1b[31m"), "\\u{1b}[31m"),
        ):
            with self.subTest(expected=expected):
                self.edit("run/frames.csv", change)
                self.refused("run", "frames.csv: ", expected)
            self.edit("run/frames.csv", lambda _: frames)
        nr.read(self.folder / "run")
        self.edit("study/times.csv", lambda text: text.replace("\n0,0,0,", "\n0,0,99,", 1))
        self.refused("study", "times.csv: names configuration 99, and study.json has 7")
        self.edit("study/times.csv", lambda text: "")
        self.refused("study", "times.csv: is empty")
        self.refused("run/frames.csv", "is one table of a result", "name its folder")
        (self.folder / "a.csv").write_text("x,y\n1,2\n", encoding="utf-8")
        self.refused("a.csv", "has no column name; expected the CSV of nimbus stress")

    def test_what_is_no_regular_file(self):
        os.mkfifo(self.folder / "pipe.json")
        self.refused("pipe.json", "is no regular file")
        self.refused("x" * 5000, "cannot be read")
        self.refused("nul\0", "\\u{0}")


class Program(InFolder):
    def run_program(self, *arguments, **options):
        """Returns exit code, stdout and stderr."""
        done = subprocess.run([sys.executable, os.fspath(TOOL), *arguments],
                              capture_output=True, cwd=self.folder, **options)
        return done.returncode, done.stdout.decode(), done.stderr.decode()

    def test_tables_of_all_kinds(self):
        code, out, errors = self.run_program("run", "study", "ledger", "stress.json")
        self.assertEqual((code, errors), (0, ""))
        for part in ("run: nimbus bench", "serial no-skip", "pass times: drained",
                     "study: nimbus error", "* on the front", "thin sprites", "functions"):
            self.assertIn(part, out)

    def test_json_has_the_tables(self):
        code, out, _ = self.run_program("--json", "run", "study", "ledger", "stress.json")
        self.assertEqual(code, 0)

        def refuse(name):
            self.fail(f"{name} is no JSON")

        results = json.loads(out, parse_constant=refuse)
        kinds = [result["kind"] for result in results]
        self.assertEqual(kinds, ["run", "study", "ledger", "stress"])
        record = json.loads((self.folder / "run/run.json").read_text(encoding="utf-8"))
        first = results[0]["tables"]["loops"][0]
        self.assertEqual(first["frame_ms"], record["cases"][0]["modes"][0]["frame_ms"]["p50"])
        self.assertEqual(len(results[1]["tables"]["configurations"]), 7)
        self.assertIsNone(results[1]["tables"]["configurations"][0]["lighting.grid"])

    def test_bad_input_is_one_line_and_the_rest_is_printed(self):
        (self.folder / "run/frames.csv").write_text("", encoding="utf-8")
        code, out, errors = self.run_program("run", "ledger", "nothing")
        self.assertEqual(code, 2)
        self.assertEqual(len(errors.splitlines()), 2, errors)
        self.assertIn("nimbus_results: run/frames.csv: has changed", errors)
        self.assertTrue(out.startswith("ledger: nimbus ledger"))
        code, _, errors = self.run_program("run", "--no-verify")
        self.assertEqual((code, "is empty" in errors), (2, True))
        self.assertEqual(self.run_program()[0], 2)

    def test_a_name_that_is_not_utf_8(self):
        name = os.fsdecode(b"caf\xe9\x1b")
        (self.folder / "ledger").rename(self.folder / name)
        for locale in ("C", "C.UTF-8"):
            environment = {**os.environ, "LC_ALL": locale}
            code, out, errors = self.run_program(name, "--json", env=environment)
            self.assertEqual((code, errors), (0, ""))
            self.assertEqual(len(json.loads(out)), 1)
            code, out, errors = self.run_program(name, name + "2", env=environment)
            self.assertEqual((code, len(errors.splitlines())), (2, 1))
            self.assertIn("\\u{1b}", out)
            self.assertNotIn("\x1b", out + errors)

    def test_help_teaches(self):
        code, out, _ = self.run_program("--help")
        self.assertEqual(code, 0)
        for part in ("nimbus bench --out", "examples:", "exit codes:", "--no-verify"):
            self.assertIn(part, out)
        self.assertLessEqual(max(map(len, out.splitlines())), 100)

    def test_main_returns_the_exit_code(self):
        with contextlib.redirect_stdout(io.StringIO()) as out:
            self.assertEqual(nr.main([os.fspath(self.folder / "stress.json")]), 0)
        self.assertIn("transmittance", out.getvalue())


def remove():
    """Stands for a key that is taken away."""


def places(value):
    """Yields parent and key of every value below a record, of lists only the first element."""
    keys = list(value) if isinstance(value, dict) else range(min(len(value), 1))
    for key in keys:
        if key == "scene":
            continue
        yield value, key
        if isinstance(value[key], (dict, list)):
            yield from places(value[key])


if __name__ == "__main__":
    unittest.main()
