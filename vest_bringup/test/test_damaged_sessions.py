#!/usr/bin/env python3
"""Protects the tools that read recordings from damaged and hostile ones: for each kind of damage vest_check_session,
vest_recover_bag and vest_resimulate end by themselves, within bounded memory, with a code of theirs; where they refuse, they say so
in one line that names the file.

usage: test_damaged_sessions.py WRITER CHECK RECOVER RESIMULATE [--keep FOLDER]     VEST_FULL: thousands instead of tens
"""
import concurrent.futures
import json
import os
import random
import re
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

import rosbag
from std_msgs.msg import String

WRITER, CHECK, RECOVER, RESIMULATE = sys.argv[1:5]
ARGUMENTS = sys.argv[:1] + sys.argv[5:]
FULL = "VEST_FULL" in os.environ
SEED = 4711
MEMORY = 2 << 30  # bytes of addresses; a tool alone maps some 0.7 GB of libraries
PATIENCE = 300  # s: a hang, not a slow machine

NUMBERS = [0, 1, 3, 0x7F, 0x80, 0xFFFF, 0x10000000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF]
WORDS = [(b"vest_msgs/StepInput", b"std_msgs/String"), (b"vest_msgs/StateHash", b"std_msgs/String"),
         (b"vest_msgs/TissueTopology", b"std_msgs/String"), (b"vest_msgs/SceneFiles", b"vest_msgs/StepInput"),
         (b"compression=none", b"compression=lz4 "), (b"compression=lz4", b"compression=bz2"), (b"compression=none", b"compression=\xff\xfe\x00\x01"),
         (b"op=\x05", b"op=\x02"), (b"op=\x02", b"op=\x07"), (b"op=\x07", b"op=\x09"), (b"conn=", b"c=nn="), (b"time=", b"=time"),
         (b"topic=", b"topi=="), (b"md5sum=", b"md5sum\x00"), (b"step_inputs", b"tissue/scen"), (b"tube.yaml", b"../a.yaml"),
         (b"float64 dt", b"float64 d\xff"), (b"Header header", b"Header \xc3\x28eader")]


def truncated(data, chance):
    return data[:chance.randrange(len(data))]


def flipped(data, chance):
    data = bytearray(data)
    for _ in range(chance.choice([1, 3, 30])):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return bytes(data)


def lying(data, chance):
    """Another number where a length or a count may stand: before a field of a header, or anywhere."""
    data = bytearray(data)
    for _ in range(chance.choice([1, 2, 5])):
        found = [m.start() for m in re.finditer(chance.choice([b"op=", b"conn=", b"size=", b"time=", b"topic=", b"count="]), data)]
        at = chance.choice(found) - 4 - chance.choice([0, 0, 4]) if found and chance.random() < 0.7 else chance.randrange(len(data) - 8)
        struct.pack_into("<I", data, max(at, 0), chance.choice(NUMBERS))
    return bytes(data)


def reworded(data, chance):
    old, new = chance.choice(WORDS)
    return data.replace(old, new, chance.choice([1, 2, -1]))


def some_bytes(chance, count):  # Python 3.8 has no randbytes
    return chance.getrandbits(8 * count).to_bytes(count, "little") if count else b""


def noise(data, chance):
    data = bytearray(data)
    begin = chance.randrange(len(data))
    size = chance.choice([16, 256, 4096, 65536])
    data[begin:begin + size] = some_bytes(chance, size)
    return bytes(data)


def spliced(data, chance):
    """A piece is missing, or stands twice."""
    a, b = sorted(chance.randrange(len(data)) for _ in range(2))
    return data[:a] + data[b:] if chance.random() < 0.5 else data[:b] + data[a:]


def garbage(data, chance):
    begin = chance.choice([b"", b"#ROSBAG V2.0\n", b"#ROSBAG V1.2\n", data[:4200]])
    return begin + some_bytes(chance, chance.choice([0, 1, 4, 100, 100000]))


DAMAGES = [truncated, flipped, lying, reworded, noise, spliced, garbage]

SESSIONS = [
    b"", b"null", b"[]", b"17", b'"text"', b"{", b"{}", b"\xff\xfe", b"nul", b"[" * 100000, b'{"a":' * 100000, b"\x00" * 100,
    b'{"version":1,"scene_hash":2,"state_hash":3,"steps":"4","real_time_factor":[],"rates":5,"events":null,"ended":{}}',
    b'{"version":"","scene_hash":"","state_hash":"","steps":-1,"real_time_factor":1e999,"rates":{},"events":[],"ended":"killed"}',
    b'{"version":"","scene_hash":"","state_hash":"","steps":1e300,"real_time_factor":null,"rates":{},"events":[],"ended":"\\u001b[2J"}',
]


def limited():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def tried(command, folder):
    """What is wrong with how a tool ended; empty: nothing."""
    try:
        done = subprocess.run([*command, folder], capture_output=True, timeout=PATIENCE, check=False, preexec_fn=limited)
    except subprocess.TimeoutExpired:
        return f"{command[0]} {folder}: hangs"
    said = done.stderr.decode("utf-8", "replace")
    problem = ""
    if done.returncode not in (0, 1, 2):
        problem = f"ends with {done.returncode}"
    elif done.returncode == 2 and (said.count("\n") != 1 or folder not in said):
        problem = "refuses, but not in one line that names the file"
    elif done.returncode != 2 and said:
        problem = "does not refuse, but complains"
    elif re.search(r"bad_alloc|basic_string|vector::|stoul|Traceback", said):
        problem = "a refusal that nobody can act on"
    return f"{os.path.basename(command[0])}: {problem}: {said[:400]}" if problem else ""


class DamagedSessions(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="vest_damaged_")
        whole = os.path.join(cls.folder, "whole")
        os.mkdir(whole)
        subprocess.run([WRITER], env=dict(os.environ, VEST_WRITE_SESSION=whole), check=True)
        with open(os.path.join(whole, "session.json"), "rb") as f:
            cls.json = f.read()
        cls.bags = []
        with open(os.path.join(whole, "session.bag"), "rb") as f:
            cls.bags.append(f.read())
        for compression in ("none", "lz4", "bz2"):  # as stock rosbag writes them
            copy = os.path.join(cls.folder, compression + ".bag")
            with rosbag.Bag(os.path.join(whole, "session.bag")) as source, rosbag.Bag(copy, "w", compression=compression,
                                                                                     chunk_threshold=65536) as target:
                for topic, message, time in source.read_messages(raw=True):
                    target.write(topic, message, time, raw=True)
            with open(copy, "rb") as f:
                cls.bags.append(f.read())

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def written(self, name, bag, session):
        folder = os.path.join(self.folder, name)
        os.mkdir(folder)
        for file, content in (("session.bag", bag), ("session.json", session)):
            with open(os.path.join(folder, file), "wb") as f:
                f.write(content)
        return folder

    def try_all(self, name, bag, session):
        """All three tools on one damaged session."""
        folder = self.written(name, bag, session)
        problems = [tried([CHECK, "--no-picture"], folder), tried([RESIMULATE], folder)]
        os.rename(os.path.join(folder, "session.bag"), os.path.join(folder, "session.bag.active"))
        os.remove(os.path.join(folder, "session.json"))
        problems.append(tried([RECOVER], folder))
        recovered = os.path.join(folder, "session.bag")
        if os.path.exists(recovered):  # a whole bag, also for stock readers
            try:
                with rosbag.Bag(recovered) as b:
                    for _ in b.read_messages(raw=True):
                        pass
            except Exception as error:  # noqa: BLE001  (whatever it is)
                problems.append(f"what was recovered is no bag: {error!r}")
            with open(os.path.join(folder, "session.json"), encoding="utf-8") as f:
                if json.load(f)["ended"] != "killed":
                    problems.append("what was recovered does not say so")
        problems = [f"{name}: {p}" for p in problems if p]
        if not problems:
            shutil.rmtree(folder)
        return problems

    def try_check(self, name, bag, session):
        folder = self.written(name, bag, session)
        problem = tried([CHECK, "--no-picture"], folder)
        shutil.rmtree(folder)
        return [f"{name}: {problem}"] if problem else []

    def run_all(self, cases, try_one=None):
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            problems = [p for some in pool.map(lambda c: (try_one or self.try_all)(*c), cases) for p in some]
        self.assertEqual(problems, [], "\n".join(problems[:20]))

    def test_the_whole_session_holds_before_each_tool_in_each_compression(self):
        for i, bag in enumerate(self.bags):
            folder = self.written(f"good{i}", bag, self.json)
            done = subprocess.run([RESIMULATE, folder], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            done = subprocess.run([CHECK, folder], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 1, done.stderr)  # it has no instruments
            self.assertRegex(done.stdout, r"session.json steps +300 +300 +ok")

    def test_each_kind_of_damage_ends_in_one_message_or_none(self):
        rounds = 400 if FULL else 2
        cases = []
        for round_ in range(rounds):
            for damage in DAMAGES:
                for i, bag in enumerate(self.bags):
                    if not FULL and (round_ + i) % 2:
                        continue
                    chance = random.Random(f"{SEED} {round_} {damage.__name__} {i}")
                    cases.append((f"{damage.__name__}_{round_}_{i}", damage(bag, chance), self.json))
        print(f"count: {len(cases)} of {400 * len(DAMAGES) * len(self.bags)} damaged bags (DamagedSessions.{self._testMethodName})", flush=True)
        self.run_all(cases)

    def test_whatever_session_json_says(self):
        rounds = 2000 if FULL else 6
        chance = random.Random(SEED)
        cases = [(f"json_{i}", self.bags[0], text) for i, text in enumerate(SESSIONS)]
        for k in range(rounds):
            cases.append((f"json_{chance.choice(DAMAGES).__name__}_{k}", self.bags[0], chance.choice([truncated, flipped, noise])(self.json, chance)))
        self.run_all(cases, self.try_check)

    def test_what_is_no_file_of_its_kind(self):
        for make in (os.mkdir, os.mkfifo, lambda path: os.symlink("/dev/zero", path), lambda path: os.symlink("nowhere", path)):
            folder = tempfile.mkdtemp(dir=self.folder)
            make(os.path.join(folder, "session.bag"))
            for tool in (CHECK, RESIMULATE):
                self.assertEqual(tried([tool], folder), "")
            make(os.path.join(folder, "session.bag.active"))
            os.rename(os.path.join(folder, "session.bag"), os.path.join(folder, "aside"))
            self.assertEqual(tried([RECOVER], folder), "")
            done = subprocess.run([RECOVER, folder], capture_output=True, timeout=PATIENCE, check=False)
            self.assertEqual(done.returncode, 2)

    def test_garbage_is_refused_and_leaves_nothing(self):
        for content in (b"", b"garbage" * 1000, b"#ROSBAG V2.0\n", b"#ROSBAG V2.0\n" + bytes(5000)):
            folder = tempfile.mkdtemp(dir=self.folder)
            with open(os.path.join(folder, "session.bag.active"), "wb") as f:
                f.write(content)
            done = subprocess.run([RECOVER, folder], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 2, done.stdout)
            self.assertEqual(os.listdir(folder), ["session.bag.active"])

    def test_one_bad_byte_in_a_definition_and_an_empty_field_lose_nothing(self):
        folder = tempfile.mkdtemp(dir=self.folder)
        active = os.path.join(folder, "session.bag.active")
        header = {"type": "std_msgs/String", "md5sum": String._md5sum, "message_definition": String._full_text, "callerid": ""}
        with rosbag.Bag(active, "w") as bag:
            for k in range(300):
                bag.write("/vest/text", String(data=str(k)), connection_header=header)
        with open(active, "rb") as f:
            data = f.read()
        self.assertIn(b"callerid=", data)
        self.assertIn(b"string data", data)
        with open(active, "wb") as f:
            f.write(data.replace(b"string data", b"string dat\xff"))
        done = subprocess.run([RECOVER, folder], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        with rosbag.Bag(os.path.join(folder, "session.bag")) as bag:
            self.assertEqual(bag.get_message_count("/vest/text"), 300)


if __name__ == "__main__":
    unittest.main(argv=ARGUMENTS)
