#!/usr/bin/env python3
"""Measures planning, looking up and collecting with many items, without running any: the records are made up.

    scripts/scale.py ITEMS [MEDIAL] [FOLDER]

1. A study of ITEMS / 10 small meshes, ten methods, ten counts; `plan`, and `plan --split` for ten times as many items.
2. A record for each level, made from a real one: the done files of all items of both plans but the last.
3. Of both `collect`, twice; `submit --dry-run`, which looks for what is missing.

Prints wall-clock seconds, the largest resident size and the sizes of the files. Needs Python 3 and nothing else.
"""

import hashlib
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

ITEMS = int(sys.argv[1]) if len(sys.argv) > 1 else sys.exit(__doc__)
MEDIAL = os.path.abspath(sys.argv[2]) if len(sys.argv) > 2 else "target/release/medial"
METHODS = ["angle", "lambda", "dey-zhao", "qmat", "pmat", "hem", "sat", "sat-pairwise", "tam-heidrich", "aof"]
COUNTS = [1000, 700, 500, 300, 200, 100, 70, 50, 30, 20]


def measured(name, *words, codes=(0,)):
    """Runs a verb; prints its seconds and its largest resident size."""
    begun = time.monotonic()
    child = subprocess.Popen([MEDIAL, *words, "--json", "--quiet"], stdout=subprocess.PIPE, text=True)
    printed = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    seconds = time.monotonic() - begun
    if os.waitstatus_to_exitcode(status) not in codes:
        sys.exit(f"medial {' '.join(words)}: {os.waitstatus_to_exitcode(status)}: {printed}")
    print(f"{name:28} {seconds:8.2f} s {usage.ru_maxrss / 1000:8.0f} MB", flush=True)
    return json.loads(printed)


def text(value):
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def keys(item):
    """The keys of an item's levels, as bench/run/item.rs makes them."""
    scene, method = item["scene"], item["method"]
    built_in = scene["source"] if "built_in" in scene["source"] else None
    parts = [scene["mesh"], built_in, scene["hash"], None, None, None, scene["sampling"], scene["dual"], scene["measure"]]
    spec = [method["id"], method.get("name"), method["params"], method.get("fingerprint")]
    common = text([parts, spec, item["seed"], item["threads"], item["binary"]])
    return [hashlib.sha256(f"{common}\n{text(level)}".encode()).hexdigest() for level in item["levels"]]


def make_done(plan, template):
    lines = (plan / "items.jsonl").read_text().splitlines()
    for number, line in enumerate(lines[:-1]):
        item = json.loads(line)
        item_keys = keys(item)
        name = hashlib.sha256("\n".join(item_keys).encode()).hexdigest()[:12]
        path = plan / "done" / f"{number // 1000:03}" / f"{number:06}-{name}.jsonl"
        path.parent.mkdir(parents=True, exist_ok=True)
        records = []
        for level, key in zip(item["levels"], item_keys):
            record = json.loads(template)
            record.update(key=key, mesh=item["scene"]["mesh"], mesh_hash=item["scene"]["hash"])
            record["simplify"].update(method=item["method"]["id"], level=level, reached=level["spheres"], spheres=level["spheres"])
            record.pop("artifact", None)
            records.append(text(record) + "\n")
        path.write_text("".join(records))


def size(path):
    return sum(f.stat().st_size for f in ([path] if path.is_file() else path.rglob("*")) if f.is_file()) / 1e6


def main():
    folder = pathlib.Path(sys.argv[3] if len(sys.argv) > 3 else tempfile.mkdtemp(prefix="scale-"))
    meshes = folder / "meshes"
    meshes.mkdir(parents=True, exist_ok=True)
    surface = meshes / "surface.off"
    subprocess.run([MEDIAL, "datasets", "make", "sphere", "--resolution", "8", "-o", surface], check=True, stdout=subprocess.DEVNULL)
    one = surface.read_text()
    surface.unlink()
    for number in range(ITEMS // len(METHODS)):
        (meshes / f"m{number:06}.off").write_text(one + f"# {number}\n")
    names = sorted(f"meshes/{path.name}" for path in meshes.iterdir())
    methods = "".join(f'[[method]]\nid = "{method}"\n' for method in METHODS)
    study = folder / "study.toml"
    study.write_text(f"meshes = {text(names)}\nspheres = {text(COUNTS)}\nsamples = 100\ncounts_only = true\nthreads = 1\n"
                     f"timeout = 60\nmemory = 1000\n{methods}")
    plan, split = folder / "plan", folder / "split"
    planned = measured("plan", "plan", str(study), "-o", str(plan))
    print(f"  {planned['items']} items, {planned['levels']} levels; items.jsonl {size(plan / 'items.jsonl'):.0f} MB, "
          f"plan.json {size(plan / 'plan.json'):.2f} MB")
    by_level = measured("plan --split", "plan", str(study), "-o", str(split), "--split")
    print(f"  {by_level['items']} items; items.jsonl {size(split / 'items.jsonl'):.0f} MB, "
          f"plan.json {size(split / 'plan.json'):.2f} MB")
    measured("run-item (split)", "run-item", str(split), "--number", str(by_level["items"] - 2))
    measured("submit, all missing (split)", "submit", str(split), "--engine", "slurm", "--dry-run")
    measured("run-item, first", "run-item", str(plan), "--number", "0")
    template = next((plan / "done").rglob("*.jsonl")).read_text().splitlines()[0]
    measured("run-item, found", "run-item", str(plan), "--number", "0")
    for what, levels in [(plan, len(COUNTS)), (split, 1)]:
        make_done(what, template)
        print(f"  {what.name}: done {size(what / 'done'):.0f} MB")
        collect = ["collect", str(what), "--no-report"]
        first = measured("collect", *collect, codes=(3,))
        assert (first["missing"], first["added"]) == (1, planned["levels"] - levels), first
        again = measured("collect again", *collect, codes=(3,))
        assert (again["missing"], again["added"]) == (1, 0), again
        measured("submit, one missing", "submit", str(what), "--engine", "slurm", "--dry-run")
        print(f"  results.jsonl {size(what / 'results.jsonl'):.0f} MB")
    print(f"in {folder}")


main()
