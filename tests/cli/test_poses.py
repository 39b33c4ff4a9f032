"""What is said where COLMAP fails: a stand-in for it does, which finds one thing in all photos, or nothing."""
import json
import stat
import sys

import common
import pictures
from common import FolderTest, run

STAND_IN = '''#!{python}
import sqlite3
import struct
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
elif sys.argv[1] == "feature_extractor" and {extracts!r}:
    print({extracts!r})
elif sys.argv[1] == "feature_extractor":
    tables = sqlite3.connect(options["--database_path"])
    keys = struct.pack("4f", 10, 10, 2, 0) * {features}
    for photo, in tables.execute("SELECT image_id FROM images").fetchall():
        tables.execute("INSERT INTO keypoints VALUES (?, ?, 4, ?)", (photo, {features}, keys))
        tables.execute("INSERT INTO descriptors VALUES (?, ?, 128, ?)", (photo, {features}, bytes(128 * {features})))
    tables.commit()
elif sys.argv[1] == "mapper":
    print({says!r})
    sys.exit({status})
'''


class Failures(FolderTest):
    def setUp(self):
        super().setUp()
        self.out = self.dir / "out"
        pictures.photos(self.dir / "photos", 4)
        self.assert_works(run("ingest", self.dir / "photos", "-o", self.out, "--flash-glob", "F_*", "--long-edge", 48))

    def poses(self, says, status, *options, extracts="", features=1):
        path = self.dir / "stand-in"
        path.write_text(STAND_IN.format(python=sys.executable, says=says, status=status, extracts=extracts,
                                        features=features))
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return run("poses", self.out, "--colmap", path, *options)

    def test_mapper_that_fails(self):
        """Is no fault of the photos."""
        for align in "joint", "separate":
            process = self.poses("unrecognised option '--Mapper.max_reg_trials'", 3, "--align", align)
            self.assert_fails(process, 1, "stand-in mapper failed (exit status 3)", "colmap/log.txt")
            self.assertNotIn("has no pose", process.stderr)

    def test_backslash(self):
        """COLMAP takes it for a slash."""
        self.out = self.out.rename(self.dir / "out\\")
        self.assert_fails(self.poses("", 0), 1, self.out, "backslash", "another", "--poses")
        process = run("run", self.dir / "photos", "-o", self.dir / "b\\c/d", "--colmap", self.dir / "stand-in")
        self.assert_fails(process, 1, self.dir / "b\\c/d", "backslash")
        self.assertFalse((self.dir / "b\\c").exists())

    def test_mapper_that_finds_nothing(self):
        process = self.poses("ERROR: failed to create sparse model", 1)
        self.assert_fails(process, 1, "only 0 of 8 photos could be posed", "N_03", "overlap")
        self.assertEqual(process.stderr.count("warning: N_03"), 1, process.stderr)  # that it has few features

    def test_nothing_to_hold_out(self):
        for every in 8, 1000:  # of 4 photos with and 4 without
            self.assert_fails(self.poses("", 0, "--test-every", every), 2, "none of the 8 photos", "2 to 7")
        self.assert_fails(self.poses("", 0, "--test-every", 7), 1, "only 0 of 8 photos could be posed")

    def assert_undone(self, process, *words):
        """So that the next run tries again."""
        self.assert_fails(process, 1, *words)
        self.assertFalse((self.out / "done" / "poses.json").exists())

    def test_database_that_is_cut(self):
        """By a quota or a limit: COLMAP ends well."""
        says = "SQLite error [./src/base/database.cc, line 989]: disk I/O error"
        self.assert_undone(self.poses("", 0, extracts=says), "cannot write its database", "log.txt", "ulimit -f")

    def test_nothing_found(self):
        self.assert_undone(self.poses("", 0, features=0), "nothing to go by in any of the 8 pictures", "well exposed")

    def known(self, step, away=3):
        """Poses of all photos, each so far beside the last one."""
        frames = [{"file_path": f"{kind}_{i:02}.png", "transform_matrix": [
            [1, 0, 0, away + step * i], [0, -1, 0, 5], [0, 0, -1, 0], [0, 0, 0, 1]]} for kind in "FN" for i in range(4)]
        path = self.dir / "transforms.json"
        path.write_text(json.dumps({"w": 48, "h": 32, "fl_x": 50, "frames": frames}))
        return path

    def test_too_few_points(self):
        self.assert_undone(self.poses("", 0, "--poses", self.known(0)), "all 8 photos are at one place")
        self.assert_undone(self.poses("", 0, "--poses", self.known(0.1)), "only 0 points", "1 features or fewer")
        process = self.poses("", 0, "--poses", self.known(0.1), features=60)
        self.assert_undone(process, "only 0 points, at least 20 are needed", "do not fit the photos")

    def test_survey_coordinates(self):
        process = self.poses("", 0, "--poses", self.known(0.1, away=5e5))
        self.assert_undone(process, "transforms.json: the cameras are 5e+05 from the origin", "subtract an offset")
        process = self.poses("", 0, "--poses", self.known(0.1, away=3e3))
        self.assertIn("warning: ", process.stderr)
        self.assertIn("the cameras are 3e+03 from the origin", process.stderr)
        process = self.poses("", 0, "--poses", self.known(0.1))
        self.assertNotIn("from the origin", process.stderr)


common.main()
