"""What is said where COLMAP fails: a stand-in for it does, which finds nothing in the photos."""
import stat
import sys

import common
import pictures
from common import FolderTest, run

STAND_IN = '''#!{python}
import sqlite3
import sys
options = dict(zip(sys.argv[2::2], sys.argv[3::2]))
if sys.argv[1] == "database_creator":
    tables = sqlite3.connect(options["--database_path"])
    for name, columns in dict(
            cameras="camera_id, model, width, height, params, prior_focal_length", images="image_id, name, camera_id",
            keypoints="image_id, rows, cols, data", descriptors="image_id, rows, cols, data",
            matches="pair_id, rows, cols, data", two_view_geometries="pair_id, rows").items():
        tables.execute(f"CREATE TABLE {{name}} ({{columns}})")
    tables.commit()
elif sys.argv[2:] == ["-h"]:
    print("--database_path")
elif sys.argv[1] == "mapper":
    print({says!r})
    sys.exit({status})
'''


class Failures(FolderTest):
    def setUp(self):
        super().setUp()
        self.out = self.dir / "out"
        pictures.photos(self.dir / "photos", 4)
        done = run("ingest", self.dir / "photos", "-o", self.out, "--flash-glob", "F_*", "--long-edge", 48)
        self.assertEqual(done.returncode, 0, done.stderr)

    def poses(self, says, status, *options):
        path = self.dir / "stand-in"
        path.write_text(STAND_IN.format(python=sys.executable, says=says, status=status))
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return run("poses", self.out, "--colmap", path, *options)

    def test_mapper_that_fails(self):
        """Is no fault of the photos."""
        for align in "joint", "separate":
            process = self.poses("unrecognised option '--Mapper.max_reg_trials'", 3, "--align", align)
            self.assert_fails(process, 1, "stand-in mapper failed (exit status 3)", "colmap/log.txt")
            self.assertNotIn("has no pose", process.stderr)

    def test_mapper_that_finds_nothing(self):
        process = self.poses("ERROR: failed to create sparse model", 1)
        self.assert_fails(process, 1, "only 0 of 8 photos could be posed", "N_03", "overlap")
        self.assertEqual(process.stderr.count("warning: N_03"), 1, process.stderr)  # that it has few features


common.main()
