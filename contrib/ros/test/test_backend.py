"""The backends against a real detector: where the package or the program is installed, else said to be skipped."""

import importlib.util
import pathlib
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from dose3_ros.backend import Package, Program, open_backend  # noqa: E402
from dose3_ros.core import ERROR, OK, Core  # noqa: E402

HAS_PACKAGE = importlib.util.find_spec("dose3") is not None


@unittest.skipUnless(HAS_PACKAGE, "the Python package dose3 is not installed")
class BackendTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        import dose3

        cls.folder = tempfile.TemporaryDirectory()
        cls.path = str(pathlib.Path(cls.folder.name) / "detector.dose3")
        trusted = [dose3.synthetic("vehicle", seed=seed, poses=1500) for seed in range(5)]
        dose3.Detector.fit(trusted, statistics="kinematic,differences", density="mixture:2").save(cls.path)
        cls.log = dose3.synthetic("vehicle", seed=28, poses=1200)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def play(self, backend, jitter):
        core = Core(backend, hold=10.0, silence=1e9)
        columns = (self.log.stamps, self.log.positions, self.log.quaternions)
        for i, (stamp, position, quaternion) in enumerate(zip(*(column.tolist() for column in columns))):
            if jitter and i > 900:
                position = [position[0] + 0.5 * (i * 7 % 5 - 2), *position[1:]]
            core.push(stamp * 1e-9, stamp, position, quaternion)
        core.close()
        core.listen(stamp * 1e-9)
        return core, core.status(stamp * 1e-9)

    def test_the_package_is_taken_where_it_is_and_hears_a_fault(self):
        backend = open_backend(self.path)
        self.assertIsInstance(backend, Package)
        core, status = self.play(backend, jitter=False)
        self.assertEqual(status.level, OK)
        self.assertGreater(core.windows, 20)
        _, status = self.play(open_backend(self.path), jitter=True)
        self.assertEqual(status.level, ERROR)

    @unittest.skipUnless(shutil.which("dose3"), "the program dose3 is not on the path")
    def test_the_program_says_the_same(self):
        by_package, _ = self.play(Package(self.path), jitter=True)
        by_program, status = self.play(Program(self.path), jitter=True)
        self.assertEqual(status.level, ERROR)
        self.assertEqual((by_program.windows, by_program.alarms), (by_package.windows, by_package.alarms))


if __name__ == "__main__":
    unittest.main()
