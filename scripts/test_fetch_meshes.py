#!/usr/bin/env python3
"""Tests of fetch_meshes.py with scripts in place of the clients: python3 scripts/test_fetch_meshes.py"""

import hashlib
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).with_name("fetch_meshes.py")

# The meshes of the catalogue: name, set, package, path in it.
MESHES = [
    ("ball", "public", "deb:balls", "share/data.tar.gz!data/ball.off"),
    ("rod-thin", "public", "deb:balls", "share/data.tar.gz!data/rod.off"),
    ("ring", "public", "npm:ring", "package/ring.off"),
    ("cap", "papers", "file:paper", "cap.off"),
]


def content(name):
    return f"OFF\n# {name}\n0 0 0\n".encode()


def tar_gz(files):
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz") as archive:
        for path, data in files.items():
            member = tarfile.TarInfo(path)
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))
    return out.getvalue()


def balls(rod=content("rod-thin")):
    """An archive in an archive, as Debian packages have them."""
    inner = tar_gz({"data/ball.off": content("ball"), "data/rod.off": rod})
    return tar_gz({"./share/data.tar.gz": inner})


class Fetching(unittest.TestCase):
    """A machine whose only programs are its clients, which log their arguments."""

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "bin").mkdir()
        packages = [("deb:balls", "1.0"), ("npm:ring", "1.0"), ("file:paper", "")]
        text = "".join(f"[[package]]\nid = '{id}'\nversion = '{version}'\n"
                       for id, version in packages)
        for name, of, package, path in MESHES:
            digest = hashlib.sha256(content(name)).hexdigest()
            text += (f"[[mesh]]\nname = '{name}'\nset = '{of}'\npackage = '{package}'\n"
                     f"path = '{path}'\nsha256 = '{digest}'\n")
        (self.folder / "catalogue.toml").write_text(text)
        self.archive("balls.tgz", balls())
        self.archive("ring.tgz", tar_gz({"package/ring.off": content("ring")}))
        self.delivers("apt-get", "balls.tgz")
        self.delivers("npm", "ring.tgz")

    def archive(self, name, data):
        (self.folder / name).write_bytes(data)

    def client(self, name, then):
        path = self.folder / "bin" / name
        log = self.folder / "log"
        path.write_text(f'#!/bin/sh\necho "{name} $*" >> "{log}"\n{then}\n')
        path.chmod(0o755)

    def delivers(self, client, archive):
        self.client(client, f'exec /bin/cp "{self.folder / archive}" .')

    def log(self):
        """The command lines of the clients since the last call."""
        path = self.folder / "log"
        lines = path.read_text().splitlines() if path.exists() else []
        path.unlink(missing_ok=True)
        return lines

    def run_script(self, *arguments):
        environment = {**os.environ, "PATH": str(self.folder / "bin")}
        done = subprocess.run(
            [sys.executable, SCRIPT, "--cache", self.folder / "cache", "--json",
             "--catalogue", self.folder / "catalogue.toml", *arguments],
            cwd=self.folder, env=environment, capture_output=True, text=True)
        report = json.loads(done.stdout) if done.returncode in (0, 3) else None
        return done.returncode, report, done.stderr

    def cached(self, name):
        path = self.folder / "cache/meshes" / name
        return path.read_bytes() if path.exists() else None

    def test_fetched_meshes_are_not_fetched_again(self):
        code, report, errors = self.run_script("public")
        self.assertEqual((code, report["verified"], report["wanted"]), (0, 3, 3), errors)
        self.assertEqual(self.cached("rod-thin.off"), content("rod-thin"))
        first, second = self.log()
        self.assertTrue("download" in first and first.endswith("balls=1.0"), first)
        self.assertTrue("--ignore-scripts" in second and second.endswith("ring@1.0"), second)
        self.assertEqual(self.run_script("public")[1]["fetched"], [])
        self.assertEqual(self.log(), [])
        # Only damaged and missing files are fetched again.
        (self.folder / "cache/meshes/ball.off").write_text("OFF\n")
        self.assertEqual(self.run_script("ball")[1]["fetched"], ["ball"])
        self.assertEqual(len(self.log()), 1)

    def test_an_interrupted_fetch_resumes(self):
        # Only the client that never ends is run under the short limit.
        self.assertEqual(self.run_script("deb:balls")[0], 0)
        self.client("npm", "exec /bin/sleep 1000")
        code, report, errors = self.run_script("--timeout", "1")
        self.assertEqual((code, report["verified"], report["missing"]), (3, 2, ["ring"]))
        self.assertIn("took more than 1 s", errors)
        self.delivers("npm", "ring.tgz")
        self.log()
        self.assertEqual(self.run_script()[0], 0)
        line, = self.log()
        self.assertTrue(line.startswith("npm"), line)

    def test_another_content_is_refused_by_name(self):
        self.archive("ring.tgz", tar_gz({"package/ring.off": b"OFF\n0 0 0\n"}))
        code, report, errors = self.run_script()
        self.assertEqual((code, report["missing"]), (3, ["ring"]))
        self.assertIn("ring: package/ring.off of ring.tgz has another content", errors)
        self.assertIsNone(self.cached("ring.off"))
        self.assertEqual(self.cached("ball.off"), content("ball"))

    def test_a_missing_client_is_reported_once_and_the_rest_continues(self):
        (self.folder / "bin/apt-get").unlink()
        code, _, errors = self.run_script()
        self.assertEqual((code, errors.count("apt-get is not installed")), (3, 1), errors)
        self.assertIsNotNone(self.cached("ring.off"))
        self.client("apt-get", "echo no such package >&2; exit 100")
        self.assertIn("no such package", self.run_script()[2])

    def test_identical_meshes_of_another_version_are_accepted(self):
        self.archive("balls.tgz", balls(rod=b"OFF\n0 0 0\n"))
        path = self.folder / "balls.tgz"
        self.client("apt-get", f'case "$*" in *=1.0) exit 100;; esac; /bin/cp "{path}" .')
        code, report, errors = self.run_script()
        self.assertEqual((code, report["missing"]), (3, ["rod-thin"]), errors)
        self.assertIn("identical meshes from another version", errors)
        self.assertIn("rod-thin: share/data.tar.gz!data/rod.off of", errors)
        self.assertEqual(self.cached("ball.off"), content("ball"))

    def test_nothing_leaves_the_cache_and_broken_archives_are_refused(self):
        outside = tar_gz({"../../ring.off": b"x", "package/ring.off": content("ring")})
        self.archive("ring.tgz", outside)
        self.assertEqual(self.run_script()[0], 0)
        self.assertEqual([path.name for path in (self.folder / "cache").iterdir()], ["meshes"])
        self.assertFalse((self.folder / "ring.off").exists())
        for name, data in [("cut.tgz", outside[:40]), ("text.tar", b"no"), ("text.whl", b"no")]:
            self.archive(name, data)
            code, _, errors = self.run_script("--from", name)
            self.assertEqual(code, 1)
            self.assertIn(f"{name}: ", errors)

    def test_an_archive_of_the_users_needs_no_client(self):
        self.archive("mine.tgz", balls())
        shutil.rmtree(self.folder / "bin")
        code, report, _ = self.run_script("deb:balls", "--from", "mine.tgz")
        self.assertEqual((code, report["verified"]), (0, 2))
        self.archive("other.tgz", tar_gz({"a.off": b"OFF"}))
        code, _, errors = self.run_script("--from", "other.tgz")
        self.assertEqual(code, 1)
        self.assertIn("no mesh of the catalogue", errors)


if __name__ == "__main__":
    unittest.main()
