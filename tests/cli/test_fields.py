"""Scenes of radiance fields from photos to the page: the same stages, files and bits as of Gaussians."""
import json

import common
from common import FolderTest, run


class Fields(FolderTest):
    def test_flash_nerf(self):
        scene, out = self.dir / "scene", self.dir / "out"
        self.assert_works(run("synth", "-o", scene, "--width", 144, "--height", 96, "--photos", 10,
                              "--held-out", 1, "--seed", 31, "--hard", "picture"))
        share = ["--preset", "flash-nerf", "--steps", 40]
        job = ["run", scene / "capture/raw", "-o", out, "--poses", scene / "truth/sparse", *share, "--long-edge", 96,
               "--progress-every", 40]
        for wrong in ("--separation", "linear"), ("--geometry", "separate"):
            self.assert_fails(run(*job, *wrong), 2, "--model field")
            self.assertFalse(out.exists(), "said before anything is made")
        done = self.assert_works(run(*job, "--threads", 2))
        for name in ("T_N", "T_F", "R", "beta", "I_F", "depth_R"):
            self.assertEqual(len([*(out / "renders" / name).iterdir()]), 10, name)
        self.assertTrue((out / "progress/00040.png").is_file() and (out / "sheet.png").is_file())
        frame = json.loads((out / "clouds/model.json").read_text())["field"]
        middle = frame["near"] / (1 - frame["parts"] * (1 - frame["near"] / frame["far"]))
        self.assertTrue(1.5 < middle < 3.5, f"{middle}: pictures are nearer than 2.2 m, the mirrored room is farther")
        self.assertFalse((out / "report/scene.js").exists(), "a viewer without Gaussians")
        self.assertIn("radiance fields", done.stdout + done.stderr)
        field = (out / "clouds/field.bin").read_bytes()
        train = ["train", out, *share, "--force", "--threads"]
        for more in (1,), (2, "--resume"):  # the second has nothing left to do, from the checkpoint
            self.assert_works(run(*train, *more))
            self.assertEqual((out / "clouds/field.bin").read_bytes(), field, more)
        moments = out / "checkpoint/field_m.bin"
        moments.write_bytes(moments.read_bytes()[:-4])
        self.assert_fails(run(*train, 1, "--resume"), 1, moments)
        self.assertEqual((out / "clouds/field.bin").read_bytes(), field)
        moments.unlink()
        for words in ([*train, 2, "--steps", 120], ["export", out, "--formats", "mesh"]):  # after 40 all is thin
            self.assert_works(run(*words))
        self.assertEqual({p.name for p in (out / "export").iterdir()}, {"T_N.mesh.ply", "T_F.mesh.ply"})


common.main()
