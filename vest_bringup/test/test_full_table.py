#!/usr/bin/env python3
"""Protects the table of full counts: a row stands for a whole count that ran, with its result, and none is lost or made up."""
import os
import subprocess
import sys
import tempfile
import unittest

TABLE, CTEST = sys.argv.pop(1), sys.argv.pop(1)
LIMITER = """-- run_tests.py: execute commands
[==========] Running 2 tests from 1 test suite.
[ RUN      ] Limiter.NoBitPatternGetsThroughOnACartesianDevice
count: 50000000 of 50000000 inputs of raw bits
[       OK ] Limiter.NoBitPatternGetsThroughOnACartesianDevice (61500 ms)
[ RUN      ] Limiter.WhatIsWithinLimitsPassesUnchanged
[       OK ] Limiter.WhatIsWithinLimitsPassesUnchanged (0 ms)
[  PASSED  ] 2 tests."""
RED = """[ RUN      ] Protocol.Noise/frames
count: 10000000 of 10000000 frames
[  FAILED  ] Protocol.Noise/frames, where GetParam() = 3 (2000 ms)
[  FAILED  ] Protocol.Noise/frames
[ RUN      ] Protocol.Dies
count: 7 of 7 lives
Segmentation fault"""
REDUCED = """[ RUN      ] BagWriter.Killed
count: 3 of 200 killed recorders
[       OK ] BagWriter.Killed (3000 ms)"""
MUTANTS = "  1 red      limiter.cpp\ncount: 91 of 91 mutants (mutants.vest_haptics)\nmutants: 91 tried"

UNITTEST = """test_a (__main__.Ros.test_a) ... count: 60 of 60 seconds (Ros.test_a)
ok
test_b (__main__.Ros.test_b) ... count: 5 of 5 rounds (Ros.test_b)
FAIL
FAIL: test_b (__main__.Ros.test_b)
Ran 2 tests in 60.0s"""


class FullTable(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.page = os.path.join(self.folder.name, "full_counts.md")

    def run_ctest(self, tests, *options):
        """Real results: ctest runs `cat` on what the tests said. @return JUnit file, log file"""
        with open(os.path.join(self.folder.name, "CTestTestfile.cmake"), "w", encoding="utf-8") as f:
            for name, (text, code) in tests.items():
                said = os.path.join(self.folder.name, name + ".txt")
                with open(said, "w", encoding="utf-8") as out:
                    out.write(text + "\n")
                f.write(f'add_test([=[{name}]=] "/bin/sh" "-c" "cat {said}; exit {code}")\n')
        junit = os.path.join(self.folder.name, "full.xml")
        subprocess.run([CTEST, "--output-junit", junit, "--test-output-size-passed", "10000000", *options], cwd=self.folder.name,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        return junit, os.path.join(self.folder.name, "Testing", "Temporary", "LastTest.log")

    def table(self, *files):
        done = subprocess.run(["/usr/bin/python3", TABLE, "--page", self.page, *files], capture_output=True, text=True, check=False)
        rows = {}
        if os.path.exists(self.page):
            with open(self.page, encoding="utf-8") as f:
                for line in f:
                    cells = [c.strip() for c in line.strip().strip("|").split("|")]
                    if len(cells) == 7 and cells[0] not in ("promise", "---"):
                        rows[cells[1].strip("`")] = cells
        return done, rows

    def test_a_whole_count_is_a_row_with_promise_result_time_day_and_commit(self):
        junit, _ = self.run_ctest({"limiter": (LIMITER, 0), "mutants": (MUTANTS, 0)})
        done, rows = self.table(junit)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(set(rows), {"Limiter.NoBitPatternGetsThroughOnACartesianDevice", "mutants.vest_haptics"})
        row = rows["Limiter.NoBitPatternGetsThroughOnACartesianDevice"]
        self.assertEqual(row[0], "NaN, infinite or huge force")
        self.assertEqual(row[2:5], ["50,000,000 inputs of raw bits", "passed", "1.0 min"])
        self.assertRegex(row[5], r"^\d{4}-\d\d-\d\d$")
        self.assertRegex(row[6], r"^([0-9a-f]{10}\+?|unknown)$")
        self.assertEqual(rows["mutants.vest_haptics"][0], "each guard is needed")
        self.assertIn("| promise | test |", done.stdout)

    def test_long_output_is_not_cut(self):
        junit, _ = self.run_ctest({"limiter": ("noise\n" * 100000 + LIMITER + "\nnoise" * 100000, 0)})
        self.assertEqual(len(self.table(junit)[1]), 1)

    def test_a_reduced_count_is_never_a_row_and_is_named(self):
        junit, _ = self.run_ctest({"bag": (REDUCED, 0), "limiter": (LIMITER, 0)})
        done, rows = self.table(junit)
        self.assertNotIn("BagWriter.Killed", rows)
        self.assertIn("not in the table: BagWriter.Killed", done.stdout)

    def test_what_failed_or_died_is_red(self):
        junit, _ = self.run_ctest({"protocol": (RED, 1), "mutants": (MUTANTS, 1)})
        done, rows = self.table(junit)
        self.assertEqual(done.returncode, 1)
        self.assertEqual({name: row[3] for name, row in rows.items()},
                         {"Protocol.Noise/frames": "FAILED", "Protocol.Dies": "FAILED", "mutants.vest_haptics": "FAILED"})
        self.assertEqual(rows["Protocol.Noise/frames"][4], "2.0 s")

    def test_of_a_unittest_only_what_failed_is_red(self):
        junit, _ = self.run_ctest({"ros": (UNITTEST, 1)})
        _, rows = self.table(junit)
        self.assertEqual({name: row[3] for name, row in rows.items()}, {"Ros.test_a": "passed", "Ros.test_b": "FAILED"})
        junit, _ = self.run_ctest({"ros": (UNITTEST.split("FAIL\n")[0], 1)})
        _, rows = self.table(junit)
        self.assertEqual(rows["Ros.test_a"][3], "FAILED", "it did not come to its end")

    def test_runs_in_parts_add_up_and_the_newest_of_a_row_counts(self):
        junit, _ = self.run_ctest({"protocol": (RED, 1)})
        self.table(junit)
        junit, _ = self.run_ctest({"limiter": (LIMITER, 0)})
        with open(self.page, encoding="utf-8") as f:
            before = f.read()
        with open(self.page, "w", encoding="utf-8") as f:
            f.write(before.replace(before.split("|")[-3].strip(), "2020-02-02"))
        done, rows = self.table(junit)
        self.assertEqual(done.returncode, 0, "this run is not red")
        self.assertEqual(len(rows), 3)
        self.assertEqual(rows["Protocol.Dies"][3], "FAILED")
        self.assertEqual(rows["Protocol.Dies"][5], "2020-02-02", "as it was seen")
        junit, _ = self.run_ctest({"protocol": (RED.replace("FAILED", "    OK"), 0)})
        done, rows = self.table(junit)
        self.assertEqual(rows["Protocol.Noise/frames"][3], "passed")
        self.assertNotEqual(rows["Protocol.Noise/frames"][5], "2020-02-02")

    def test_an_interrupted_run_counts_as_far_as_it_came(self):
        _, log = self.run_ctest({"limiter": (LIMITER, 0), "protocol": (RED, 1)})
        with open(log, encoding="utf-8") as f:
            text = f.read()
        cut = os.path.join(self.folder.name, "LastTest.log.tmp")
        with open(cut, "w", encoding="utf-8") as f:
            f.write(text[:text.index("Segmentation fault")])
        done, rows = self.table(cut)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(set(rows), {"Limiter.NoBitPatternGetsThroughOnACartesianDevice"})

    def test_the_commit_is_the_one_that_was_given(self):
        junit, _ = self.run_ctest({"limiter": (LIMITER, 0)})
        _, rows = self.table("--commit", "0123456789", junit)
        self.assertEqual([row[6] for row in rows.values()], ["0123456789"])

    def test_a_file_that_is_no_result_is_one_message(self):
        done, _ = self.table(os.path.join(self.folder.name, "nothing.xml"))
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^full_table: .*nothing\.xml: .*\n$")


if __name__ == "__main__":
    unittest.main()
