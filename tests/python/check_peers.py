#!/usr/bin/env python3
"""Checks tools/peers: its laws by hand, and what its program for nimbus prints.

    check_peers.py FOLDER

The variable NIMBUS names the nimbus to run. Ends with exit code 1 at the first difference.
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
    loader = importlib.machinery.SourceFileLoader("peers", path)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("peers", loader))
    loader.exec_module(module)
    return module


def expect(what, found, expected, bound):
    print(f"{what}: {found:.9g}, by hand {expected:.9g}")
    if abs(found - expected) > bound:
        sys.exit(f"{what} differs by more than {bound}")


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
    broken = subprocess.run([peers.tools()["nimbus"], "run", "/nonexistent"], capture_output=True)
    if broken.returncode == 0:
        sys.exit("a job that is missing was drawn")
    print("peers: all as expected")


main()
