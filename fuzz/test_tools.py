#!/usr/bin/env python3
"""Protects people who open files of strangers: what tools once did with one stays mended. Each refusal is one line that names the file,
and leaves nothing behind.

usage: test_tools.py DEVEL     the devel space of the build
"""
import os
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import hostile_files
import hostile_kinds

DEVEL = sys.argv.pop(1)
PATIENCE = 300  # s: a hang, not a slow machine


def tool(package, name):
    paths = [os.path.join(DEVEL, 'lib', place, name) for place in (package, 'vest')]
    return os.path.abspath(next((p for p in paths if os.path.exists(p)), ''))


def refusal(command, files):
    """(exit status, lines, files left) of a tool in a folder of these files: bytes; a text: a link to it; None: a pipe."""
    with tempfile.TemporaryDirectory() as folder:
        for name, bytes_ in files.items():
            path = os.path.join(folder, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            if bytes_ is None:
                os.mkfifo(path)
                continue
            if isinstance(bytes_, str):
                os.symlink(bytes_, path)
                continue
            with open(path, 'wb') as file:
                file.write(bytes_)
        done = subprocess.run([part.replace('{}', folder) for part in command], stdin=subprocess.DEVNULL, capture_output=True, timeout=PATIENCE, check=False)
        left = hostile_files.left_behind(hostile_kinds.Kind('', files, '', command), folder)
        lines = (done.stdout + done.stderr).decode('utf-8', 'replace').strip().splitlines()
        return done.returncode, lines, left


class Tools(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.good = hostile_kinds.made(tool)

    def refused(self, command, files, named, status=1):
        code, lines, left = refusal(command, files)
        self.assertEqual((code, len(lines), left), (status, 1, ''), lines)
        self.assertIn(named, lines[0])
        return lines[0]

    def test_tags_of_a_map_of_devices_are_one_line(self):
        script = os.path.join(hostile_kinds.ROOT, 'vest_haptics', 'scripts', 'start_devices')
        for text in (b"a: !!int ''", b'a: !!bool x', b'a: !!float ""', b'a: !!timestamp x', b'? [a]\n: 1', b'instruments: 5', b'[' * 100000):
            with self.subTest(text[:20]):
                self.refused([script, '{}/map.yaml', '--list'], {'map.yaml': text}, 'map.yaml')

    def test_a_file_of_the_kernel_that_never_ends_is_not_waited_for(self):
        script = os.path.join(hostile_kinds.ROOT, 'vest_haptics', 'scripts', 'start_devices')
        for command in ([script, '/proc/kmsg', '--list'], [tool('vest_bringup', 'vest_metrics'), '/proc/kmsg']):
            with self.subTest(command[0]):
                self.refused(command, {}, '/proc/kmsg: ')

    def test_a_snapshot_that_never_ends_is_not_waited_for(self):
        files = {'session.bag': hostile_kinds.restoring(self.good['bag'][0]), 'snapshots/.snapshot': '/proc/kmsg'}
        self.refused([tool('vest_bringup', 'vest_resimulate'), '{}'], files, '/snapshots/.snapshot: ', status=2)

    def test_a_table_that_is_refused_leaves_no_scene_to_be_felt(self):
        volumes = {f[:1]: f[1:] for f in self.good['volume']}
        files = {'a.nrrd': volumes[b'0'], 'table.csv': b'value,nothing\n0,1\n'}
        feel = [tool('vest_tissue', 'vest_import'), 'feel', '{}/a.nrrd', '{}/out']
        self.refused(feel + ['--table', '{}/table.csv'], files, '/table.csv')
        self.refused(feel + ['--table', '{}/table.csv'], {**files, 'table.csv': b''}, '/table.csv')
        self.refused(feel, {'a.nrrd': volumes[b'0']}, '/a.nrrd: the shipped table is for values in HU')

    def test_a_bake_that_loses_a_label_says_so_as_its_one_verdict(self):
        head = b'NRRD0004\ntype: uint8\ndimension: 3\nsizes: 40 40 40\nspace: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\n\n'
        radius = [((x - 20) ** 2 + (y - 20) ** 2 + (z - 20) ** 2) ** 0.5 for z in range(40) for y in range(40) for x in range(40)]
        shell = head + bytes(2 if 15 <= r < 18 else 1 if r < 9 else 0 for r in radius)  # thin, as a skull is
        solid = head + bytes(r < 18 for r in radius)
        first = b'vest_patient: 1\nname: head\nlabels: a.nrrd\ntissues:\n  - {label: 1, name: core, tissue: liver}\n'
        of_shell = first + b'  - {label: 2, name: shell, tissue: bone}\nheld: [shell]\n'
        for image, recipe, verdict, status in (
                (shell, of_shell + b'cell: 4\n', r'NOT good: shell: \S+ ml of voxels became \S+ ml of elements, with cell 4: .*take a smaller cell', 1),
                (shell, of_shell + b'cell: 3\n', 'good$', 0), (solid, first + b'cell: 2\nintegrator: elastostatic\n', 'NOT good: it does not start: .*free nodes', 1)):
            code, lines, _ = refusal([tool('vest_tissue', 'vest_import'), 'bake', '{}'], {'a.nrrd': image, 'patient.yaml': recipe})
            self.assertEqual(code, status, lines)
            self.assertRegex(lines[-1], verdict)
            self.assertEqual([line for line in lines if line.startswith(('good', 'NOT good'))], lines[-1:])

    def test_a_pipe_beside_a_recording_is_not_waited_for(self):
        files = {'session.bag.active': self.good['bag'][0], 'session.bag.progress': None}
        code, lines, _ = refusal([tool('vest_bringup', 'vest_recover_bag'), '{}', '--output', '{}/out.bag'], files)
        self.assertEqual(code, 0, lines)
        self.assertIn('messages kept', lines[-1])

    def test_a_full_disk_is_no_success(self):
        box = {'box.yaml': hostile_kinds.read('vest_instruments', 'config', 'trainer_box.yaml')}
        urdf = [tool('vest_instruments', 'make_urdf'), '--box', '{}/box.yaml']
        self.refused(urdf + ['--output', '/dev/full'], box, '/dev/full: cannot be written')
        self.refused(['sh', '-c', '"$@" 2>&1 >/dev/full', 'sh'] + urdf, box, 'standard output: cannot be written')

    def test_links_where_a_tool_writes_lead_nowhere(self):
        bag, tube, pulse = self.good['bag'][0], hostile_kinds.kept('source', 'tube'), hostile_kinds.kept('network', 'bifurcation')
        model, recover = tool('vest_tissue', 'vest_model'), tool('vest_bringup', 'vest_recover_bag')
        bake = [model, 'bake', '{}/source.yaml', '{}/out']
        mine = b'mine\n' * 400
        for command, files, links in (
                ([recover, '{}'], {'session.bag.active': bag}, ['session.bag.recovering.active', 'session.bag.recovering.progress', 'session.json.part']),
                (bake, tube, ['out/tube.net.new', 'out/tube.yaml.new', 'out/source.yaml.new', 'out/tube.net']),
                (bake, {'source.yaml': b'vest_source: 1\nname: two\nobjects: []\ninclude: [{file: parts/a.yaml}]\n', 'parts/a.yaml': tube['source.yaml'].replace(b'vest_source: 1\nname: tube', b'vest_part: 1')}, ['out/parts/a.yaml']),
                ([tool('vest_effects', 'vest_pulse'), '{}', '--cycles', '1', '--dx', '0.02', '--output', '{}/out'], pulse, ['out/summary.csv', 'out/trunk_mid.csv'])):
            for link in links:
                with self.subTest(link), tempfile.NamedTemporaryFile() as victim:
                    victim.write(mine)
                    victim.flush()
                    code, lines, _ = refusal(command, {**files, link: victim.name})
                    self.assertEqual(code, 0, lines)
                    with open(victim.name, 'rb') as file:
                        self.assertEqual(file.read(), mine)
        for files, link in ((hostile_kinds.kept('source', 'tree'), 'out/tree'),):
            with tempfile.TemporaryDirectory() as elsewhere:
                code, lines, _ = refusal(bake, {**files, link: elsewhere})
                self.assertEqual(code, 1, lines)
                self.assertIn('/out/tree: a link', lines[-1])
                self.assertEqual(os.listdir(elsewhere), [])

    def test_reference_meshes_without_area_or_far_away_are_refused_by_name(self):
        for mesh in (b'v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n', b'v 1e38 0 0\nv 0 1e38 0\nv 0 0 1e38\nf 1 2 3\n'):
            with self.subTest(mesh):
                self.refused([tool('vest_tissue', 'vest_compare_anatomy'), '--reference', '{}'], {'VH_F_cervix.obj': mesh}, '/VH_F_cervix.obj: ', status=2)

    def test_a_picture_of_a_board_that_is_too_small_is_named(self):
        files = {'a.jpg': self.good['picture'][1], 'b.png': self.good['picture'][0]}
        self.refused([tool('vest_viz', 'vest_calibrate_camera'), '{}/b.png', '{}/a.jpg', '--output', '{}/out.yaml'], files, '/b.png: a picture of 64 x 48 pixels')


if __name__ == '__main__':
    unittest.main()
