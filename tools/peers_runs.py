"""Results of tools/peers as runs, a folder for each tool, which `nimbus compare` and `nimbus report`
read. docs/reference/results.md describes the files."""

import csv
import hashlib
import json
import os
import re
import shutil
import subprocess

import nimbus_results

COLUMNS = ["i_row", "phase", "sweep", "threading", "skip", "block", "frame", "time_s", "warm_up",
           "frame_ms", "game_ms", "record_ms", "submit_ms", "wait_ms", "gpu_ms", "latency_ms",
           "queue_depth", "n_drawn", "ran", "image_hash", "end_s", "throttled", "discarded"]
# Steps of a frame that other programs do not tell.
STEPS = ["game_ms", "record_ms", "submit_ms", "wait_ms", "render_ms", "gpu_ms", "latency_ms"]
VARIABLES = ("LP_", "MESA_", "VK_", "GALLIUM_")


def sha256(content):
    return hashlib.sha256(content).hexdigest()


def hash_of(value):
    return sha256(json.dumps(value, sort_keys=True).encode())


def version_of_nimbus(root):
    """Returns the version of the sources, and their revision as results have it."""
    with open(os.path.join(root, "Cargo.toml")) as file:
        version = re.search(r'^version = "(.*)"', file.read(), re.MULTILINE)[1]
    git = ["git", "-C", root]
    try:
        done = subprocess.run([*git, "rev-parse", "--short=12", "HEAD"], capture_output=True,
                              text=True, check=True)
        changed = subprocess.run([*git, "status", "--porcelain", "-uno"], capture_output=True,
                                 text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return version, "unknown"
    return version, done.stdout.strip() + ("-dirty" if changed.stdout.strip() else "")


def processor():
    try:
        with open("/proc/cpuinfo") as file:
            model = re.search(r"^model name\s*: (.*)$", file.read(), re.MULTILINE)
    except OSError:
        model = None
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {"model": model[1].strip() if model else "unknown", "logical_cores": cores}


def measured(values, n_rounds):
    """Returns a summary, with the interval of the median for one round. Frames of a round do not
    tell how starts of a program differ; `nimbus compare` compares the rounds with each other."""
    interval = nimbus_results.median_interval(values) if n_rounds == 1 else None
    ends = [interval.low, interval.high] if interval else [None, None]
    return {**nimbus_results.summary(values), "p50_low": ends[0], "p50_high": ends[1]}


def settings_of(size):
    """Returns what of a case differs from the others, as a point of a sweep."""
    return [{"key": "particles", "value": str(size["n"])},
            {"key": "sigma", "value": f"{size['sigma']:g}"}]


def check_of(view, error):
    """Returns the error as a check without a verdict: a program's own law has no bound. All pixels
    are compared, so that the error has no interval. None where many particles have no error."""
    if error is None:
        return None
    return {
        "verdict": "not_checked",
        "reason": "the picture is compared with the program's own law in f64, which has no bound",
        "frame": 0, "n_pixels": view["width"] * view["height"],
        "rmse": dict.fromkeys(["value", "low", "high"], error["rmse"]), "max": error["max"],
        "magnitude": error["magnitude"], "drawing": None, "settings_rms": None, "light": None,
        "n_second": 0, "is_light_whole": False, "seconds": 0.0, "from_cache": False,
    }


def case_of(size, results, error):
    view, times = size["view"], [ms for result in results for ms in result["frame_ms"]]
    mode = {
        "threading": "serial", "skip": True, "simulate": "cpu", "frames": len(times),
        "warm_up": 1 + view["warm_up"], "blocks": len(results), "frame_ms": measured(times, len(results)),
        "frame_lows": nimbus_results.lows(times), **dict.fromkeys(STEPS), "queue_depth": 0.0,
        "drawn": [float(size["n"])] * 3, "impostors_reused": 0, "passes": [],
        "image_hash": None, "block_spread": None,
    }
    return {
        "phase": None, "sweep": settings_of(size), "scene_hash": size["hash"],
        "particles": size["n"], "width": view["width"], "height": view["height"],
        "modes": [mode], "ratio": None, "overlap": None, "skipping": None, "counts": None,
        "figure": "serial", "check": check_of(view, error),
    }


def write_frames(path, cases):
    """Writes frames.csv: of each start of the program its first frame, which made pipelines, and
    the timed ones. The other frames of the warm-up have no times."""
    i_row = i_block = 0
    with open(path, "w", newline="") as out:
        writer = csv.DictWriter(out, COLUMNS, restval="", lineterminator="\n")
        writer.writeheader()
        for size, results, _ in cases:
            name = ", ".join(f"{s['key']}={s['value']}" for s in settings_of(size))
            for result in results:
                frames = [(True, 0, result["first_ms"])]
                frames += [(False, k, ms) for k, ms in enumerate(result["frame_ms"])]
                for is_first, k, ms in frames:
                    writer.writerow({
                        "i_row": i_row, "sweep": name, "threading": "serial", "skip": "true",
                        "block": i_block, "frame": k, "time_s": k,
                        "warm_up": str(is_first).lower(), "frame_ms": repr(float(ms)),
                        "queue_depth": 0, "n_drawn": size["n"], "discarded": "false",
                    })
                    i_row += 1
                i_block += 1


def run_of(plan, cases, command, date, root):
    """Returns the record of one tool. `plan` is the same for all tools; `cases` has each size that
    the tool drew, with its results and its error."""
    version, revision = version_of_nimbus(root)
    first = cases[0][1][0]
    order = [{"case": i, "threading": "serial", "skip": True, "start": k}
             for i, (_, results, _) in enumerate(cases) for k in range(len(results))]
    record = {
        "schema": 3, "nimbus": version, "revision": revision, "date": date, "command": command,
        "scene_hash": hash_of(plan), "scene": {"peers": plan},
        "device": {"name": first["device"], "driver": "unknown", "api": "unknown", "type": "other",
                   "uuid": "0" * 32},
        "cpu": processor(),
        "environment": {k: v for k, v in sorted(os.environ.items()) if k.startswith(VARIABLES)},
        "clocks": {"resolution_ns": float(first["clock_ns"]), "overhead_ns": 0.0,
                   "timestamp_period_ns": None, "pass_times": "off",
                   "timestamp_overhead_ns": None},
        "block_order": order, "cases": [case_of(*case) for case in cases],
        "interrupted": len(cases) < len(plan["sizes"]),
    }
    if first["tool"] != "nimbus":
        record["tool"] = f"{first['tool']} {first['version']}"
    return record


def write_run(folder, run, cases):
    """Writes run.json, frames.csv and their list; all appear together, in place of earlier ones."""
    new = folder + ".new"
    shutil.rmtree(new, ignore_errors=True)
    os.makedirs(new)
    with open(os.path.join(new, "run.json"), "w") as out:
        json.dump(run, out, indent=2)
        out.write("\n")
    write_frames(os.path.join(new, "frames.csv"), cases)
    with open(os.path.join(new, "run.sha256"), "w") as out:
        for name in ["frames.csv", "run.json"]:
            with open(os.path.join(new, name), "rb") as file:
                out.write(f"{sha256(file.read())}  {name}\n")
    shutil.rmtree(folder, ignore_errors=True)
    os.replace(new, folder)
