"""Known poses that are wrong, and stages whose input is not there."""
import shutil

import common
import pictures
from common import FolderTest, run

FLASH = ["--flash-glob", "F_*"]


class Models(FolderTest):
    """Known poses that are wrong."""

    def setUp(self):
        super().setUp()
        self.out = self.dir / "out"
        self.names = [p.name for p in sorted(pictures.photos(self.dir / "photos", 6).iterdir())]
        self.assertEqual(run("ingest", self.dir / "photos", "-o", self.out, *FLASH).returncode, 0)

    def refuses(self, model, *words):
        process = run("poses", self.out, "--poses", model)
        self.assert_fails(process, 1, *words)
        self.assertFalse((self.out / "done" / "poses.json").exists())

    def test_missing(self):
        self.refuses(self.dir / "none", self.dir / "none")

    def test_damaged(self):
        model = pictures.model(self.dir / "model", self.names)
        for name, text in (("images.txt", "1 1 0 0\n"), ("images.txt", "1 nan 0 0 0 0 0 0 1 F_00.png\n\n"),
                           ("cameras.txt", "1 PINHOLE 99999999999 1 1 1 1 1\n"),
                           ("cameras.txt", "1 PINHOLE 48 32 0 0 0 0\n"),
                           ("cameras.txt", "1 FISH 48 32 0 0 0 0\n")):
            broken = shutil.copytree(model, self.dir / "broken", dirs_exist_ok=True)
            (broken / name).write_text(text)
            self.refuses(broken, broken)

    def test_too_few_photos(self):
        self.refuses(pictures.model(self.dir / "few", self.names[:7]), "N_")

    def test_names_of_other_photos(self):
        self.refuses(pictures.model(self.dir / "other", [f"DSC_{i}.JPG" for i in range(12)]))

    def test_json_that_is_not(self):
        path = self.dir / "transforms.json"
        for text in ("", "{", "[]", '{"frames": 3}', '{"frames": [{}]}', "\x00"):
            path.write_text(text)
            self.refuses(path, path)

    def test_stages_before_their_input(self):
        for command in ("initialise", "train", "render", "export"):
            process = run(command, self.out)
            self.assertEqual(process.returncode, 1, command)
            self.assertIn(str(self.out), process.stderr)


common.main()
