"""The extension's build: every file is packaged, and what is installed works without the source tree."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

from slicer_case import INSIDE_SLICER, REPOSITORY, SlicerTestCase

STUB = REPOSITORY / "Testing" / "harness" / "cmake"
LOAD_INSTALLED = """
import sys
sys.path.insert(0, {testing!r})
import harness
harness.install()
from harness import modules
modules.load({module!r})
from PolyPoseSlicer.process import environment
print(environment.core_folder())
import subprocess
done = subprocess.run([sys.executable, "-m", "PolyPoseLib", "--version"], env=environment.child_environment())
sys.exit(done.returncode)
"""


@unittest.skipIf(INSIDE_SLICER, "Slicer's own build system packages the extension there")
@unittest.skipIf(shutil.which("cmake") is None, "needs CMake")
class PackagingTest(SlicerTestCase):
    def run_command(self, *command: str, **options) -> str:
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, **options)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def copy_of_the_sources(self) -> Path:
        """What git would have, so that a stray file of ours does not count."""
        target = self.folder / "source"
        ignored = shutil.ignore_patterns("__pycache__", ".git", "*.pyc", "*.egg-info", ".*", "build")
        shutil.copytree(REPOSITORY, target, ignore=ignored)
        return target

    def configure(self, source: Path) -> Path:
        build = self.folder / "build"
        stub = [f"-DSlicer_DIR={STUB}", f"-DPOLYPOSE_PYTHON={sys.executable}"]
        self.run_command("cmake", "-S", str(source), "-B", str(build), *stub)
        return build

    def test_the_entry_of_the_extensions_index_agrees_with_the_build(self) -> None:
        entry = json.loads((REPOSITORY / "Resources" / "ExtensionsIndex" / "PolyPose.json").read_text())
        text = (REPOSITORY / "CMakeLists.txt").read_text()
        given = dict(re.findall(r'set\(EXTENSION_(\w+) "([^"]*)"\)', text))
        self.assertEqual(entry["category"], given["CATEGORY"])
        self.assertEqual(entry["build_dependencies"], given["DEPENDS"].split())
        home = entry["scm_url"].removesuffix(".git")
        self.assertTrue(given["HOMEPAGE"].startswith(home))
        files = home.replace("github.com", "raw.githubusercontent.com") + f"/{entry['scm_revision']}/"
        for field in ("ICONURL", "SCREENSHOTURLS"):
            for address in given[field].split():
                self.assertTrue(address.startswith(files), address)
                self.assertTrue((REPOSITORY / address.removeprefix(files)).is_file(), address)
        # What Slicer's schema of an entry (v1.0.1) requires and allows.
        allowed = {"build_subdirectory", "enabled", "scm_revision", "scm_type", "tier", "build_dependencies"}
        self.assertLessEqual({"$schema", "category", "scm_url"}, entry.keys())
        self.assertLessEqual(entry.keys() - {"$schema", "category", "scm_url"}, allowed)

    def test_what_is_installed_works_alone(self) -> None:
        build = self.configure(self.copy_of_the_sources())
        self.run_command("cmake", "--install", str(build), "--prefix", str(self.folder / "installed"))
        installed = self.folder / "installed" / "lib" / "Slicer" / "qt-scripted-modules"
        packaged = {str(path.relative_to(installed)) for path in installed.rglob("*") if path.is_file()}
        for name in (
            "PolyPose.py",
            "PolyPoseSlicer/process/job.py",
            "Resources/requirements.txt",
            "PolyPoseLib/py.typed",
        ):
            self.assertIn(name, packaged)
        for path in (REPOSITORY / "PolyPoseLib").rglob("*.py"):
            self.assertIn(str(path.relative_to(REPOSITORY)), packaged)
        code = LOAD_INSTALLED.format(
            testing=str(REPOSITORY / "Testing"), module=str(installed / "PolyPose.py")
        )
        variables = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        output = self.run_command(sys.executable, "-c", code, cwd=str(self.folder), env=variables)
        self.assertIn(str(installed), output)
        self.assertIn("PolyPose", output.splitlines()[-1])

    def test_a_file_that_would_not_be_packaged_is_refused(self) -> None:
        source = self.copy_of_the_sources()
        (source / "PolyPose" / "PolyPoseSlicer" / "stray.txt").write_text("not listed")
        with self.assertRaisesRegex(AssertionError, "there but not packaged: PolyPoseSlicer/stray.txt"):
            self.configure(source)

    def test_every_test_is_a_ctest(self) -> None:
        build = self.configure(self.copy_of_the_sources())
        listed = self.run_command("ctest", "-N", cwd=str(build))
        for path in (REPOSITORY / "Testing" / "Slicer").glob("test_*.py"):
            self.assertIn(f"py_{path.stem}\n", listed)
        self.assertIn("py_PolyPose\n", listed)


if __name__ == "__main__":
    unittest.main()
