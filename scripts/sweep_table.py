#!/usr/bin/env python3
"""What became of a sweep: methods by outcomes, and everything that is not ok with its reason, as OUT/sweep.md.

    scripts/sweep_table.py OUT MEDIAL

Counts the records of this build of MEDIAL alone. Exit code 1 where one panicked, timed out, ran out of memory or had an
invalid output, or where a method has no record on a mesh.
"""

import collections
import hashlib
import json
import os
import pathlib
import sys

# In the order of the table; of the others, `as_given`, a sweep has none.
OUTCOMES = ["ok", "other_count", "bound_missed", "unsupported", "refused", "failed", "panicked", "timed_out",
            "out_of_memory", "invalid_output"]
WORST = OUTCOMES[6:]


def records(out, build):
    """The last record of each key, of one build."""
    found = {}
    with open(out / "results.jsonl", encoding="utf-8") as lines:
        for line in lines:
            record = json.loads(line)
            if record.get("binary_hash") == build:
                found[record["key"]] = record
    return list(found.values())


def cell(text):
    """A text as a cell of a Markdown table."""
    return " ".join(str(text).split()).replace("|", "\\|").replace("<", "&lt;")


def table(heads, rows):
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return lines + ["| " + " | ".join(map(cell, row)) + " |" for row in rows]


def by_method(all_records, methods):
    rows = []
    for method in methods:
        count = collections.Counter(r["status"] for r in all_records if name(r) == method)
        rows.append([method, *(count[outcome] or "" for outcome in OUTCOMES)])
    return table(["method", *(outcome.replace("_", " ") for outcome in OUTCOMES)], rows)


def name(record):
    simplify = record["simplify"]
    return simplify.get("name") or simplify["method"]


def not_ok(all_records, methods):
    """One line for each mesh, outcome and reason: what refuses a mesh refuses it for every method."""
    alike = collections.defaultdict(list)
    for record in all_records:
        if record["status"] != "ok":
            reason = record.get("reason") or "no reason given"
            alike[(OUTCOMES.index(record["status"]), record["mesh"], reason)].append(name(record))
    rows = []
    for (outcome, mesh, reason), of in sorted(alike.items(), key=lambda kept: (-kept[0][0], kept[0][1:])):
        who = "all methods" if len(set(of)) == len(methods) else ", ".join(sorted(set(of)))
        rows.append([OUTCOMES[outcome].replace("_", " "), mesh, who, reason])
    return table(["outcome", "mesh", "methods", "reason"], rows) if rows else ["Nothing."]


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    out = pathlib.Path(sys.argv[1])
    build = hashlib.sha256(pathlib.Path(sys.argv[2]).read_bytes()).hexdigest()
    all_records = records(out, build)
    methods = sorted({name(record) for record in all_records})
    meshes = sorted({record["mesh"] for record in all_records})
    seen = {(record["mesh"], name(record)) for record in all_records}
    missing = [f"{mesh}, {method}" for mesh in meshes for method in methods if (mesh, method) not in seen]
    worst = [record for record in all_records if record["status"] in WORST]
    verdict = "no panic, time-out, lack of memory or invalid output"
    if worst or missing or not all_records:
        verdict = f"**{len(worst)} results that must not be, {len(missing)} missing**"
    lines = ["# Sweep", "", f"{len(meshes)} meshes, {len(methods)} methods, {len(all_records)} results: {verdict}.", ""]
    lines += by_method(all_records, methods) + ["", "## Everything that is not ok", ""]
    lines += not_ok(all_records, methods)
    if missing:
        lines += ["", "## Without any result", ""] + [f"- {cell(line)}" for line in missing]
    path = out / "sweep.md"
    half = out / ".sweep.md.tmp"
    half.write_text("\n".join(lines) + "\n", encoding="utf-8")
    os.replace(half, path)
    print(f"{len(all_records)} results, {len(worst)} that must not be, {len(missing)} missing; {path}, {out}/index.html")
    return 1 if worst or missing or not all_records else 0


if __name__ == "__main__":
    sys.exit(main())
