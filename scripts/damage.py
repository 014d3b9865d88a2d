#!/usr/bin/env python3
"""Damages files of every format and runs the verbs that read them: no crash, 10 s, one gigabyte.

    scripts/damage.py MEDIAL [--seconds 60] [--seed 1]

MEDIAL is the program. A run fails when its exit code is not 0 to 5, or when it takes longer than 10 s.
The damaged file and the command of each failure are kept in the folder `damaged`. Exit code 1 if there is any.
"""
import argparse, random, resource, subprocess, sys, tempfile, time
from pathlib import Path

HOSTILE = ("0 -0 -1 1 3 255 2147483648 4294967295 4294967296 1e-320 1e-155 1e-100 1e57 1e155 1e308 inf nan 0.1e").split()
SURFACE = ["info {}", "simplify {} -m qmat --spheres 20 -q -o OUT.ma", "evaluate {} AXIS --samples 200",
           "repair {} -o OUT.off --fill-holes"]
MEDIAL_MESH = ["evaluate builtin:box:8 {} --samples 200", "reconstruct {} -o OUT.ply --tolerance 0.05",
               "convert {} OUT.ply", "simplify builtin:box:8 -m qmat --spheres 9 -q --initial {} -o OUT.ma"]
SECONDS = 10


def limit_memory():
    # A gigabyte, and the address space that threads reserve.
    resource.setrlimit(resource.RLIMIT_AS, (1_600_000_000,) * 2)


def run(program, line, replaced):
    for name, path in replaced.items():
        line = line.replace(name, str(path))
    words = [program, *line.split()]
    try:
        code = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, timeout=SECONDS,
                              preexec_fn=limit_memory).returncode
    except subprocess.TimeoutExpired:
        return words, f"longer than {SECONDS} s"
    return words, None if 0 <= code <= 5 else f"exit code {code}"


def damaged(content, rng):
    for _ in range(rng.randint(1, 3)):
        lines = content.split(b"\n")
        at, words = rng.randrange(len(lines)), content.split(b" ")
        match rng.randrange(7):
            case 0 if content:
                place = rng.randrange(len(content))
                content = content[:place] + bytes([content[place] ^ 1 << rng.randrange(8)]) + content[place + 1:]
            case 1:
                lines[at:at + 1] = [[], [lines[at]] * 2][rng.randrange(2)]
                content = b"\n".join(lines)
            case 2:
                content = b"\n".join(lines[:at])
            case 3 | 4:
                words[rng.randrange(len(words))] = rng.choice(HOSTILE).encode()
                content = b" ".join(words)
            case 5:
                other = rng.randrange(len(lines))
                lines[at], lines[other] = lines[other], lines[at]
                content = b"\n".join(lines)
            case _:
                content = scaled(lines, rng)
    return content


def scaled(lines, rng):
    """One column of coordinates, scaled or rounded to a coarse lattice."""
    column, factor = rng.randrange(4), rng.choice([0.0, 1e-300, 1e-100, 1e-6, 1e6, 1e12, 1e50, 1e150])
    rounded = rng.randrange(3) == 0
    for at, line in enumerate(lines):
        words = line.split(b" ")
        try:
            x = float(words[column]) if b"." in words[column] else None
        except (IndexError, ValueError):
            continue
        if x is not None:
            words[column] = repr(round(4 * x) / 4 if rounded else x * factor).encode()
            lines[at] = b" ".join(words)
    return b"\n".join(lines)


def ascii_stl(off):
    rows = [line.split() for line in off.splitlines()]
    vertices = int(rows[1][0])
    facets = ("facet normal 0 0 0\nouter loop\n"
              + "".join(f"vertex {' '.join(rows[2 + int(v)])}\n" for v in face[1:4]) + "endloop\nendfacet\n"
              for face in rows[2 + vertices:])
    return "solid s\n" + "".join(facets) + "endsolid s\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("medial")
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    rng, runs, failures = random.Random(args.seed), 0, []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        axis = folder / "axis.ma"
        replaced = {"AXIS": axis, "OUT": folder / "out"}
        subprocess.run([args.medial, "axis", "builtin:box:8", "-o", axis], check=True, capture_output=True)
        originals = [(axis, MEDIAL_MESH)]
        for extension in ("off", "obj", "ply"):
            path = folder / f"sphere.{extension}"
            make = [args.medial, "datasets", "make", "sphere", "--resolution", "8", "-o", path]
            subprocess.run(make, check=True, capture_output=True)
            originals.append((path, SURFACE))
        # The program reads STL and does not write it.
        path = folder / "sphere.stl"
        path.write_text(ascii_stl((folder / "sphere.off").read_text()))
        originals.append((path, SURFACE))
        contents = [(path.suffix, path.read_bytes(), lines) for path, lines in originals]
        end = time.monotonic() + args.seconds
        while time.monotonic() < end:
            suffix, content, lines = rng.choice(contents)
            file = folder / f"damaged{suffix}"
            file.write_bytes(damaged(content, rng))
            words, fault = run(args.medial, rng.choice(lines), {"{}": file, **replaced})
            runs += 1
            if fault:
                kept = Path("damaged")
                kept.mkdir(exist_ok=True)
                kept = kept / f"{args.seed}-{runs}{suffix}"
                kept.write_bytes(file.read_bytes())
                failures.append(f"{fault}: {kept}: {' '.join(map(str, words))}")
    print(f"{runs} runs, {len(failures)} failures", *failures, sep="\n")
    return 1 if failures or not runs else 0


if __name__ == "__main__":
    sys.exit(main())
