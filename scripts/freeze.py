#!/usr/bin/env python3
"""Writes the results of a store as an edition: edition.toml, records.jsonl.gz, and five results in axes/.

    scripts/freeze.py STORE FOLDER

FOLDER names the edition and has its study.toml. The store has the results of that study, made by
`medial compare --study FOLDER/study.toml --out STORE`: of each result its last record counts.
"""

import gzip
import hashlib
import json
import re
import shutil
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Results that are kept as medial meshes, to be measured again by later builds.
KEPT = 5


def constant(name, file):
    return int(re.search(rf"const {name}: u32 = (\d+);", (ROOT / file).read_text()).group(1))


def toml(value):
    """Texts, numbers and lists are written as in JSON."""
    return json.dumps(value, ensure_ascii=False)


def machine(machine):
    memory = f"{machine['memory'] // 1_000_000:,} MB"
    return f"{machine['cpu']}, {machine['cores']} cores, {memory}, {machine['os']}"


if len(sys.argv) != 3:
    sys.exit(__doc__)
store, folder = map(Path, sys.argv[1:])
if (folder / "results.jsonl").exists() or not (folder / "study.toml").is_file():
    sys.exit(f"{folder}: expected the folder of an edition, with its study.toml")
study = tomllib.loads((folder / "study.toml").read_text())

rows = {}
for line in (store / "results.jsonl").read_text().splitlines():
    record = json.loads(line)
    asked = record["simplify"]
    if record.get("conditions", {}).get("fingerprint") or "noise" in study:
        sys.exit(f"{store}: it has noise or plug-ins, which an edition cannot hold")
    key = json.dumps([record["mesh"], asked["method"], asked.get("variant"), asked["params"], asked["level"]])
    rows.pop(key, None)
    rows[key] = record
methods = ["initial"] + [method["id"] for method in study.get("method", [])]
meshes = list(dict.fromkeys(record["mesh"] for record in rows.values()))
place = lambda record: (meshes.index(record["mesh"]), methods.index(record["simplify"]["method"]))
frozen = sorted((r for r in rows.values() if r["simplify"]["method"] in methods), key=place)

# Spread over meshes and methods; with few spheres they are small. Everybody can measure built-in shapes again.
coarsest = {"spheres": min(study["spheres"])}
coarse = [r for r in frozen if r["simplify"]["level"] == coarsest and r.get("artifact")]
coarse = [r for r in coarse if r.get("dataset") == "builtin"] or coarse
count = min(KEPT, len(coarse))
kept = [coarse[k * len(coarse) // count]["artifact"] for k in range(count)]
if any(Path(artifact).is_absolute() or ".." in Path(artifact).parts for artifact in kept):
    sys.exit(f"{store}: a result is not inside the folder")

last = frozen[-1]
native, sources = {}, {}
for record in frozen:
    level = record["simplify"]["level"]
    if "native" in level:
        levels = native.setdefault(record["simplify"].get("variant") or record["simplify"]["method"], [])
        levels += [level["native"]] if level["native"] not in levels else []
    # A built-in shape of another resolution is named box-8.
    builtin = "builtin:" + re.sub(r"-(\d+)$", r":\1", record["mesh"])
    source = builtin if record.get("dataset") == "builtin" else f"dataset:{record['mesh']}"
    sources[record["mesh"]] = (source, record["mesh_hash"])
    for key in ("key", "command", "evaluate_seconds"):
        record.pop(key, None)
    record["repetitions"] = []
    if record.get("artifact") not in kept:
        record.pop("artifact", None)
packed = gzip.compress("".join(json.dumps(record) + "\n" for record in frozen).encode(), mtime=0)
description = {
    "name": folder.resolve().name,
    "metrics": constant("DEFINITIONS", "src/metrics/mod.rs"),
    "version": last["version"],
    "samples": last["conditions"]["samples"],
    "volume_depth": constant("VOLUME_DEPTH", "run/settings.rs"),
    "seed": last["seeds"]["evaluation"],
    "sampling": last["conditions"]["sampling"],
    "dual": last["conditions"]["dual"],
    "spheres": sorted(study["spheres"], reverse=True),
    "max_error": study.get("max_error", []),
    "records": len(frozen),
    "sha256": hashlib.sha256(packed).hexdigest(),
    "machines": sorted({machine(record["machine"]) for record in frozen}),
}
lines = [f"{key} = {toml(value)}" for key, value in description.items()]
lines += ["", "[native]"] + [f"{method} = {toml(native[method])}" for method in sorted(native)]
for name, (source, sha256) in sources.items():
    lines += ["", "[[mesh]]", f"name = {toml(name)}", f"source = {toml(source)}", f"sha256 = {toml(sha256)}"]

contents = {artifact: (store / artifact).read_bytes() for artifact in kept}
shutil.rmtree(folder / "axes", ignore_errors=True)
for artifact, content in contents.items():
    (folder / artifact).parent.mkdir(parents=True, exist_ok=True)
    (folder / artifact).write_bytes(content)
(folder / "records.jsonl.gz").write_bytes(packed)
(folder / "edition.toml").write_text("\n".join(lines) + "\n")
