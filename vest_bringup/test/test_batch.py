#!/usr/bin/env python3
"""Protects vest_batch: results survive a kill and are never done twice, the table has the same bytes for any order and back end, a result that
changes is a conflict, mistakes are one line. With VEST_FULL and Slurm installed: two nodes on this machine, one killed in the middle."""
import csv
import io
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

BATCH = os.path.abspath(sys.argv.pop(1))
FULL = "VEST_FULL" in os.environ
# A run: its result follows from its parameters; it counts how often it was begun.
RUN = ("import json,sys,time; a,b,log,wait=int(sys.argv[1]),sys.argv[2],sys.argv[3],float(sys.argv[4]); open(log,'a').write('%d%s\\n'%(a,b)); "
       "time.sleep(wait); print(json.dumps({'sum':a*10+len(b),'text':b}))")


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.log = self.path("begun")

    def path(self, name):
        return os.path.join(self.folder, name)

    def batch(self, *arguments, code=0):
        done = subprocess.run([BATCH, *arguments], capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        if code == 2:
            self.assertEqual((done.stderr.count("\n"), done.stderr.startswith("vest_batch: ")), (1, True), done.stderr)
        return done.stdout if code != 2 else done.stderr

    def manifest(self, wait=0.0, count=4, name="batch.json", **more):
        manifest = {"vest_batch": 1, "command": [sys.executable, "-c", RUN, "{a}", "{b}", self.log, wait],
                    "parameters": {"a": list(range(count)), "b": ["x", "ä \U0001f600,\"q\""]}, **more}
        with open(self.path(name), "w", encoding="utf-8") as f:
            json.dump(manifest, f)
        return self.path(name)

    def results(self, where):
        return {n for n in os.listdir(os.path.join(where, "runs")) if n[0] != "."}


class Batch(Case):
    def test_any_order_and_back_end_give_the_same_table_and_nothing_is_done_twice(self):
        tables = []
        for jobs in ("1", "2", "one by one"):
            where = self.path("b" + jobs)
            self.batch("plan", self.manifest(), where)
            self.batch("status", where, code=1)
            self.assertIn("8 of 8 runs have no result", self.batch("merge", where, code=2))
            if jobs == "one by one":
                for k in random.Random(1).sample(range(8), 8):
                    self.batch("run", where, "--index", str(k))
            else:
                self.batch("run", where, "--jobs", jobs)
            self.batch("run", where, "--jobs", jobs if jobs != "one by one" else "1")
            self.assertIn("8 of 8 runs have a result, 0 failed", self.batch("status", where))
            self.batch("merge", where, "--output", self.path("table"))
            with open(self.path("table"), "rb") as f:
                tables.append(f.read())
        self.assertEqual(tables[0], tables[1])
        self.assertEqual(tables[0], tables[2])
        self.assertEqual(tables[0].splitlines()[0], b"id,a,b,sum,text")
        self.assertEqual(len(tables[0].splitlines()), 9)
        rows = list(csv.DictReader(io.StringIO(tables[0].decode())))
        self.assertEqual({(r["a"], r["b"], r["sum"]) for r in rows},
                         {(str(a), b, str(10 * a + len(b))) for a in range(4) for b in ("x", "ä \U0001f600,\"q\"")}, "each row names its own parameters")
        with open(self.log, encoding="utf-8") as f:
            self.assertEqual(len(f.readlines()), 24)

    def test_files_of_one_folder_and_folders_are_runs_of_their_own(self):
        for name, text in (("one/a.txt", "good"), ("one/b.txt", "bad"), ("two/a.txt", "good"), ("same/a.txt", "good")):
            os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
            with open(self.path(name), "w", encoding="utf-8") as f:
                f.write(text)
        for values, said in ((["one/a.txt", "one/b.txt"], "2 runs, 2 without result\n"), (["one", "two"], "2 runs, 2 without result\n"),
                             (["one/a.txt", "two/a.txt"], "2 runs, 2 without result\n"),
                             (["two", "same"], "1 runs, 1 without result; 1 more have the same command, parameters and content as one of them, and are "
                              "done once\n")):
            manifest = self.manifest(command=["ls", "{file}"], parameters={"file": values}, folders=["file"])
            self.assertEqual(self.batch("plan", manifest, self.path("plan" + "_".join(values).replace("/", "."))), said, values)

    def test_a_sentence_is_a_text_and_no_name_with_a_value(self):
        for said, header in (("599 steps, all the same", "id,n,output"), ("scene_hash 5a\nstate_hash 7b", "id,n,scene_hash,state_hash")):
            where = self.path(header.replace(",", "_"))
            self.batch("plan", self.manifest(command=[sys.executable, "-c", "print(%r)" % said, "{n}"], parameters={"n": [1]}), where)
            self.batch("run", where)
            self.assertEqual(self.batch("merge", where).splitlines()[0], header)

    def test_what_is_killed_goes_on_where_it_was(self):
        where = self.path("killed")
        self.batch("plan", self.manifest(wait=0.1), where)
        # In a group of its own, so that its children die with it.
        running = subprocess.Popen([BATCH, "run", where], start_new_session=True)
        while not self.results(where):
            time.sleep(0.02)
        os.killpg(running.pid, signal.SIGKILL)
        running.wait()
        kept = self.results(where)
        self.assertTrue(0 < len(kept) < 8)
        self.batch("run", where)
        self.batch("merge", where, "--output", self.path("table"))
        with open(self.log, encoding="utf-8") as f:
            self.assertLessEqual(len(f.readlines()), 9, "one run at most was lost")

    def test_a_result_that_changes_is_a_conflict_and_both_are_kept(self):
        where = self.path("conflict")
        manifest = self.manifest(command=[sys.executable, "-c", "import os; print(os.urandom(8).hex())"], parameters={"a": [1]})
        self.batch("plan", manifest, where)
        with open(os.path.join(where, "plan.json"), encoding="utf-8") as f:
            name = json.load(f)[0]["id"]
        script = self.path("slow.py")
        with open(script, "w", encoding="utf-8") as f:  # another node is faster
            f.write("import os,sys\nopen(sys.argv[1],'w').write('{}\\n')\nprint(7)\n")
        with open(manifest, "w", encoding="utf-8") as f:
            json.dump({"vest_batch": 1, "command": [sys.executable, script, os.path.join(where, "runs", "{n}")], "parameters": {"n": ["N"]}}, f)
        self.batch("plan", manifest, where)
        with open(os.path.join(where, "plan.json"), encoding="utf-8") as f:
            plan = json.load(f)
        self.assertNotEqual(plan[0]["id"], name, "another command is another run")
        plan[0]["argv"][2] = os.path.join(where, "runs", plan[0]["id"])
        with open(os.path.join(where, "plan.json"), "w", encoding="utf-8") as f:
            json.dump(plan, f)
        self.assertIn("CONFLICT", self.batch("run", where, code=2))
        self.assertEqual(len([n for n in os.listdir(where) if n.startswith("conflict.")]), 1)

    def test_a_changed_file_is_another_run_and_a_failed_run_says_why_and_is_tried_again(self):
        data, where = self.path("data.txt"), self.path("files")
        manifest = self.manifest(command=["grep", "-c", "good", "{file}"], parameters={"file": ["data.txt"]}, files=["file"])
        with open(data, "w", encoding="utf-8") as f:
            f.write("bad")
        self.batch("plan", manifest, where)
        self.assertIn("1 of 1 runs failed", self.batch("run", where, code=2))
        self.assertIn("0 of 1 runs have a result, 1 failed", self.batch("status", where, code=1))
        failed = os.path.join(where, "failed", os.listdir(os.path.join(where, "failed"))[0])
        with open(failed, encoding="utf-8") as f:
            self.assertIn("ended with 1", f.read())
        with open(data, "w", encoding="utf-8") as f:
            f.write("good")
        self.assertEqual(self.batch("plan", manifest, where), "1 runs, 1 without result\n")
        self.batch("run", where)
        self.assertEqual(self.batch("plan", manifest, where), "1 runs, 0 without result\n")

    def test_mistakes_are_one_line(self):
        where = self.path("never")
        for text, said in ((b"{", "batch.json"), (b"[]", "vest_batch: is missing"), (b"\xff\xfe", "batch.json"),
                           (b'{"vest_batch": 1}', "command"), (b'{"vest_batch": 1, "command": ["a"], "runs": 7}', "runs"),
                           (b'{"vest_batch": 1, "command": ["a {b}"]}', "{b} is no parameter"),
                           (b'{"vest_batch": 1, "command": ["a"], "sweep": {}}', "sweep: unknown"),
                           (b'{"vest_batch": 1, "command": ["a"], "parameters": {"x": [NaN]}}', "NaN (allowed: finite numbers)"),
                           (b'{"vest_batch": 1, "command": ["a"], "files": ["x"], "parameters": {"x": ["nowhere"]}}', "No such file"),
                           (json.dumps({"vest_batch": 1, "command": ["a"], "parameters": {k: list(range(1000)) for k in "ab"}}).encode(),
                            "1000000 runs (allowed: at most 100000)")):
            with open(self.path("batch.json"), "wb") as f:
                f.write(text)
            with self.subTest(text[:60]):
                self.assertIn(said, self.batch("plan", self.path("batch.json"), where, code=2))
                self.assertFalse(os.path.exists(where), "nothing half written")
        self.assertIn("no plan", self.batch("run", where, code=2))
        self.batch("plan", self.manifest(), where)
        self.assertIn("--index 99 (allowed: 0 to 7)", self.batch("run", where, "--index", "99", code=2))


    def test_files_of_strangers_are_refused_in_one_line(self):
        where, pipe = self.path("never"), self.path("pipe.yaml")
        os.mkfifo(pipe)
        os.symlink("/proc/self/pagemap", self.path("endless.yaml"))
        good = 'vest_batch: 1\ncommand: [echo]\n'
        bomb = good + "parameters:\n  x:\n  - &a [x, x, x, x, x, x, x, x]\n" + "".join(
            "  - &%c [%s]\n" % (98 + i, ",".join(["*%c" % (97 + i)] * 8)) for i in range(12))
        deep = good + "version: " + "[" * 900 + "]" * 900
        for name, text, said in (("a.yaml", bomb, "anchor"), ("a.yaml", deep, "32 levels"), ("a.yaml", "[" * 3_000_000, "too large"),
                                 ("a.yaml", good + "command: [ls]\n", "stands twice"), ("a.yaml", good + "---\na: 1\n", "single document"),
                                 ("a.yaml", good + "files: 5\n", "files"), ("a.yaml", good + "parameters: {1: [2]}\n", "names are words"),
                                 ("a.yaml", good + "parameters: {a: [2020-01-01]}\n", "date"), ("a.json", "[" * 300_000, "recursion"),
                                 ("a.yaml", "vest_batch: 1\ncommand: [!!python/object/apply:os.system [ls]]\n", "python/object"),
                                 ("a.json", '{"vest_batch": 1, "command": ["a"], "command": ["b"]}', "stands twice: command"),
                                 ("a.json", '{"vest_batch": 1, "command": [%s0]}' % ("[]," * 2_100_000), "too many values"),
                                 ("a.json", '{"vest_batch": 1, "command": ["a\\u0000"]}', "a list of words"),
                                 ("a.json", '{"vest_batch": 1, "command": ["a"], "\\u001b[2J": 1}', "\\x1b[2J: unknown"),
                                 ("a.json", '{"vest_batch": 1, "command": ["a"], "parameters": {"x": ["\\ud800"]}}', "texts, numbers"),
                                 ("a.yaml", good + "files: [f]\nparameters: {f: [pipe.yaml]}\n", "is no file"), ("pipe.yaml", None, "is no file"),
                                 ("endless.yaml", None, "has no size"),
                                 # What the parser, Python's numbers and the words of a command made of a small file.
                                 ("a.yaml", good + "parameters: {a: [!!int '']}\n", "line 3: the tag"),
                                 ("a.yaml", good + "parameters: {a: [!!timestamp x]}\n", "line 3: the tag"),
                                 ("a.yaml", good + "parameters: {a: [1%s]}\n" % (":59" * 300_000), "line 3: a number of 900001 characters"),
                                 ("a.yaml", good + "parameters: {a: [0x%s]}\n" % ("f" * 390), "allowed: texts, numbers"),
                                 ("a.json", '{"vest_batch": 1, "command": ["a"], "parameters": {"x": [1e999]}}', "1e999 (allowed: finite numbers)"),
                                 ("a.json", '{%s"k9": 1}' % "".join('"k%d": 1, ' % i for i in range(200_000)), "stands twice: k9"),
                                 ("a.yaml", 'vest_batch: 1\ncommand: ["%s"]\nparameters: {a: [%s]}\n' % ("{a}" * 100_000, "x" * 100_000), "becomes too long"),
                                 ("a.json", json.dumps({"vest_batch": 1, "command": ["a"], "parameters": {"x": list(range(1000))},
                                                        "runs": [{"k%d" % k: r for k in range(500)} for r in range(90)]}), "words and parameters together")):
            if text is not None:
                with open(self.path(name), "w", encoding="utf-8") as f:
                    f.write(text)
            with self.subTest(said, text=(text or "")[-60:]):
                self.assertIn(said, self.batch("plan", self.path(name), where, code=2))
                self.assertFalse(os.path.exists(where), "nothing half written")

    def test_names_of_files_do_not_write_to_the_terminal(self):
        for name in ("\x1b[2J\n\u202e", b"\xff".decode("utf-8", "surrogateescape")):
            folder = self.path(name)
            os.mkdir(folder)
            with open(os.path.join(folder, "a.yaml"), "w", encoding="utf-8") as f:
                f.write("vest_batch: 1\ncommand: [echo, \"{f}\"]\nfiles: [f]\nparameters: {f: [a.yaml]}\n")
            said = self.batch("status", folder, code=2)
            if name[0] != "\x1b":
                said = self.batch("plan", os.path.join(folder, "a.yaml"), os.path.join(folder, "plan"), code=2)
            self.assertTrue(said[:-1].isprintable(), ascii(said))

    def test_a_plan_and_results_of_strangers_are_read_as_if_they_lied(self):
        where = self.path("theirs")
        self.batch("plan", self.manifest(command=["no_such_program"], parameters={"a": [1]}), where)
        with open(os.path.join(where, "plan.json"), encoding="utf-8") as f:
            run = json.load(f)[0]
        self.assertIn("1 of 1 runs failed", self.batch("run", where, code=2))
        value = '{"id": "%s", "parameters": {}, "values": {"x": %%s}}' % run["id"]
        for text in ("", "[]", "{}", "[" * 300_000, json.dumps({"id": run["id"], "parameters": {}, "values": 1}),
                     value % "NaN", value % "1e999", value % '"\\ud800"'):
            with open(os.path.join(where, "runs", run["id"]), "w", encoding="utf-8") as f:
                f.write(text)
            self.assertIn(run["id"], self.batch("merge", where, code=2))
        for plan in ({}, None, [1], [{}], [{**run, "id": "../../x"}], [{**run, "argv": "echo"}], [{**run, "argv": ["a\0"]}],
                     [{**run, "parameters": {"a": float("nan")}}], [{**run, "parameters": {"a": []}}]):
            with open(os.path.join(where, "plan.json"), "w", encoding="utf-8") as f:
                json.dump(plan, f)
            for command in ("run", "status", "merge"):
                with self.subTest(command, plan=plan):
                    self.assertIn("no plan", self.batch(command, where, code=2))


    def test_results_that_make_a_table_without_end_are_refused(self):
        where = self.path("wide")
        self.batch("plan", self.manifest(count=50), where)
        with open(os.path.join(where, "plan.json"), encoding="utf-8") as f:
            plan = json.load(f)
        for number, run in enumerate(plan):
            with open(os.path.join(where, "runs", run["id"]), "w", encoding="utf-8") as f:
                json.dump({"id": run["id"], "parameters": {}, "values": {"k%d_%d" % (number, k): 1 for k in range(1000)}}, f)
        self.assertIn("100 results with 100002 names (allowed: a table of at most 4000000 cells)", self.batch("merge", where, code=2))


@unittest.skipUnless(FULL and shutil.which("slurmctld") and shutil.which("slurmd"), "with VEST_FULL and Slurm (slurmctld, slurmd, slurm-client)")
class Slurm(Case):
    """Two nodes on this machine, without root and munge: https://slurm.schedmd.com/slurm.conf.html"""

    def start(self):
        host, user = socket.gethostname(), subprocess.check_output(["id", "-un"], text=True).strip()
        lines = ["ClusterName=vest", "SlurmctldHost=%s(127.0.0.1)" % host, "SlurmctldPort=16817", "SlurmUser=" + user, "SlurmdUser=" + user,
                 "AuthType=auth/none", "CredType=cred/none", "AuthInfo=cred_expire=5", "CommunicationParameters=NoInAddrAny,NoCtldInAddrAny",
                 "ProctrackType=proctrack/linuxproc", "ReturnToService=2", "SlurmdTimeout=5", "SlurmdParameters=config_overrides",
                 "SchedulerParameters=batch_sched_delay=1,sched_interval=2", "StateSaveLocation=%s/state" % self.folder,
                 "SlurmdSpoolDir=%s/spool-%%n" % self.folder, "SlurmctldLogFile=%s/ctld.log" % self.folder,
                 "SlurmdLogFile=%s/%%n.log" % self.folder, "SlurmctldPidFile=%s/ctld.pid" % self.folder, "SlurmdPidFile=%s/%%n.pid" % self.folder,
                 "NodeName=node[1-2] NodeHostname=%s NodeAddr=127.0.0.1 Port=[16821-16822] CPUs=1" % host,
                 "PartitionName=vest Nodes=ALL Default=YES"]
        for name in ("state", "spool-node1", "spool-node2"):
            os.mkdir(self.path(name))
        with open(self.path("slurm.conf"), "w", encoding="utf-8") as f:
            f.write("\n".join(lines) + "\n")
        os.environ["SLURM_CONF"] = self.path("slurm.conf")
        self.daemons = [self.daemon("slurmctld", "-D")]
        self.nodes = {n: self.node(n) for n in ("node1", "node2")}

    def daemon(self, *command):
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        def end():
            process.kill()
            process.wait()
        self.addCleanup(end)
        return process

    def node(self, name):
        # All that a node runs dies with it. Root needs no user namespace, and slurmd as root would not start in one.
        user = ["-U", "--map-current-user"] if os.geteuid() else []
        return self.daemon("unshare", *user, "-pf", "--kill-child", "--mount-proc", "slurmd", "-D", "-N", name)

    def test_a_killed_node_costs_a_retry_and_the_table_is_that_of_one_machine(self):
        manifest = self.manifest(wait=0.5, count=30)
        self.batch("plan", manifest, self.path("here"))
        self.batch("run", self.path("here"), "--jobs", "8")
        self.batch("plan", manifest, self.path("there"))
        self.start()
        deadline = time.monotonic() + 300
        while subprocess.run(["sinfo", "-h", "-t", "idle", "-o", "%D"], capture_output=True, text=True, check=False).stdout.strip() != "2":
            self.assertLess(time.monotonic(), deadline, "the nodes did not start")
            time.sleep(0.5)
        self.batch("submit", self.path("there"), "--tasks", "4")
        while len(self.results(self.path("there"))) < 8:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.1)
        self.nodes["node1"].kill()
        self.nodes["node1"].wait()
        self.assertLess(len(self.results(self.path("there"))), 60)
        while len(self.results(self.path("there"))) < 60:
            self.assertLess(time.monotonic(), deadline, "the other node did not take over")
            time.sleep(0.5)
        for name in ("here", "there"):
            self.batch("merge", self.path(name), "--output", self.path(name + ".csv"))
        with open(self.path("here.csv"), "rb") as a, open(self.path("there.csv"), "rb") as b:
            self.assertEqual(a.read(), b.read())


if __name__ == "__main__":
    unittest.main()
