#!/usr/bin/python3
"""Protects docs/tutorials: the commands of own_scene.md, taken from the page, make a scene that cuts and bleeds; those of
first_exercise.md score an attempt, those of own_exercise.md make an exercise; the programs of learning.md print what it says; every edit that a page
prints is one that docs/parameters.md lists, within its range.

usage: test_tutorials.py DOCS"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import yaml

DOCS = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(DOCS.parent / ".ci"))
import tutorial_pages  # noqa: E402
SESSION = ("export PATH=", "source build/", "roslaunch ")  # the shell is prepared; a session needs a display


def steps(page):
    """What a reader does: ("file", name, text) and ("command", line), in order."""
    return [step for step in tutorial_pages.steps((DOCS.parent / page).read_text(encoding="utf-8")) if step[0] != "says"]


def follow(page, up_to=None):
    """Does what the page says, to its end or to a command. @return what each command said"""
    said = {}
    with tempfile.TemporaryDirectory() as where:
        for step in steps(page):
            if step[0] == "file":
                pathlib.Path(where, step[1]).write_text(step[2], encoding="utf-8")
            elif step[1].startswith("cd "):
                where = os.path.join(where, step[1][3:])
            elif not step[1].startswith(SESSION):
                done = subprocess.run(["bash", "-c", step[1]], cwd=where, capture_output=True, text=True, timeout=600)
                if done.returncode != 0:
                    raise AssertionError("%s\n%s%s" % (step[1], done.stdout, done.stderr))
                said[step[1]] = done.stdout
            if step[1] == up_to:
                break
    return said


class Learning(unittest.TestCase):
    def test_the_programs_of_the_page_print_what_it_says(self):
        said = follow("docs/tutorials/learning.md")
        self.assertIn("PASSED", said.pop("rosrun vest_bringup vest_exercise run lift_tube --output lift"))
        self.assertEqual(said, {
            "python3 episode.py": "passed True return 1.0\n", "python3 again.py": "same True\n", "python3 look.py": "(265, 6) return 1.0\n",
            "rosrun vest_bringup vest_export lift --to hdf5 --output data_set": "data_set: 1 episode, 266 rows, 2 files\n"})


class OwnScene(unittest.TestCase):
    def test_the_commands_of_the_page_make_a_scene_that_cuts_and_bleeds(self):
        said = follow("docs/tutorials/own_scene.md")
        self.assertGreaterEqual(len(said), 4, "the page has no commands: %s" % said.keys())
        of = lambda word: next(text for command, text in said.items() if word in command)
        for word in (" bake ", " settle "):
            self.assertEqual(of(word).splitlines()[-1], "good", of(word))
        played = of("vest_rehearse")
        for thing in ("vessel", "slab"):
            self.assertRegex(played, r"%s cut|cut.*%s" % (thing, thing))
        self.assertGreater(float(re.search(r"blood: ([\d.]+) ml lost", played)[1]), 0.2, played)
        self.assertIn("worst status 0", played)


class OwnExercise(unittest.TestCase):
    def test_the_exercise_of_the_page_passes_and_fails_as_it_says(self):
        run = "rosrun vest_bringup vest_exercise run exercise.yaml"
        said = follow("docs/tutorials/own_exercise.md", up_to=run + " --script fail")
        self.assertIn("PASSED, total 100.0", said[run])
        self.assertIn("failed by held: The tube was let go.", said[run + " --script fail"])


class FirstExercise(unittest.TestCase):
    def test_the_commands_of_the_page_score_an_attempt_and_keep_it(self):
        said = {}
        with tempfile.TemporaryDirectory() as where:
            own = dict(os.environ, VEST_TRAINEES=os.path.join(where, "trainees.db"))
            report = pathlib.Path(where, "attempt", "report.html")
            for kind, line in (step[:2] for step in steps("docs/tutorials/first_exercise.md")):
                if kind == "command" and not line.startswith(SESSION + ("./run",)):
                    if " erase " in line:
                        page = report.read_text(encoding="utf-8")
                    done = subprocess.run(["bash", "-c", line], cwd=where, env=own, capture_output=True, text=True, timeout=600)
                    self.assertEqual(done.returncode, 0, "%s\n%s%s" % (line, done.stdout, done.stderr))
                    said[line] = done.stdout
            self.assertFalse(report.exists(), "it named the trainee")
        of = lambda word: next(text for command, text in said.items() if word in command)
        self.assertIn("PASSED, total 100.0", of("--output"))
        self.assertIn("kept for anna", of("vest_score"))
        self.assertRegex(of(" show anna"), r"clip_cut_tube  passed, total 100\.0")
        self.assertEqual(of("--script fail").count("NOT FINISHED, total 0.0"), 2)
        self.assertEqual(page.count("data:image/jpeg;base64"), 2)


class Changed(unittest.TestCase):
    """What vest_model says when the page's source is changed, as its readers will."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.source = next(s[2] for s in steps("docs/tutorials/own_scene.md") if s[0] == "file" and s[1] == "source.yaml")

    def model(self, *words):
        return subprocess.run(["rosrun", "vest_tissue", "vest_model", *words], cwd=self.folder.name, capture_output=True, text=True, timeout=600)

    def bake(self, source, *where):
        self.assertNotEqual(source, self.source)
        pathlib.Path(self.folder.name, "mine.yaml").write_text(source, encoding="utf-8")
        return self.model("bake", "mine.yaml", *where)

    def test_objects_that_overlap_are_named_with_what_follows(self):
        done = self.bake(self.source.replace("0.059]", "0.044]"))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"overlap: 0 knots of slab in vessel, \d+ the other way round, deepest 7.5 mm: they do not collide")

    def test_what_nothing_carries_is_told_and_settling_refuses_it(self):
        held = re.sub(r"    (fixed|support):.*\n", "", self.source)
        self.assertEqual(self.bake(held).returncode, 0, "the hollow has a floor")
        done = self.bake(held[:held.index("include:")])
        self.assertEqual(done.returncode, 1)
        self.assertIn("objects slab, vessel fall for ever", done.stdout)
        done = self.model("settle", "slab_and_vessel.yaml")
        self.assertEqual(done.returncode, 1)
        self.assertIn("objects slab, vessel fall for ever", done.stderr)

    def test_a_scene_in_another_folder_has_its_source_whatever_that_is_called(self):
        self.assertEqual(self.bake(self.source + "# mine\n", "deep/out").returncode, 0)
        done = self.model("settle", "deep/out/slab_and_vessel.yaml")
        self.assertEqual(done.returncode, 0, done.stderr)
        out = pathlib.Path(self.folder.name, "deep/out")
        self.assertTrue((out / "mine.yaml").read_text().endswith("# mine\n"))
        self.assertIn("\nsource: mine.yaml\n", (out / "slab_and_vessel.yaml").read_text())

    def test_a_source_is_never_written_over(self):
        done = self.bake(self.source.replace("name: slab_and_vessel", "name: mine"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("mine.yaml: name: mine: its scene file would take the place", done.stderr)
        self.assertIn("objects:", pathlib.Path(self.folder.name, "mine.yaml").read_text())


class Edits(unittest.TestCase):
    def test_each_edit_that_a_page_prints_is_a_listed_one_within_its_range(self):
        rows = {}
        for line in (DOCS / "parameters.md").read_text(encoding="utf-8").splitlines():
            cells = [c.strip(" `") for c in line.split("|")[1:-1]]
            if len(cells) == 7:
                rows[cells[1]] = cells
        found = 0
        for page in [*DOCS.rglob("*.md"), *DOCS.parent.glob("vest_*/README.md")]:
            for edit in re.findall(r'/ParameterEdit "(\{.*?\})"', page.read_text(encoding="utf-8")):
                edit = yaml.safe_load(edit)
                self.assertEqual(sorted(edit), ["object", "parameter", "value"], page)
                self.assertIn(edit["parameter"], rows, page)
                row = rows[edit["parameter"]]
                self.assertEqual(edit["object"] == "", row[0] == '""', "%s: %s" % (page, edit))
                number = lambda text: float(text) if re.fullmatch(r"-?[\d.e-]+", text) else None
                least, greatest = number(row[3]), number(row[4])
                if least is not None and greatest is not None:
                    self.assertTrue(least <= edit["value"] <= greatest, "%s: %s" % (page, edit))
                found += 1
        self.assertGreater(found, 5)


if __name__ == "__main__":
    unittest.main()
