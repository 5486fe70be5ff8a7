"""Packages are asked for when they are needed, and every refusal is one sentence."""

from __future__ import annotations

import itertools
import sys
import types
import unittest
from unittest import mock

from PolyPoseSlicer.process import dependencies
from slicer_case import INSIDE_SLICER, REPOSITORY, SlicerTestCase

REQUIREMENTS = REPOSITORY / "PolyPose" / "Resources" / "requirements.txt"


class DependenciesTest(SlicerTestCase):
    def ensure(
        self, torch: bool | list[bool] = True, packaging: object = None, utils: object = None
    ) -> mock.Mock:
        """torch: whether it is installed, each time it is asked."""
        ensure = packaging or mock.Mock()
        import slicer.packaging

        modules = {"PyTorchUtils": utils} if utils is not None else {"PyTorchUtils": None}
        with (
            mock.patch.object(slicer.packaging, "pip_ensure", ensure),
            mock.patch.object(
                dependencies,
                "has_torch",
                side_effect=itertools.cycle([torch]) if isinstance(torch, bool) else torch,
            ),
            mock.patch.dict(sys.modules, modules),
        ):
            dependencies.ensure_dependencies(REQUIREMENTS)
        return ensure

    def test_all_requirements_are_lower_bounds_and_asked_for_once(self) -> None:
        ensure = self.ensure()
        ensure.assert_called_once()
        wanted = [str(each) for each in ensure.call_args.args[0]]
        self.assertEqual(ensure.call_args.kwargs["requester"], "PolyPose")
        self.assertTrue(all(">=" in each and "==" not in each for each in wanted), wanted)
        self.assertFalse(any(each.startswith("torch") for each in wanted))

    def test_the_core_declares_the_same_packages(self) -> None:
        text = (REPOSITORY / "pyproject.toml").read_text()
        for line in REQUIREMENTS.read_text().splitlines():
            if line and not line.startswith("#"):
                self.assertIn(f'"{line}"', text)

    def test_a_refusal_is_one_sentence(self) -> None:
        with self.assertRaisesRegex(dependencies.DependencyError, "not installed .*declined"):
            self.ensure(packaging=mock.Mock(side_effect=RuntimeError("declined")))

    def test_torch_comes_from_the_pytorch_extension(self) -> None:
        with self.assertRaisesRegex(dependencies.DependencyError, "install the extension PyTorch"):
            self.ensure(torch=False)
        logic = mock.Mock()
        utils = types.SimpleNamespace(PyTorchUtilsLogic=lambda: logic)
        testing = mock.patch.object(dependencies, "is_testing", return_value=True)
        with (
            testing,
            self.assertRaisesRegex(dependencies.DependencyError, "nothing is installed while testing"),
        ):
            self.ensure(torch=False, utils=utils)
        with mock.patch.object(dependencies, "is_testing", return_value=False):
            self.ensure(torch=False, utils=utils)
            logic.installTorch.assert_called_once_with(askConfirmation=True, torchVersionRequirement=">=2.2")
            logic.installTorch.return_value = None
            with self.assertRaisesRegex(dependencies.DependencyError, "was not installed"):
                self.ensure(torch=False, utils=utils)
            logic.installTorch.side_effect = RuntimeError("no network")
            with self.assertRaisesRegex(dependencies.DependencyError, "no network"):
                self.ensure(torch=False, utils=utils)
            # Installed, but Slicer's own process could not import it: only the child needs it.
            self.ensure(torch=[False, True], utils=utils)

    @unittest.skipIf(INSIDE_SLICER, "PythonSlicer has no Qt, which Slicer's parameterNodeWrapper imports")
    def test_importing_the_module_imports_no_heavy_package(self) -> None:
        import subprocess

        code = (
            "import sys; sys.path.insert(0, {slicer!r}); import slicer_case; "
            "from PolyPoseSlicer import calls; from PolyPoseSlicer.study import parameters, loading; "
            "from PolyPoseSlicer.process import dependencies; "
            "print([n for n in ('torch', 'matplotlib', 'numba', 'qt' if False else 'scipy.ndimage') "
            "if n in sys.modules])"
        ).format(slicer=str(REPOSITORY / "Testing" / "Slicer"))
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        self.assertEqual(done.stdout.strip().splitlines()[-1:], ["[]"], done.stderr)


if __name__ == "__main__":
    unittest.main()
