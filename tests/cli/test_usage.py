"""Command lines that are wrong, and the help."""
import pathlib
import re
import unittest

import common
from common import FolderTest, run

COMMANDS = ["run", "ingest", "poses", "initialise", "train", "render", "evaluate", "export", "synth", "pair", "info",
            "bench"]


class Help(unittest.TestCase):
    def test_no_arguments(self):
        process = run()
        self.assertEqual(process.returncode, 2)
        self.assertIn("Usage: flashsplat", process.stderr)
        self.assertEqual(process.stdout, "")

    def test_overview_names_every_command(self):
        for word in ("help", "--help", "-h"):
            process = run(word)
            self.assertEqual(process.returncode, 0)
            for command in COMMANDS:
                self.assertRegex(process.stdout, rf"(?m)^  {command}\b")

    def test_help_of_every_command(self):
        for command in COMMANDS:
            process = run(command, "--help")
            self.assertEqual(process.returncode, 0, command)
            self.assertTrue(process.stdout.startswith(f"Usage: flashsplat {command}"), process.stdout)
            self.assertEqual(process.stdout, run("help", command).stdout)
            self.assertNotRegex(process.stdout, r"(?m)^[^ ].*:\n\n")  # a title of nothing
            self.assertEqual(process.stderr, "")

    def test_every_option_has_one_line_with_its_default(self):
        lines = [l for c in COMMANDS for l in run(c, "--help").stdout.splitlines() if l.startswith("  --")]
        self.assertGreater(len(lines), 60)
        for line in lines:
            self.assertRegex(line, r"^  --[a-z-]+( \S+)? +\S.*default: .*\)$")

    def test_default_is_what_the_default_preset_sets(self):
        self.assertRegex(run("train", "--help").stdout, r"--preset .*default: standard")
        paper = next(line for line in run("train", "--help").stdout.splitlines() if line.startswith("  paper "))
        self.assertIn(" --no-dirt", paper)  # as one would type it
        self.assertNotIn(" false", paper)

    def test_run_has_every_option_of_its_stages(self):
        options = {c: set(re.findall(r"(?m)^  (--[a-z-]+)", run(c, "--help").stdout)) for c in COMMANDS}
        for stage in ("ingest", "poses", "initialise", "train", "render", "export"):
            self.assertLessEqual(options[stage], options["run"], stage)

    def test_manual_has_every_option(self):
        manual = run("--man").stdout
        for command in COMMANDS:
            for option in re.findall(r"(?m)^  (--[a-z-]+)", run(command, "--help").stdout):
                self.assertIn("\\fB" + option.replace("-", "\\-"), manual)

    def test_version(self):
        for word in ("version", "--version"):
            self.assertRegex(run(word).stdout, r"^flashsplat \d+\.\d+\.\d+\n$")
            self.assertEqual(run(word, "--help").stdout, run("help").stdout)

    def test_help_of_help(self):
        for words in (["help", "--help"], ["help", "-h"], ["help", "help"], ["--help", "--help"], ["help", "version"]):
            process = run(*words)
            self.assertEqual((process.returncode, process.stdout), (0, run("help").stdout), words)
        for words in (["help", "train", "--help"], ["--help", "train"]):
            self.assertEqual(run(*words).stdout, run("train", "--help").stdout, words)


class Usage(FolderTest):
    def test_unknown_command(self):
        process = run("trian")
        self.assert_fails(process, 2, "'trian'", "did you mean 'train'")
        self.assertNotIn("did you mean", run("xyzzy").stderr)
        self.assert_fails(run("help", "xyzzy"), 2, "'xyzzy'")
        for words in (["help", "train", "foo"], ["version", "foo"], ["--version", "foo"], ["help", "train", "--force"]):
            process = run(*words)
            self.assert_fails(process, 2, words[-1], "too many")
            self.assertEqual(process.stdout, "")

    def test_unknown_option(self):
        self.assert_fails(run("train", self.dir, "--stepz", "3"), 2, "--stepz", "did you mean --steps?")
        self.assert_fails(run("train", self.dir, "--qqqqqqqqqq"), 2, "--qqqqqqqqqq")
        self.assert_fails(run("train", self.dir, "-z"), 2, "-z")

    def test_option_of_another_command(self):
        self.assert_fails(run("train", self.dir, "--photos", "4"), 2, "--photos is not an option of 'train'")
        self.assert_fails(run("info", self.dir, "-o", "x"), 2, "no -o")
        self.assert_fails(run("pair", "a", "b", "-o", "c.png", "--flash-glob", "a"), 2, "not an option of 'pair'")

    def test_missing_value(self):
        self.assert_fails(run("train", self.dir, "--steps"), 2, "--steps needs a value")
        self.assert_fails(run("train", self.dir, "--steps", "--force"), 2, "--steps needs a value")
        self.assert_fails(run("synth", "-o"), 2, "-o needs a name")

    def test_option_without_what_it_is_about(self):
        for words in (["export", "out", "--dataset-of", "photos"], ["run", "photos", "-o", "out", "--originals", "photos"],
                      ["view", "out", "--port", 0], ["evaluate", "out", "truth", "--method-encoding", "srgb"]):
            self.assert_fails(run(*words), 2, next(w for w in words if str(w).startswith("--")), "nothing without")

    def test_wrong_values(self):
        for value in ("0", "-1", "abc", "1.5", "nan", "inf", "1e99", "", "3x", "99999999999999999999"):
            self.assert_fails(run("train", self.dir, f"--steps={value}"), 2, "--steps", "whole number")
        self.assert_fails(run("poses", self.dir, "--test-every", 1), 2, "--test-every", "every photo", "2 to 1000")
        self.assert_fails(run("synth", "-o", "x", "--alpha", "x"), 2, "--alpha", "number")
        self.assert_fails(run("synth", "-o", self.dir / "x", "--field", "shake=x"), 2, "--field", "shake", "'x'")
        self.assert_fails(run("train", self.dir, "--preset", "finest"), 2, "--preset", "preview|standard|best|paper")
        for option, value in (("--layers", "T_N,foo"), ("--formats", "ply,exe"), ("--clean", "gif"), ("--clean", "jpeg,,dng")):
            self.assert_fails(run("run", self.dir, "-o", self.dir / "out", option, value), 2, option, "is not one of")
        for option in ("--layers", "--formats"):
            self.assert_fails(run("run", self.dir, "-o", self.dir / "out", option, ""), 2, option, "empty")
        self.assert_fails(run("render", self.dir, "--path-views", 5), 2, "--path-views does nothing without --video or --path")
        self.assert_fails(run("run", self.dir, "-o", self.dir / "out", "--path", "spiral", "--cameras", "x"), 2,
                          "--path spiral and --cameras", "one of them")
        for cloud in (["--beta", "cloud"], ["--preset", "paper"]):  # before hours of training
            self.assert_fails(run("run", self.dir, "-o", self.dir / "out", "--unmirror", *cloud), 2, "--unmirror", "--beta pane")
        self.assertFalse((self.dir / "out").exists())
        self.assert_fails(run("train", self.dir, "--force=maybe"), 2, "--force", "true or false")
        self.assert_fails(run("train", self.dir, "--no-steps"), 2, "--no-steps")
        self.assert_fails(run("train", self.dir, "--no-bars=1"), 2, "--no-bars", "no value")
        self.assert_fails(run("train", self.dir, "--no-force=true"), 2, "--no-force")

    def test_lists_with_empty_items(self):
        given = {"render OUT --layers": "T_N,R", "export OUT --formats": "ply,spz", "export OUT --clean": "jpeg,dng",
                 "synth -o OUT --hard": "frame,dark", "synth -o OUT --field": "drift=0.1,tint",
                 "evaluate OUT OUT --method": "a=OUT,b=OUT"}
        for words, value in given.items():
            option = words.rsplit(maxsplit=1)[-1]
            for wrong in (value + ",", "," + value, value.replace(",", ",,"), ","):
                process = run(*words.replace("OUT", str(self.dir)).split(), wrong)
                self.assert_fails(process, 2, option)
        self.assertEqual(list(self.dir.iterdir()), [])

    def test_faults_are_told(self):
        """Every fault that synth knows is in its help and in docs/synth.md."""
        process = run("synth", "-o", self.dir / "x", "--field", "fog")
        self.assert_fails(process, 2, "--field", "fog", "known are all, ")
        self.assert_fails(run("synth", "-o", self.dir / "x", "--field", "all=3"), 2, "--field", "no strength")
        self.assert_fails(run("synth", "-o", self.dir / "x", "--field", "drift=0.06" + 99 * "0" + "x"), 2, "drift")
        self.assert_fails(run("synth", "-o", self.dir / "x", "--field", "pedestrian=0.5"), 2, "takes 0 or 1")
        known = process.stderr.split("known are ")[1].splitlines()[0].split()
        words = " ".join(run("synth", "--help").stdout.split())
        told = (pathlib.Path(__file__).parents[2] / "docs" / "synth.md").read_text(encoding="utf-8")
        self.assertGreater(len(known), 14)
        for name in known[1:]:
            self.assertIn(f" {name.strip(',')}", words)
            self.assertIn(f"| `{name.strip(',')}` |", told)

    def test_missing_and_extra_arguments(self):
        for words in (["run"], ["run", "x"], ["ingest", "x"], ["synth"], ["pair", "a", "-o", "b"], ["poses"],
                      ["evaluate", "x"], ["info"], ["run", "-o", "x"]):
            self.assert_fails(run(*words), 2, "missing")
        for words in (["run", "a", "b", "-o", "c"], ["poses", "a", "b"], ["info", "a", "b"], ["bench", "a"],
                      ["poses", "-o", "a", "b"], ["run", "a", "b", "c", "d", "e", "f", "-o", "g"]):
            self.assert_fails(run(*words), 2, "too many")
        self.assert_fails(run("poses", "-o", "a", "-o", "b"), 2, "twice")
        self.assert_fails(run("run", "", "-o", "x"), 2, "empty")

    def test_stage_on_missing_folder(self):
        out = self.dir / "none"
        for command in ("poses", "initialise", "train", "render", "export"):
            self.assert_fails(run(command, out), 1, out, "no such folder")
            self.assertFalse(out.exists())
        self.assert_fails(run("evaluate", out, self.dir), 1, out, "no such folder")
        self.assert_fails(run("train", "-o", out), 1, out, "no such folder")

    def test_words_after_two_dashes_are_arguments(self):
        self.assert_fails(run("train", "--", "--steps"), 1, "--steps: no such folder")


common.main()
