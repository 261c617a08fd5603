#!/usr/bin/env python3
"""Protects the counts of fuzz/run_sanitized. Inputs of several processes of a reader are added. A crash in one of them is the
reader's. Inputs that were not run do not count. A stand-in for the fuzzer says that it ran what it was asked for.

usage: test_sanitized.py
"""
import os
import shutil
import subprocess
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
FUZZER = r'''#!/bin/bash
if [ "$VEST_FUZZ_READER" = list ]; then
  for reader in quick slow red late; do mkdir -p "$VEST_FUZZ_KEPT/$reader"; echo kept >"$VEST_FUZZ_KEPT/$reader/kept_0"; echo $reader; done
  exit 0
fi
for word; do case $word in -runs=*) runs=${word#*=} ;; -seed=*) seed=${word#*=} ;; -artifact_prefix=*) bad=${word#*=} ;; esac; done
echo "$VEST_FUZZ_READER $runs $seed" >>"$SAID"
[ $VEST_FUZZ_READER = late ] || echo 'INFO: Seed: 1' >&2
said() { echo "stat::number_of_executed_units: $1" >&2; }
case $VEST_FUZZ_READER in
  slow) trap 'said 7; exit 72' INT; while :; do sleep 0.05; done ;;
  late) exec sleep 60 ;;
  red) if [ "$seed" -gt 1 ]; then touch "$bad/crash-1"; echo 'ERROR: AddressSanitizer' >&2; said 3; exit 77; fi ;;
esac
said "$runs"
'''


class RunSanitized(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.place = folder.name
        for path in ('fuzz', '.ci', 'devel/lib/vest'):
            os.makedirs(os.path.join(self.place, path))
        shutil.copy(os.path.join(HERE, 'run_sanitized'), self.place + '/fuzz')
        for path, text in (('devel/lib/vest/vest_fuzz', FUZZER), ('.ci/full_table', '#!/bin/sh\necho 0123456789\n')):
            with open(os.path.join(self.place, path), 'w', encoding='utf-8') as file:
                file.write(text)
            os.chmod(file.name, 0o755)

    def run_it(self, *words, **variables):
        """(exit status, lines, [(reader, runs, seed) of each process])."""
        said = os.path.join(self.place, 'said')
        open(said, 'w', encoding='utf-8').close()
        environment = dict(os.environ, VEST_FUZZ_DEVEL=self.place + '/devel', SAID=said, **variables)
        done = subprocess.run([self.place + '/fuzz/run_sanitized', *words], env=environment, capture_output=True, text=True, timeout=300, check=False)
        with open(said, encoding='utf-8') as file:
            processes = sorted((line.split()[0], *map(int, line.split()[1:])) for line in file)
        return done.returncode, (done.stdout + done.stderr).splitlines(), processes

    def rows(self):
        with open(self.place + '/build/fuzz/readers.log', encoding='utf-8') as file:
            return [line.strip() for line in file if line.startswith(('count:', 'Test '))]

    def test_processes_share_the_inputs_of_a_reader_and_their_counts_are_added(self):
        code, lines, processes = self.run_it('1000000', 'quick:3', VEST_FUZZ_JOBS='2')
        self.assertEqual(code, 0, lines)
        self.assertEqual([p[:2] for p in processes], [('quick', 333334)] * 3)
        self.assertEqual(len({seed for _, _, seed in processes}), 3, 'each has a seed of its own')
        self.assertIn('quick: 1000002 inputs, nothing found', lines)
        self.assertIn('count: 1000002 of 1000000 inputs under sanitizers (readers.quick)', self.rows())
        # At the same commit it is done.
        code, lines, processes = self.run_it('1000000', 'quick:3')
        self.assertEqual((code, processes), (0, []), lines)
        self.assertIn('quick: 1000002 inputs, nothing found', lines)

    def test_more_jobs_than_readers_are_parts_of_them(self):
        code, lines, processes = self.run_it('100', 'quick', VEST_FUZZ_JOBS='4')
        self.assertEqual((code, [p[:2] for p in processes]), (0, [('quick', 25)] * 4), lines)

    def test_kept_inputs_of_another_run_are_not_made_again(self):
        os.makedirs(self.place + '/kept/other')
        open(self.place + '/kept/other/kept_0', 'w', encoding='utf-8').close()
        code, lines, processes = self.run_it('100', VEST_FUZZ_JOBS='1', VEST_FUZZ_KEPT=self.place + '/kept')
        self.assertEqual((code, processes), (0, [('other', 100, 1)]), lines)

    def test_a_crash_in_one_process_is_the_readers(self):
        code, lines, _ = self.run_it('100', 'red:2', 'quick', VEST_FUZZ_JOBS='2')
        self.assertEqual(code, 1, lines)
        self.assertTrue(any(line.startswith('red: FAILED') for line in lines), lines)
        self.assertIn('quick: 100 inputs, nothing found', lines)
        self.assertIn('Test Failed.', self.rows())
        self.assertEqual(os.listdir(self.place + '/build/fuzz/bad/red'), ['crash-1'])
        self.assertEqual(set(os.listdir(self.place)), {'.ci', 'build', 'devel', 'fuzz', 'said'}, 'nothing among the sources')

    def test_a_fuzzer_that_does_not_start_is_not_nothing_found(self):
        with open(self.place + '/devel/lib/vest/vest_fuzz', 'w', encoding='utf-8') as file:
            file.write('#!/bin/sh\nexit 127\n')
        os.makedirs(self.place + '/kept/quick')
        open(self.place + '/kept/quick/kept_0', 'w', encoding='utf-8').close()
        code, lines, _ = self.run_it('100', 'quick:2', VEST_FUZZ_KEPT=self.place + '/kept')
        self.assertEqual(code, 1, lines)
        self.assertTrue(any(line.startswith('quick: FAILED') for line in lines), lines)

    def test_the_whole_is_bounded_and_what_did_not_begin_has_no_inputs(self):
        code, lines, processes = self.run_it('100', 'slow:2', 'late', 'quick', VEST_FUZZ_JOBS='3', VEST_FUZZ_TOTAL='2')
        self.assertEqual(code, 0, lines)
        self.assertEqual(len([p for p in processes if p[0] == 'slow']), 2, 'both begin at once')
        self.assertIn('slow: 14 inputs, nothing found, stopped before 100', lines)
        self.assertIn('late: 0 inputs, nothing found, stopped before 100', lines)
        self.assertIn('quick: 0 inputs, nothing found, stopped before 100', lines)


if __name__ == '__main__':
    unittest.main()
