#!/usr/bin/env python3
"""Damaged and hostile files for every reader, each given to the tool that reads it, within limits.

usage: fuzz/hostile_files.py [--devel FOLDER] [--count N] [--seed N] [--only KIND] [--slow X] [--output FILE]

Writes the table corpora x outcomes (docs/hostile_files.md). Exit 1 where a tool crashed, hung, took too much memory, or
refused a file without naming it. The option --devel names the devel space of a build (default: build/test/devel). That of build/asan
has sanitizers, with --slow 10. --under "valgrind -q --error-exitcode=77 --trace-children=yes" --slow 40 runs each tool of any build under
that program. Failures stay under build/hostile, one folder each, with the command.
"""
import argparse
import collections
import concurrent.futures
import glob
import json
import os
import random
import re
import resource
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

from hostile_kinds import ROOT, kinds
from lies import lies

PACKAGES = ':'.join(sorted(glob.glob(os.path.join(ROOT, 'vest_*'))) + ['/usr/share'])
SECONDS, MEGABYTES = 5, 1024  # of processor time, resident: what a tool may take for one file
REFUSED_IMAGE = 500  # MB resident: what a tool of images may take for one that it refuses; a good one may be large
IMAGE_TOOLS = ('vest_image', 'vest_import')

REWRITTEN = 'rewritten while it is read'
TWO_LINES = '\nvest_model: good\n'
FOLDERS = {'a folder whose name writes to the terminal': '\x1b[2J\u202e', 'a folder whose name has two lines': TWO_LINES,
           'a folder whose name is no UTF-8': '\udcff\udcc3', 'a folder whose name a shell would run': " '$(id)`id`\"; %s{0}"}
# Devices, files of the kernel that have no size or no end, and what does not exist.
ELSEWHERE = ['/dev/zero', '/dev/tty', '/dev/full', '/proc/kmsg', '/proc/self/mem', '/proc/self/pagemap', '/proc/kcore', '/proc/self/environ', '../../../../../../../etc/passwd',
             'nothing']
PIECES = [b'nan', b'-1', b'0', b'1e39', b'1e308', b'-1e-308', b'99999999999', b'4294967295', b'inf', b'0x10', b'1_0',
          b'[', b'{', b': ', b'\n', b'&a ', b'*a', b'\n---\n', b'!!binary ', b'..', b'/etc/passwd', b'"', b"'", b',', b',,,,',
          b'\t', b'\xff\xfe', b'\x1b[2J', b'\x00', b'- ', b'~', b'true', b'\xe2\x80\xae', b'%', b'<', b'&amp;']


def mutant(data, rng, others):
    """A few random changes of bytes, numbers and lines."""
    s = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(s) + 1)
        way = rng.randrange(9)
        if way == 0 and s:
            s[at % len(s)] = rng.randrange(256)
        elif way == 1:
            del s[at:at + rng.randint(1, 40)]
        elif way == 2:
            s[at:at] = rng.choice(PIECES)
        elif way == 3:
            number = re.compile(rb'[0-9][0-9.eE+-]*').search(bytes(s), at)
            if number:
                s[number.start():number.end()] = rng.choice(PIECES[:11])
        elif way == 4:
            start = rng.randrange(len(s) + 1)
            s[at:at] = s[start:start + rng.randint(1, 200)]
        elif way == 5:
            del s[at:]
        elif way == 6 and len(s) > 8:
            at = min(at, len(s) - 4)
            s[at:at + 4] = struct.pack('<I', rng.choice([0, 0xffffffff, 0x7fffffff, 65536, rng.getrandbits(32)]))
        elif way == 7:  # a line twice, or two exchanged
            lines = bytes(s).splitlines(keepends=True)
            if len(lines) > 2:
                i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
                if rng.random() < 0.5:
                    lines.insert(i, lines[j])
                else:
                    lines[i], lines[j] = lines[j], lines[i]
                s = bytearray(b''.join(lines))
        else:
            other = rng.choice(others)
            s[at:] = other[rng.randrange(len(other) + 1):]
    return bytes(s)


def hostile(name, data):
    """What a stranger would try first, whatever the format."""
    return {
        'empty': b'', 'only zeros': b'\x00' * 1000, 'one line of 3 MB': b'a' * 3000000,
        '3 MB of brackets': b'[' * 3000000, '3 MB of commas': b',' * 3000000, '3 MB of line ends': b'\n' * 3000000,
        '3 MB of digits': b'9' * 3000000, 'random bytes': random.Random(name).getrandbits(160000).to_bytes(20000, 'little'),
        'utf-16': data.decode('latin-1').encode('utf-16'), 'cut in the middle': data[:len(data) // 2],
        'twice': data + data, 'backwards': data[::-1], 'carriage returns': data.replace(b'\n', b'\r\n'),
        'byte order mark': b'\xef\xbb\xbf' + data, 'a bomb of aliases':
        b'a: &a [x,x,x,x,x,x,x,x]\n' + b''.join(b'%c: &%c [%s]\n' % (98 + i, 98 + i, b','.join([b'*%c' % (97 + i)] * 8))
                                                for i in range(8)),
        'a list of two million': b'objects: [' + b'0,' * 2000000 + b'0]\n',
        'nested elements': b'<robot>' + b'<a>' * 200000, 'nested flow maps': b'{a: ' * 5000,
    }


def otherwise(data):
    """The same bytes as another machine, editor or line would have them, and what an interrupted copy leaves."""
    text, even = data.decode('latin-1'), data[:len(data) // 4 * 4]
    for name in ('utf-16-le', 'utf-16-be', 'utf-7', 'cp037'):
        yield 'as ' + name, text.encode(name)
    for size in (2, 4):
        yield 'each %d bytes turned' % size, b''.join(even[i:i + size][::-1] for i in range(0, len(even), size)) + data[len(even):]
    yield 'the highest bits set', bytes(b | 0x80 for b in data)
    yield 'a form feed in each line', data.replace(b'\n', b'\n\f')
    yield 'two line ends for one', data.replace(b'\n', b'\r\n\r\n')
    yield 'a block of zeros for its end', data[:len(data) // 2] + bytes(len(data) - len(data) // 2)
    ends = [i + 1 for i, byte in enumerate(data) if byte == 10] or range(1, len(data), 16)
    for end in ends[::max(1, len(ends) // 6)]:
        yield 'cut behind byte %d' % end, data[:end]


def rewrite(path, data, until):
    """Cuts, grows and replaces the file at random moments, as a program does that still writes it."""
    rng = random.Random(path)
    while not until.wait(0.004 * rng.random()):
        way = rng.randrange(4)
        if way == 0:
            os.truncate(path, rng.randrange(len(data) + 1))
        elif way == 1:
            os.rename(path, path + '.old')
            os.remove(path + '.old')
        with open(path, 'ab' if way == 2 else 'wb') as file:
            file.write(data[::-1] if way == 1 else data)


def special(path, way):
    """Puts something in the place of a file that is no file."""
    os.remove(path)
    if way == 0:
        os.mkfifo(path)
        return 'a pipe'
    if way == 1:
        os.mkdir(path)
        return 'a folder'
    if way == 2:
        os.symlink(os.path.basename(path), path)
        return 'a link to itself'
    if way == 3:
        folder = os.open(os.path.dirname(path), os.O_RDONLY)
        with socket.socket(socket.AF_UNIX) as server:
            server.bind('/proc/self/fd/%d/%s' % (folder, os.path.basename(path)))  # a name has at most 107 bytes
        os.close(folder)
        return 'a socket'
    if way < 4 + len(ELSEWHERE):
        os.symlink(ELSEWHERE[way - 4], path)
        return 'a link to ' + ELSEWHERE[way - 4]
    with open(path, 'wb') as file:
        file.truncate(1 << 36)
    return '64 GB of holes'


SPECIALS = 5 + len(ELSEWHERE)


OUTCOMES = ['refused, file named', 'judged not good', 'accepted', 'refused without the file', 'crashed', 'hung',
            'too much memory', 'wrote to the terminal', 'left a part']


def left_behind(kind, folder):
    """A file that is none of those given, nor in the cache; those of SQLite go with its next user."""
    for place, folders, files in os.walk(folder):
        folders[:] = [f for f in folders if os.path.join(place, f) != folder + '/cache']
        for file in files:
            path = os.path.relpath(os.path.join(place, file), folder)
            if path not in kind.files and not path.endswith(('.db-wal', '.db-shm', '.db-journal')):
                return path
    return ''


def run(kind, folder, slow, under=(), spent=None):
    """What the tool makes of the files in the folder: (outcome, message). Seconds of processor time and megabytes come into `spent`."""
    command = [*under, *(part.format(folder) for part in kind.command)]
    environment = dict(os.environ, ASAN_OPTIONS='detect_leaks=0:exitcode=77:allocator_may_return_null=0',
                       UBSAN_OPTIONS='print_stacktrace=1:halt_on_error=1:exitcode=77', VEST_CACHE_DIR=folder + '/cache')
    environment.pop('DISPLAY', None)
    environment.setdefault('ROS_PACKAGE_PATH', PACKAGES)  # where no devel space is sourced

    def limits():
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (int(SECONDS * slow) + 1, int(SECONDS * slow) + 2))
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))

    with open(folder + '.err', 'wb+') as err:
        process = subprocess.Popen(command, stdout=err, stderr=err, stdin=subprocess.DEVNULL, env=environment,
                                   preexec_fn=limits, start_new_session=True)
        deadline = time.monotonic() + 60 * slow
        while True:
            done, status, usage = os.wait4(process.pid, os.WNOHANG)
            if done:
                break
            if time.monotonic() > deadline:  # waits for something: a pipe, say
                os.kill(process.pid, signal.SIGKILL)
                os.wait4(process.pid, 0)
                process.returncode = -9
                return 'hung', 'it waits'
            time.sleep(0.002)
        process.returncode = -os.WTERMSIG(status) if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)
        if spent is not None:
            spent.update(seconds=usage.ru_utime + usage.ru_stime, megabytes=usage.ru_maxrss // 1024)
        err.seek(0)
        text = err.read().decode('utf-8', 'replace').strip()
    last = text.splitlines()[-1] if text else ''
    code = process.returncode
    if code in (-signal.SIGXCPU, -signal.SIGKILL):
        return 'hung', '%.0f s of processor time' % (usage.ru_utime + usage.ru_stime)
    if code < 0 or code == 77 or 'ERROR: AddressSanitizer' in text or 'runtime error:' in text:
        return 'crashed', 'exit %d: %s' % (code, next((line for line in text.splitlines() if 'ERROR' in line or 'error:' in line),
                                                      last))
    most = REFUSED_IMAGE if code != 0 and os.path.basename(kind.command[0]) in IMAGE_TOOLS else MEGABYTES
    if usage.ru_maxrss > most * 1024 * (3 if slow > 1 else 1):
        return 'too much memory', '%d MB' % (usage.ru_maxrss // 1024)
    if re.search('[\x00-\x08\x0b-\x1f\x7f\ufffd\u202a-\u202e\u2066-\u2069]', text) or TWO_LINES in text:
        return 'wrote to the terminal', ascii(last)
    if code == 0:
        return 'accepted', last
    # The last three: a session that is simulated again is not what was recorded.
    if any(words in last for words in ('rows not held', 'first difference: ', ' is missing before step ', 'no state hash was compared')) or 'NOT good' in text:
        return 'judged not good', last
    # What is refused leaves nothing: a part of a scene would be taken for one.
    left = left_behind(kind, folder)
    if left:
        return 'left a part', left
    if any(name in last for name in kind.named) and last.count(': ') >= 2:
        return 'refused, file named', last
    return 'refused without the file', last


def cases(kind, count, seed):
    """(title, function that writes the case into a folder)."""
    data = kind.files[kind.target]
    others = [bytes(f) or b'0' for f in kind.files.values()]
    for title, bytes_ in hostile(kind.name, data).items():
        yield title, bytes_
    for title, bytes_ in lies(os.path.basename(kind.target), data):
        if bytes_ != data:  # a lie about what this file has not
            yield title, bytes_
    for title, bytes_ in otherwise(data):
        if bytes_ != data:
            yield title, bytes_
    for n in range(2):
        yield REWRITTEN + ' (%d)' % n, data
    for title in FOLDERS:
        yield title, data[:len(data) // 2]
    for way in range(SPECIALS):
        yield way, None
    for i in range(count):
        rng = random.Random('%s %d %d' % (kind.name, seed, i))
        yield 'mutant %d' % i, mutant(data, rng, others)


def one(kind, number, title, data, place, slow, under=()):
    """Writes a case, runs it; the folder stays where it failed."""
    folder = os.path.join(place, re.sub(r'[^a-z0-9]+', '_', kind.name.lower()) + '_%d' % number)
    folder += FOLDERS.get(title, '')
    os.mkdir(folder)
    for name, bytes_ in kind.files.items():
        os.makedirs(os.path.dirname(os.path.join(folder, name)), exist_ok=True)
        with open(os.path.join(folder, name), 'wb') as file:
            file.write(bytes_)
    path = os.path.join(folder, kind.target)
    if data is None:
        title = special(path, title)
    else:
        with open(path, 'wb') as file:
            file.write(data)
    ended = threading.Event()
    writer = threading.Thread(target=rewrite, args=(path, data, ended))
    if str(title).startswith(REWRITTEN):
        writer.start()
    outcome, message = run(kind, folder, slow, under)
    ended.set()
    if writer.ident:
        writer.join()
    if OUTCOMES.index(outcome) < 3:
        shutil.rmtree(folder, ignore_errors=True)
        os.remove(folder + '.err')
    return outcome, title, message, folder


def few(pool, calls, at_once):
    """Results of the calls in their order, while at most so many wait."""
    waiting = collections.deque()
    for call in calls:
        if len(waiting) > at_once:
            yield waiting.popleft().result()
        waiting.append(pool.submit(*call))
    while waiting:
        yield waiting.popleft().result()


def table(rows, total, parts, options):
    """The page."""
    how = ' '.join(['`fuzz/hostile_files.py`', '%d changed files a corpus, seed %d' % (options.count, options.seed)] +
                   (['tools built of commit %s' % options.built_of] if options.built_of else []) +
                   (['only the corpora with "%s" in their name' % options.only] if options.only else []) +
                   ['(%d corpora: about one file in %d)' % (n, every) for every, n in sorted(parts.items()) if every > 1] +
                   (['over the build with sanitizers, limits times %g' % options.slow] if 'asan' in options.devel else []) +
                   (['each tool under `%s`, limits times %g' % (options.under, options.slow)] if options.under else []))
    head = ['# Damaged and hostile files', '',
            'Written by `fuzz/hostile_files.py`; do not edit. The command makes %d files, seeded, from the formats that VEST reads. It' %
            total,
            'gives each to the tool that reads it. One file may cost %d s of processor time and 1 GB, an image that is refused %d MB.' % (SECONDS, REFUSED_IMAGE), '',
            'Each corpus holds random changes of a good file (bytes, numbers, lines, parts of other files). It also holds what a stranger',
            'would try first: no bytes, millions of brackets, a bomb of aliases, a pipe or a device. Others are in another encoding or byte order, cut,',
            'or rewritten while they are read. Then come files that are well made and lie',
            '(`fuzz/lies.py`): counts that contradict the data, packed bombs, numbers at the edges, names that write. A changed file may',
            'still be a good one: it is accepted then. *Judged not good*: `vest_model check` or `vest_check_session` read it and says what is wrong,',
            'or `vest_resimulate` says where the session is not what was recorded.',
            '*Left a part*: what was refused left a file of its output.', '',
            'This table: %s.' % how.replace('` ', '`, '), '',
            'What a file can and cannot do to the machine that opens it: [security.md](security.md).', '',
            '| corpus | ' + ' | '.join(OUTCOMES) + ' |', '| --- |' + ' ---: |' * len(OUTCOMES)]
    sums = [0] * len(OUTCOMES)
    for name, counts in rows:
        head.append('| %s | %s |' % (name, ' | '.join(str(counts.get(o, 0)) for o in OUTCOMES)))
        sums = [a + counts.get(o, 0) for a, o in zip(sums, OUTCOMES)]
    head.append('| **all** | %s |' % ' | '.join('**%d**' % n for n in sums))
    return '\n'.join(head) + '\n'


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--devel', default=os.path.join(ROOT, 'build', 'test', 'devel'))
    parser.add_argument('--count', type=int, default=300, help='mutants a corpus')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--only', default='', help='corpora whose name holds this')
    parser.add_argument('--slow', type=float, default=1, help='times the limits, for sanitizers')
    parser.add_argument('--under', default='', help='program that runs each tool, exit 77 where it finds something')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--every', type=int, default=1, help='runs about each Nth file, seeded')
    parser.add_argument('--rows', help='file that keeps the counts of each corpus that is through: run again, it goes on behind them')
    parser.add_argument('--output', help='page to write')
    parser.add_argument('--built-of', default='', help='commit of the tools, for the page')
    options = parser.parse_args()

    # The devel space that is sourced, if any, comes behind.
    os.environ['LD_LIBRARY_PATH'] = os.path.abspath(options.devel) + '/lib:' + os.environ.get('LD_LIBRARY_PATH', '')

    def tool(package, name):
        for path in (os.path.join(options.devel, 'lib', package, name), os.path.join(options.devel, 'lib', 'vest', name)):
            if os.path.exists(path):
                return os.path.abspath(path)
        return ''

    if not tool('', 'vest_read'):  # it keeps the good files
        parser.error('%s has no lib/vest/vest_read; allowed: the devel space of a build that has it' % options.devel)
    place = os.path.join(ROOT, 'build', 'hostile')
    os.makedirs(place, exist_ok=True)
    place = tempfile.mkdtemp(dir=place)
    rows, bad, total, known, parts = [], 0, 0, {}, collections.Counter()
    if options.rows and os.path.exists(options.rows):
        with open(options.rows, encoding='utf-8') as file:
            known = dict(json.loads(line) for line in file)
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for kind in kinds(tool):
            if options.only not in kind.name:
                continue
            if not kind.command[0]:
                bad += 1
                print('%s: its tool is not built in %s' % (kind.name, options.devel))
                continue
            setting = '%s, %d changed, seed %d' % (kind.name, options.count, options.seed)
            if setting in known:
                every, counts = known[setting]
                parts[every] += 1
                total, bad = total + sum(counts.values()), bad + sum(counts.get(o, 0) for o in OUTCOMES[3:])
                rows.append((kind.name, counts))
                continue
            counts = {}
            number = 0
            # Some are large: never more of them than are run.
            for outcome, title, message, folder in few(pool, (
                    (one, kind, n, title, data, place, options.slow, options.under.split()) for n, (title, data) in enumerate(cases(kind, options.count, options.seed))
                    if random.Random('%s %d' % (kind.name, n)).randrange(options.every) == 0),
                    options.jobs):
                number += 1
                counts[outcome] = counts.get(outcome, 0) + 1
                if OUTCOMES.index(outcome) >= 3:
                    bad += 1
                    print('%s: %s: %s: %s (%s)' % (kind.name, title, outcome, message[:300], ascii(folder)))
            total += number
            rows.append((kind.name, counts))
            parts[options.every] += 1
            if options.rows:
                with open(options.rows, 'a', encoding='utf-8') as file:
                    file.write(json.dumps([setting, [options.every, counts]]) + '\n')
            print('%-24s %s' % (kind.name, ', '.join('%s %d' % (o, counts[o]) for o in OUTCOMES if o in counts)), flush=True)
    if options.output:
        with open(options.output, 'w', encoding='utf-8') as file:
            file.write(table(rows, total, parts, options))
    print('hostile_files: %d files, %d bad' % (total, bad))
    return 1 if bad else 0


if __name__ == '__main__':
    sys.exit(main())
