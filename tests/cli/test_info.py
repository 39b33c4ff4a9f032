"""`flashsplat info`: what it says about files that are right, and about files that are not."""
import json
import pathlib
import struct

import common
from common import FolderTest, run

CAMERAS = "# comment\n1 PINHOLE 600 400 500 510 300 200\n"
IMAGES = "1 1 0 0 0 0 0 0 1 IMG_1.JPG\n\n2 1 0 0 0 1 0 0 1 sub/IMG_2.JPG\n\n"


class Info(FolderTest):
    def write(self, name, content):
        path = self.dir / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def info(self, path):
        process = self.assert_works(run("info", path))
        self.assertEqual(process.stderr, "")
        return process.stdout

    def refuses(self, path, *words):
        self.assert_fails(run("info", path), 1, path, *words)

    def ply(self, count=3, points=3, form="binary_little_endian", extra=""):
        header = f"ply\nformat {form} 1.0\ncomment x\nelement vertex {count}\nproperty float x\n{extra}" \
                 "property uchar red\nend_header\n"
        return header.encode() + struct.pack("<fB", 1.5, 7) * points

    def test_ply(self):
        text = self.info(self.write("a.ply", self.ply()))
        self.assertIn("binary_little_endian", text)
        self.assertIn("3 of vertex: x red", text)

    def test_ply_wrong(self):
        self.refuses(self.write("short.ply", self.ply(points=2)), "cut short")
        self.refuses(self.write("long.ply", self.ply(points=4)), "damaged")
        self.refuses(self.write("absurd.ply", self.ply(count=10**18)), "cut short")
        for count in (-1, "x", "", 10**30):
            self.assertEqual(run("info", self.write("count.ply", self.ply(count=count))).returncode, 1)
        self.refuses(self.write("empty.ply", b""), "not a PLY")
        self.refuses(self.write("png.ply", b"\x89PNG\r\n\x1a\n" + bytes(1000)), "not a PLY")
        self.refuses(self.write("endless.ply", b"ply\n" + b"comment x\n" * 5000), "no end")
        self.refuses(self.write("line.ply", b"ply\n" + b"x" * 5000), "no end")
        self.refuses(self.write("property.ply", b"ply\nproperty float x\nend_header\n"), "before any element")

    def test_colmap(self):
        self.write("model/cameras.txt", CAMERAS)
        self.write("model/images.txt", IMAGES)
        text = self.info(self.dir / "model")
        self.assertIn("model: COLMAP model\n", text)
        self.assertIn("600x400 PINHOLE 500 510 300 200", text)
        self.assertIn("2 views", text)
        self.assertEqual(self.info(self.dir / "model/images.txt"), text)

    def test_colmap_wrong(self):
        self.write("model/cameras.txt", "1 PINHOLE 600 400 500\n")
        self.write("model/images.txt", IMAGES)
        self.refuses(self.dir / "model", "cameras.txt")
        self.write("binary/cameras.bin", struct.pack("<Q", 10**15))
        self.write("binary/images.bin", struct.pack("<Q", 10**15))
        self.refuses(self.dir / "binary")

    def test_transforms(self):
        eye = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        text = self.info(self.write("transforms.json", json.dumps({
            "w": 60, "h": 40, "fl_x": 55, "frames": [{"file_path": "a.png", "transform_matrix": eye}]})))
        self.assertIn("transforms.json: cameras\n", text)
        self.assertIn("camera 60x40 OPENCV 55 55 30 20", text)
        self.assertIn("1 views", text)

    def test_json_wrong(self):
        for text in ("", "{", "[]", "{}", '{"frames": 3}', '{"views": [3]}', "\x00", '{"views": [{"name": "a"}]}'):
            self.assert_fails(run("info", self.write("transforms.json", text)), 1, "transforms.json")

    def test_others(self):
        self.refuses(self.dir / "none", "no such file")
        self.refuses(self.dir, "no photos", "nor is it a project folder")
        self.refuses(self.write("notes.txt", "hello\n"))
        self.refuses(self.write("a.jpg", b"\xff\xd8\xff\xe1\x00"))

    def test_photos(self):
        given = pathlib.Path(__file__).parent.parent / "data/photos"
        for name, text in (("flash.dng", "64x48"), ("linear.dng", "64x48"), ("rgb.jpg", "24x16"), ("rgb8.tif", "24x16"),
                           ("rgb8.png", "24x16"), ("rgb16.tif", "24x16, 3 channels")):
            self.assertIn(text, self.info(given / name))
        head = "{'descr': '<u2', 'fortran_order': False, 'shape': (20, 30, 3), }".ljust(117) + "\n"
        npy = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + bytes(20 * 30 * 3 * 2)
        self.assertIn("30x20", self.info(self.write("a.npy", npy)))
        self.assertIn("1/125 s, ISO 400, f/5.6", self.info(given / "rgb.jpg"))
        for part in 0.6, 0.9:  # its header is whole
            data = (given / "rgb.jpg").read_bytes()
            cut = self.write("cut.jpg", data[:-int((1 - part) * (len(data) - data.rindex(b"\xff\xda")))])
            self.refuses(cut, "Premature end")
            self.assertIn("1/125 s, ISO 400, f/5.6", run("info", cut).stdout)
        self.assertIn("flash: fired", self.info(self.write("a.tif", (given / "rgb.jpg").read_bytes())))
        for name in ("flash.dng", "ambient.dng", "rgb.jpg"):
            self.write("photos/DCIM/" + name, (given / name).read_bytes())
        self.write("photos/DCIM/cut.dng", (given / "flash.dng").read_bytes()[:3000])
        process = run("info", self.dir / "photos")
        self.assertIn("DCIM/rgb.jpg: 24x16, flash, 1/125 s, ISO 400, f/5.6", process.stdout)
        self.assertIn("DCIM/ambient.dng: 64x48, no flash, 1/4 s", process.stdout)
        self.assertIn("4 photos: 2 with flash, 1 without", process.stdout)
        self.assertIn("cut.dng", process.stderr)

    def test_poses_bounds(self):
        head = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 17), }".ljust(117) + "\n"
        rows = [0, 1, 0, 0, 32, 1, 0, 0, 0, 48, 0, 0, -1, 0, 50, 1, 9] * 2
        npy = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + struct.pack("<34d", *rows)
        path = self.write("llff/poses_bounds.npy", npy)
        self.write("llff/images/a.jpg", b"")
        self.write("llff/images/b.jpg", b"")
        self.assertIn("2 views", self.info(path))

    def test_done_is_no_project(self):
        given = pathlib.Path(__file__).parent.parent / "data/photos/flash.dng"
        self.write("photos/a.dng", given.read_bytes())
        self.write("photos/done/notes.txt", "mine")
        self.assertIn("1 photos", self.info(self.dir / "photos"))

    def test_project(self):
        self.write("out/done/ingest.json", "{}")
        self.write("out/linear/a.tif", bytes(1234))
        self.write("out/clouds/R.ply", self.ply())
        text = self.info(self.dir / "out")
        self.assertRegex(text, r"ingest +done +1 files, 1.2 kB")
        self.assertRegex(text, r"poses +not done")
        self.assertRegex(text, r"train +begun")
        self.assertIn("R 3", text)

    def test_project_that_is_broken(self):
        self.write("out/done/ingest.json", "{}")
        self.write("out/views.json", "{")
        self.assert_fails(run("info", self.dir / "out"), 1, "views.json")


common.main()
