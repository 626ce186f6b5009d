#!/usr/bin/env python3
"""Runs the code cells of a notebook in order, with plain Python, from the folder of the project.

    run_notebook.py NOTEBOOK            compares what each cell prints with the notebook
    run_notebook.py --write NOTEBOOK    writes what each cell prints to the notebook

Ends with exit code 1 at the first cell that fails, or that prints something else.
"""
import contextlib
import difflib
import io
import json
import os
import sys
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def printed_in(cell):
    """Returns the text that the notebook shows below a cell."""
    return "".join("".join(of["text"]) for of in cell["outputs"])


def run(cell, names):
    """Runs a cell in a namespace and returns what it prints on stdout."""
    code = compile("".join(cell["source"]), "cell", "exec")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(code, names)
    return printed.getvalue()


def main():
    arguments = sys.argv[1:]
    is_writing = "--write" in arguments
    (path,) = [Path(argument).resolve() for argument in arguments if argument != "--write"]
    notebook = json.loads(path.read_text(encoding="utf-8"))
    os.chdir(ROOT)
    # Charts are drawn where matplotlib is installed, but shown on no screen.
    os.environ["MPLBACKEND"] = "Agg"
    names, n = {"__name__": "__main__"}, 0
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            continue
        n += 1
        try:
            printed = run(cell, names)
        except Exception:
            print(f"{path.name}: code cell {n} fails:\n{traceback.format_exc()}")
            return 1
        lines = printed.splitlines(keepends=True)
        if is_writing:
            output = {"name": "stdout", "output_type": "stream", "text": lines}
            cell["outputs"] = [output] if lines else []
            cell["execution_count"] = n
        elif printed != printed_in(cell):
            shown = printed_in(cell).splitlines(keepends=True)
            print(f"{path.name}: code cell {n} prints something else (--write accepts it):")
            print("".join(difflib.unified_diff(shown, lines, "notebook", "printed")))
            return 1
    if is_writing:
        text = json.dumps(notebook, indent=1, ensure_ascii=False)
        path.write_text(text + "\n", encoding="utf-8")
    print(f"{path.name}: {n} code cells")
    return 0 if n > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
