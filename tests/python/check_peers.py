#!/usr/bin/env python3
"""Checks tools/peers: its laws by hand, what its program for nimbus prints, and that nimbus reads
its results.

    check_peers.py FOLDER

The variable NIMBUS names the nimbus to run. Runs of nimbus and of another program are left in
FOLDER/runs. Ends with exit code 1 at the first difference.
"""
import importlib.machinery
import importlib.util
import json
import math
import os
import subprocess
import sys

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def load(path):
    sys.path.insert(0, os.path.dirname(path))
    loader = importlib.machinery.SourceFileLoader("peers", path)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("peers", loader))
    loader.exec_module(module)
    return module


def expect(what, found, expected, bound):
    print(f"{what}: {found:.9g}, by hand {expected:.9g}")
    if abs(found - expected) > bound:
        sys.exit(f"{what} differs by more than {bound}")


def projected(place, focal):
    return np.array([place[0], place[1]]) * focal / (12.0 - place[2])


def check_splat(peers, focal, law, blur):
    """Compares one ball off the axis with the derivative of the projection, by differences."""
    place, sigma, opacity = np.array([1.2, 0.5, -0.7]), 0.03, 0.2
    rows = np.array([[*place, sigma, opacity, 1, 0, 0]])
    seen = peers.drawn_in_f64(np, rows, law)[:, :, 0]
    step = 1e-5
    columns = [(projected(place + step * e, focal) - projected(place - step * e, focal))
               / (2 * step) for e in np.eye(3)]
    jacobian = np.stack(columns, axis=1)
    image = sigma**2 * jacobian @ jacobian.T
    wide = image + blur * np.eye(2)
    fade = math.sqrt(np.linalg.det(image) / np.linalg.det(wide))
    center = projected(place, focal)
    for i, j in [(468, 272), (470, 270)]:
        off = np.array([i + 0.5 - 400, 300 - j - 0.5]) - center
        by_hand = opacity * fade * math.exp(-0.5 * off @ np.linalg.inv(wide) @ off)
        if by_hand < 1e-3:
            sys.exit(f"the pixel ({i}, {j}) shows nothing of the ball")
        expect(f"{law} at ({i}, {j})", seen[j, i], by_hand, 1e-9)


def nimbus(*arguments):
    done = subprocess.run([os.environ["NIMBUS"], *arguments], capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def check_runs(folder, job, result):
    """Compares a run of nimbus with that of a program that takes twice its time."""
    runs = load(os.path.join(ROOT, "tools", "peers_runs.py"))
    plan = {"sizes": [[3, 0.1]], "frames": 4, "rounds": 12}
    size = {"n": 3, "sigma": 0.1, "view": job, "hash": runs.sha256(b"the same particles")}
    other = {**result, "tool": "other", "version": "1.2", "device": "another device",
             "frame_ms": [2.0 * ms for ms in result["frame_ms"]]}
    for name, of, rmse in [("nimbus", result, 1e-4), ("other", other, 3e-4)]:
        cases = [(size, [of] * plan["rounds"], {"rmse": rmse, "max": 0.1, "magnitude": 0.5})]
        run = runs.run_of(plan, cases, ["tools/peers"], "2026-01-02T03:04:05Z", ROOT)
        runs.write_run(os.path.join(folder, "runs", name), run, cases)
    a, b = (os.path.join(folder, "runs", name) for name in ["nimbus", "other"])
    code, _, errors = nimbus("compare", a, b)
    if code != 2 or "program: A nimbus, B other 1.2" not in errors:
        sys.exit(f"runs of two programs were compared without a word: {code} {errors}")
    code, text, errors = nimbus("compare", a, b, "--allow", "device,build", "--json")
    if code != 0:
        sys.exit(f"compare failed: {errors}")
    found = json.loads(text)
    if found["b"]["program"] != "other 1.2" or not found["a"]["program"].startswith("nimbus "):
        sys.exit(f"compare names the programs {found['a']} and {found['b']}")
    frame = next(m for m in found["modes"][0]["measures"] if m["measure"] == "frame")
    expect("twice the time", frame["b_by_a"]["estimate"], 2.0, 1e-12)
    page = os.path.join(folder, "page.html")
    code, _, errors = nimbus("report", b, "-o", page)
    if code != 0:
        sys.exit(f"report failed: {errors}")
    with open(page) as file:
        if "<dt>Drawn by</dt><dd>other 1.2</dd>" not in file.read():
            sys.exit("the page does not say who drew")


def main():
    peers = load(os.path.join(ROOT, "tools", "peers"))
    focal = 0.5 * peers.HEIGHT / math.tan(math.radians(0.5 * peers.FOV_Y_DEG))
    # A red ball before a green one, both about the view's axis, 12 and 13 from the eye.
    rows = np.array([[0, 0, 0, 0.5, 0.1, 1, 0, 0], [0, 0, -1, 0.5, 0.2, 0, 1, 0]], float)
    # The pixel right of the middle and above it, and one that is 40 further to the right.
    for column, dx in [(400, 0.5), (440, 40.5)]:
        seen = peers.drawn_in_f64(np, rows, "opacity")[299, column]
        r2 = (dx**2 + 0.25) / focal**2
        red = 0.1 * math.exp(-0.5 * r2 * (12 / 0.5) ** 2)
        green = 0.2 * math.exp(-0.5 * r2 * (13 / 0.5) ** 2)
        expect(f"opacity, red at {column}", seen[0], red, 1e-12)
        expect(f"opacity, green at {column}", seen[1], green * (1 - red), 1e-12)
        seen = peers.drawn_in_f64(np, rows, "depth")[299, column]
        # The ray passes a centre on the axis at sin(angle) times its distance.
        sine2 = r2 / (1 + r2)
        red = 1 - 0.9 ** math.exp(-0.5 * sine2 * (12 / 0.5) ** 2)
        green = 1 - 0.8 ** math.exp(-0.5 * sine2 * (13 / 0.5) ** 2)
        expect(f"depth, red at {column}", seen[0], red, 1e-12)
        expect(f"depth, green at {column}", seen[1], green * (1 - red), 1e-12)
    check_splat(peers, focal, "splat", 0.3)
    check_splat(peers, focal, "projected", 0.0)
    few, many = peers.particles(np, 3, 0.1), peers.particles(np, 9, 0.1)
    if not (few == many[:3]).all() or many.dtype != np.dtype("<f4"):
        sys.exit("fewer particles are not the first of more")
    folder = sys.argv[1]
    few.tofile(os.path.join(folder, "particles.f32"))
    job = {
        "particles": os.path.join(folder, "particles.f32"), "n": 3, "width": 64, "height": 48,
        "fov_y_deg": 45.0, "eyes": peers.eyes(4), "target": [0.0, 0.0, 0.0], "warm_up": 1,
        "picture": os.path.join(folder, "nimbus"), "folder": folder,
    }
    with open(os.path.join(folder, "job.json"), "w") as out:
        json.dump(job, out)
    result, why = peers.run(peers.tools()["nimbus"], os.path.join(folder, "job.json"))
    if result is None:
        sys.exit(f"nimbus did not draw: {why}")
    if len(result["frame_ms"]) != 4 or not all(ms > 0 for ms in result["frame_ms"]):
        sys.exit(f"expected the times of four frames, found {result}")
    with open(result["picture"], "rb") as picture:
        if picture.read(4) != b"\x76\x2f\x31\x01":
            sys.exit("the picture is no EXR file")
    check_runs(folder, job, result)
    broken = subprocess.run([peers.tools()["nimbus"], "run", "/nonexistent"], capture_output=True)
    if broken.returncode == 0:
        sys.exit("a job that is missing was drawn")
    print("peers: all as expected")


main()
