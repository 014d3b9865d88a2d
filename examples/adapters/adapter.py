"""Runs a program of another paper as a method: see docs/adapters.md.

    python3 adapter.py mattopo|matstruct|matfp SURFACE OUTPUT [--spheres N] [--native X] [--kind organic|cad]

These programs take tetrahedra or a format of their own, write into folders of their own, and some stay open in a window when
they are done. So: the input is converted, the program is started, and the first medial mesh that it has finished writing is
taken; then it is ended. Environment variables name the inputs:

    MATTOPO, MATSTRUCT, MATFP    the program
    MATFP_PRE                    the program that prepares its input
    FTETWILD                     fTetWild, which fills a surface with tetrahedra (for MATTopo and MATStruct)

Exit code 65: the program is not there, or did not do the task.
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import time

# A file that has not grown for this number of seconds is complete.
SETTLED = 3.0


def refuse(why):
    print(why, file=sys.stderr)
    sys.exit(65)


def program(variable):
    path = os.environ.get(variable)
    if not path:
        refuse(f"set the variable {variable} to the program: docs/adapters.md")
    path = pathlib.Path(path).resolve()
    if not os.access(path, os.X_OK):
        refuse(f"{variable}: {path} is not an executable program")
    return path


def results(folders):
    """The medial meshes in some folders, by path, with size and time of the last change."""
    found = {}
    for folder in folders:
        for path in folder.rglob("*.ma"):
            # MATTopo and MATStruct write surfaces under this name, with radii of 0.
            if not path.stem.endswith("_extf"):
                status = path.stat()
                found[path] = (status.st_size, status.st_mtime_ns)
    return found


def first_result(command, folder, watched):
    """Runs a program until it ends, or has finished a medial mesh in one of the folders watched."""
    before = results(watched)
    running = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=sys.stderr)
    state, since = {}, time.monotonic()
    try:
        while True:
            ended = running.poll() is not None
            new = {path: seen for path, seen in results(watched).items() if before.get(path) != seen}
            if new != state:
                state, since = new, time.monotonic()
            if new and (ended or time.monotonic() - since >= SETTLED):
                # The last one: some write what they have before they improve it.
                return max(new, key=lambda path: new[path][1])
            if ended:
                sys.exit(f"{command[0]} ended with exit code {running.returncode} and wrote no medial mesh")
            time.sleep(0.2)
    finally:
        running.terminate()
        try:
            running.wait(5)
        except subprocess.TimeoutExpired:
            running.kill()


def tetrahedra(surface, work):
    """Fills a surface with tetrahedra."""
    mesh = work / "solid.msh"
    command = [program("FTETWILD"), "-i", surface, "-o", mesh]
    done = subprocess.run(command, cwd=work, stdout=sys.stderr, check=False)
    if done.returncode != 0 or not mesh.exists():
        sys.exit(f"fTetWild ended with exit code {done.returncode}")
    return mesh


def mattopo(arguments, work):
    binary = program("MATTOPO")
    command = [binary, tetrahedra(arguments.surface, work), arguments.spheres]
    command += ["non_cad"] if arguments.kind == "organic" else []
    # It writes to ../out/mat, seen from where it runs.
    folder = work / "build"
    folder.mkdir()
    (work / "out" / "mat").mkdir(parents=True)
    return first_result(command, folder, [work, binary.parent.parent / "out"])


def matstruct(arguments, work):
    out = work / "out"
    out.mkdir()
    command = [program("MATSTRUCT"), "-i", tetrahedra(arguments.surface, work), "-d", out]
    command += ["-o"] if arguments.kind == "organic" else []
    command += ["-p", str(round(float(arguments.native)))] if arguments.native else []
    return first_result(command, work, [out])


def matfp(arguments, work):
    prepare, binary = program("MATFP_PRE"), program("MATFP")
    folder = work / "build"
    folder.mkdir()
    (work / "input" / "mesh").mkdir(parents=True)
    # It shows what it prepared in a window, which has to be closed.
    subprocess.run([prepare, arguments.surface, "--save=1"], cwd=folder, stdout=sys.stderr, check=False)
    prepared = list((work / "input").rglob("*.geogram"))
    if not prepared:
        sys.exit("MATFP_PRE wrote no .geogram file")
    command = [binary, prepared[0], f"--ds={arguments.native or 0.1}"]
    # It waits in its window: press the buttons that compute and export.
    return first_result(command, folder, [work])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", choices=["mattopo", "matstruct", "matfp"])
    parser.add_argument("surface", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--spheres", default="")
    parser.add_argument("--native", default="")
    parser.add_argument("--kind", choices=["organic", "cad"], default="organic")
    arguments = parser.parse_args()
    work = arguments.output.parent / "work"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    run = {"mattopo": mattopo, "matstruct": matstruct, "matfp": matfp}[arguments.program]
    shutil.copyfile(run(arguments, work), arguments.output)


main()
