"""The corpora of hostile_files.py: good files, which of them is damaged, and the tool that reads them."""
import os
import re
import sqlite3
import struct
import subprocess
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(HERE)


def read(*path):
    with open(os.path.join(ROOT, *path), 'rb') as file:
        return file.read()


def kept(reader, name):
    """Files of a kept input of fuzz/corpus: lines '=== NAME' begin the next."""
    first = {'scene': 'scene.yaml', 'rods': 'scene.yaml', 'source': 'source.yaml', 'network': 'case.json'}.get(reader, name)
    files, current = {}, first
    for line in read('fuzz', 'corpus', reader, name).splitlines(keepends=True):
        if line.startswith(b'=== '):
            current = line[4:].strip().decode()
            files[current] = b''
        else:
            files[current] = files.get(current, b'') + line
    return files


class Kind:
    """One corpus: files, which of them is damaged, and what reads them."""

    def __init__(self, name, files, target, command, named=None):
        self.name, self.files, self.target, self.command = name, files, target, command
        self.named = named or [os.path.basename(f) for f in files]


# Readers whose good files are made; others of them take minutes to make under sanitizers.
MADE = ('bag', 'dicom', 'drawing', 'picture', 'raw_log', 'reference', 'snapshot', 'trainees', 'volume')


def made(tool):
    """Good files that no folder keeps, as pixels and recordings: reader -> list of bytes."""
    with tempfile.TemporaryDirectory() as place:
        subprocess.run([tool('', 'vest_read'), 'keep', place, *MADE], check=True)
        return {r: [read(place, r, 'kept_%d' % i) for i in range(len(os.listdir(os.path.join(place, r))))] for r in os.listdir(place)}


def slices(good):
    """Those that are made: before them come those that a fuzzer left."""
    return good['dicom'][len(os.listdir(os.path.join(HERE, 'corpus', 'dicom'))):]


def restoring(bag):
    """A recording whose reset, told behind step length and seed, restores a snapshot that has no name."""
    changed, count = re.subn(re.escape(struct.pack('<d', 0.001)) + rb'....\x01(?=\0{4})', lambda m: m[0][:-1] + b'\x03', bag, flags=re.S)
    assert count == 1, '%d resets' % count
    return changed


def logged(database):
    """A database that a killed program left, and its log."""
    with tempfile.TemporaryDirectory() as place:
        path = os.path.join(place, 'a.db')
        with open(path, 'wb') as file:
            file.write(database)
        base = sqlite3.connect(path, isolation_level=None)
        base.execute('PRAGMA journal_mode=WAL')
        base.execute("UPDATE attempt SET date = '2026-02-02'")
        parts = [open(path + end, 'rb').read() for end in ('', '-wal', '-shm')]
        base.close()
        return parts


def kinds(tool):
    model = tool('vest_tissue', 'vest_model')
    two, surface, mesh, image, static = (kept('scene', n) for n in ('two', 'surface', 'mesh', 'image', 'static'))
    scene = [model, 'check', '{}/scene.yaml']
    reader = lambda name, target: [tool('', 'vest_read'), name, '{}/' + target]
    out = [Kind('scene.yaml', two, 'scene.yaml', scene)]
    for table in ('nodes.csv', 'links.csv', 'triangles.csv', 'tets.csv', 'ties.csv', 'loads.csv', 'floor.csv', 'fixed.csv'):
        out.append(Kind('scene: ' + table, two, table, scene))
    out.append(Kind('scene of sutures', kept('scene', 'suture'), 'scene.yaml', scene))
    out.append(Kind('static scene: fem.csv', static, 'fem.csv', [tool('vest_tissue', 'vest_simulate'), '{}/scene.yaml']))
    for ending, name in (('obj', 'obj'), ('obj', 'obj_quads'), ('stl', 'stl'), ('stl', 'stl_binary'), ('ply', 'ply'),
                         ('ply', 'ply_binary')):
        files = dict(surface)
        del files['cube.obj']
        files['cube.' + ending] = read('fuzz', 'corpus', 'surface', name)[1:]
        files['scene.yaml'] = files['scene.yaml'].replace(b'cube.obj', b'cube.' + ending.encode()).replace(
            b'    skin: skin.ply\n', b'').replace(b'cell: 0.011', b'cell: 0.011' if name == 'obj' else b'cell: 0.3')
        out.append(Kind('surface: ' + name, files, 'cube.' + ending, scene))
    out.append(Kind('skin.ply', surface, 'skin.ply', scene))
    for ending, name in (('msh', 'msh22'), ('msh', 'msh41'), ('vtk', 'vtk'), ('vtk', 'vtk51')):
        files = dict(mesh)
        del files['a.msh']
        files['a.' + ending] = read('fuzz', 'corpus', 'mesh', name)[1:]
        files['scene.yaml'] = files['scene.yaml'].replace(b'a.msh', b'a.' + ending.encode())
        out.append(Kind('mesh: ' + name, files, 'a.' + ending, scene))
    for target in ('scene.yaml', 'a.raw'):
        out.append(Kind('image: ' + target, image, target, scene))
    tube = {'scene.yaml': read('vest_tissue', 'scenes', 'tube', 'tube.yaml'), 'tube.net': read('vest_tissue', 'scenes', 'tube',
            'tube.net'), 'source.yaml': b'vest_source: 1\n'}
    out.append(Kind('baked net', tube, 'tube.net', scene))
    for name in ('tube', 'sheet', 'layers', 'tree', 'region'):
        out.append(Kind('source: ' + name, kept('source', name), 'source.yaml', [model, 'bake', '{}/source.yaml', '{}/out']))
    edits = (b'vest_edits: 1\nedits:\n  - {op: set, path: /name, value: other}\n'
             b'  - {op: set, path: /objects/tube/tube/centre/1, value: [0.001, 0.05, 0.06]}\n'
             b'  - {op: insert, path: /objects/tube/tube/sections/-, value: {at: 0.5, radii: [0.004]}}\n  - {op: undo}\n'
             b'  - {op: insert, path: /objects/-, value: {name: b, mirror_of: tube}}\n  - {op: remove, path: /objects/b}\n')
    drawn = dict(kept('source', 'tube'), **{'edits.yaml': edits})
    out.append(Kind('edits', drawn, 'edits.yaml', [model, 'edit', '{}/source.yaml', '--script', '{}/edits.yaml', '-o', '{}/out'],
                    ['edits.yaml', 'source.yaml', 'other.yaml']))
    out.append(Kind('source that is edited', drawn, 'source.yaml', [model, 'edit', '{}/source.yaml', '--script', '{}/edits.yaml', '-o', '{}/out'],
                    ['edits.yaml', 'source.yaml', 'other.yaml']))
    out.append(Kind('source to which a part is added', drawn, 'source.yaml', [model, 'add', '{}/source.yaml', 'bowel', '-o', '{}/out'],
                    ['source.yaml', 'tube.yaml']))
    out.append(Kind('index of a library', {'index.yaml': read('fuzz', 'corpus', 'library', 'two')}, 'index.yaml', reader('library', 'index.yaml')))
    material = tool('vest_tissue', 'vest_material')
    out.append(Kind('materials.yaml', {'materials.yaml': read('vest_tissue', 'data', 'materials.yaml')}, 'materials.yaml',
                    [material, '--materials', '{}/materials.yaml', 'list']))
    out.append(Kind('measured curve', {'curve.csv': read('fuzz', 'corpus', 'curve', 'liver')}, 'curve.csv',
                    [material, 'fit', '{}/curve.csv']))
    network = kept('network', 'bifurcation')
    for target in sorted(network):
        out.append(Kind('blood flow: ' + target, network, target,
                        [tool('vest_effects', 'vest_pulse'), '{}', '--cycles', '1', '--dx', '0.02', '--output', '{}/out'],
                        sorted(network) + ['vest_pulse']))
    curve = b't_s,P_Pa,Q_m3_s\n0,1000,1e-6\n0.5,1200,2e-6\n1,1000,1e-6\n'
    out.append(Kind('curve that is drawn', {'result.csv': curve, 'reference.csv': curve}, 'reference.csv',
                    [os.path.join(ROOT, 'vest_effects', 'scripts', 'vest_pulse_svg'), '{}/result.csv', '{}/reference.csv', '{}/out.svg']))
    good = made(tool)
    volumes = {'.nrrd.mha.nii'.split('.')[1 + f[0] % 3]: f[1:] for f in good['volume']}
    image_tool, importer = tool('vest_tissue', 'vest_image'), tool('vest_tissue', 'vest_import')
    puncture = {n: read('vest_tissue', 'scenes', 'ct_puncture', n) for n in ('ct_puncture.yaml', 'needle.csv')}
    out.append(Kind('needle in an image', puncture, 'ct_puncture.yaml', [model, 'check', '{}/ct_puncture.yaml'], sorted(puncture)))
    out.append(Kind('table of colours', {'table.csv': read('vest_tissue', 'library', 'tables', 'bone.csv')}, 'table.csv', reader('table', 'table.csv')))
    out.append(Kind('needle\'s table', puncture, 'needle.csv', [model, 'check', '{}/ct_puncture.yaml'], sorted(puncture)))
    for name, bytes_ in [('slice', slices(good)[0])] + [('a.' + ending, f) for ending, f in volumes.items()]:
        out.append(Kind('patient\'s image: ' + name, {name: bytes_}, name, [image_tool, 'info', '{}/' + name]))
    out.append(Kind('label map', {'a.nii': volumes['nii']}, 'a.nii', [importer, 'new', '--labels', '{}/a.nii', '{}/out']))
    recipe = (b'vest_patient: 1\nname: box\nlabels: a.nii\ntissues:\n  - {label: 1, name: liver, tissue: liver}\ncell: 4\n'
              b'place: [0, 0.05, 0.03]\n')
    out.append(Kind('patient.yaml', {'a.nii': volumes['nii'], 'patient.yaml': recipe}, 'patient.yaml', [importer, 'bake', '{}'],
                    ['a.nii', 'patient.yaml', 'box']))
    rods = kept('rods', 'driven')
    for target in sorted(rods):
        out.append(Kind('rods: ' + target, rods, target, [tool('vest_tissue', 'vest_simulate'), '{}/scene.yaml', '--steps', '3'], sorted(rods)))
    out.append(Kind('sutures.yaml', {'sutures.yaml': read('vest_tissue', 'data', 'sutures.yaml')}, 'sutures.yaml',
                    reader('sutures', 'sutures.yaml')))
    out.append(Kind('exercise', {'exercise.yaml': read('vest_bringup', 'exercises', 'clip_cut_tube', 'exercise.yaml')}, 'exercise.yaml',
                    [tool('vest_bringup', 'vest_exercise'), 'show', '{}/exercise.yaml']))
    out.append(Kind('trainees', {'trainees.db': good['trainees'][0]}, 'trainees.db',
                    [tool('vest_bringup', 'vest_trainee'), '--database', '{}/trainees.db', 'export', 'first'],
                    ['trainees.db', "trainee 'first'"]))
    journal = b'\xd9\xd5\x05\xf9\x20\xa1\x63\xd7' + struct.pack('>5I', 1, 7, 4, 512, 4096)  # magic, pages, seed, size of the database, sector, page
    out.append(Kind('journal beside a database', {'trainees.db': good['trainees'][0], 'trainees.db-journal': journal.ljust(512, b'\0')}, 'trainees.db-journal',
                    [tool('vest_bringup', 'vest_trainee'), '--database', '{}/trainees.db', 'list']))
    batch = os.path.join(ROOT, 'vest_bringup', 'scripts', 'vest_batch')
    manifest = (b'vest_batch: 1\ncommand: [echo, "{scene}", --steps, "{steps}"]\nparameters:\n  scene: [way.yaml, manifest.yaml]\n'
                b'  steps: [100, 200, 300]\nruns:\n  - {a: 1}\n  - {a: 2}\nfiles: [scene]\nversion: 3\n')
    out.append(Kind('batch', {'manifest.yaml': manifest, 'way.yaml': b'1\n'}, 'manifest.yaml', [batch, 'plan', '{}/manifest.yaml', '{}/out'],
                    ['manifest.yaml', 'way.yaml']))
    plan = b'[\n{"id": "%s", "parameters": {"a": 1}, "argv": ["echo", "1"]}\n]\n' % (b'0f' * 32)
    out.append(Kind('plan of a batch', {'plan.json': plan}, 'plan.json', [batch, 'status', '{}'], ['plan.json', 'runs']))
    planned = b'[\n{"id": "%s", "parameters": {"a": "one"}, "argv": ["echo", "1"]}\n]\n' % (b'0f' * 32)
    for name in ('result of a run', 'parameters of a plan'):
        result = b'{"id": "%s", "parameters": {}, "values": {"x": 1.5, "y": "two"}}\n' % (b'0f' * 32)
        files = {'plan.json': planned, os.path.join('runs', '0f' * 32): result}
        target = '0f' * 32 if name == 'result of a run' else 'plan.json'
        out.append(Kind(name, files, next(f for f in files if f.endswith(target)), [batch, 'merge', '{}', '--output', '{}/out.csv'], ['plan.json', '0f' * 32, 'runs']))
    for file in good['picture'][:2]:
        ending = 'png' if file[:4] == b'\x89PNG' else 'jpg'
        out.append(Kind('picture: ' + ending, {'a.' + ending: file}, 'a.' + ending, reader('picture', 'a.' + ending), ['picture', 'a.' + ending]))
    for name, command in (('checked', ['vest_check_session', '{}']), ('recovered', ['vest_recover_bag', '{}/session.bag', '--output', '{}/out.bag']),
                          ('re-simulated', ['vest_resimulate', '{}'])):
        out.append(Kind('session.bag, ' + name, {'session.bag': good['bag'][0]}, 'session.bag',
                        [tool('vest_bringup', command[0])] + command[1:]))
    session = (b'{"version": "1", "scene_hash": "a", "state_hash": "b", "steps": 4, "real_time_factor": null, "rates": {"t": 1.0},\n'
               b'"events": [{"t": 0.5, "name": "cut"}], "ended": "stopped"}\n')
    out.append(Kind('session.json', {'session.bag': good['bag'][0], 'session.json': session}, 'session.json',
                    [tool('vest_bringup', 'vest_check_session'), '{}'], ['session.json', 'session.bag']))
    out.append(Kind('recorded drawing', {'drawing.bag': good['drawing'][0]}, 'drawing.bag', [tool('vest_bringup', 'vest_replay_model'), '{}/drawing.bag']))
    out.append(Kind('snapshot', {'snapshot': good['snapshot'][0]}, 'snapshot', reader('snapshot', 'snapshot')))
    out.append(Kind('snapshot beside a recording', {'session.bag': restoring(good['bag'][0]), 'snapshots/.snapshot': good['snapshot'][0]}, 'snapshots/.snapshot',
                    [tool('vest_bringup', 'vest_resimulate'), '{}']))
    out.append(Kind('reference group', {'reference.json': good['reference'][0]}, 'reference.json', reader('reference', 'reference.json')))
    pelvis = {n: read('vest_effects', 'data', 'vessels', 'pelvis', n)
              for n in ('case.json', 'network.csv', 'inflow.csv', 'vessels.yaml')}
    box = read('vest_instruments', 'config', 'trainer_box.yaml')
    out.append(Kind('trainer box', {'box.yaml': box}, 'box.yaml', [tool('vest_instruments', 'make_urdf'), '--box', '{}/box.yaml']))
    out.append(Kind('urdf', {'arm.urdf': read('fuzz', 'corpus', 'urdf', 'arm')}, 'arm.urdf',
                    [tool('vest_instruments', 'make_urdf'), '--check', '{}/arm.urdf']))
    out.append(Kind('waypoints', {'way.yaml': read('fuzz', 'corpus', 'waypoints', 'two'), 'box.yaml': box}, 'way.yaml',
                    [tool('vest_instruments', 'trajectory_from_waypoints'), '{}/way.yaml', '--box', '{}/box.yaml', '--output',
                     '{}/out.csv']))
    out.append(Kind('recorded motion', {'motion.csv': read('fuzz', 'corpus', 'motion', 'turn'), 'box.yaml': box}, 'motion.csv',
                    [tool('vest_instruments', 'trajectory_from_motion'), '{}/motion.csv', '--box', '{}/box.yaml', '--output',
                     '{}/out.csv']))
    emulator = [tool('vest_hw_phantom_box', 'phantom_box_emulator'), '--seconds', '0.01']
    out.append(Kind('calibration', {'c.yaml': read('vest_hw_phantom_box', 'config', 'default.yaml')}, 'c.yaml',
                    emulator + ['--calibration', '{}/c.yaml']))
    out.append(Kind('trajectory', {'t.csv': read('fuzz', 'corpus', 'trajectory', 'arm')}, 't.csv',
                    emulator + ['--trajectory', '{}/t.csv', '--interpolation', 'cubic']))
    out.append(Kind('raw log', {'raw.log': good['raw_log'][0]}, 'raw.log', emulator + ['--replay', '{}/raw.log']))
    # Read by nodes and inside a running session: their reader alone.
    out.append(Kind('input map', {'inputs.yaml': read('vest_instruments', 'config', 'inputs.yaml')}, 'inputs.yaml',
                    reader('input_map', 'inputs.yaml')))
    out.append(Kind('input events', {'pad.csv': read('fuzz', 'corpus', 'events', 'pad')}, 'pad.csv', reader('events', 'pad.csv'),
                    ['events.csv', 'pad.csv']))
    out.append(Kind('haptic motion', {'hand.csv': read('fuzz', 'corpus', 'haptic_motion', 'hand')}, 'hand.csv',
                    reader('haptic_motion', 'hand.csv'), ['hand.csv', 'motion.csv']))
    out.append(Kind('camera', {'c.yaml': read('fuzz', 'corpus', 'camera', 'scope')}, 'c.yaml', reader('camera', 'c.yaml'),
                    ['c.yaml', 'camera.yaml']))
    out.append(Kind('instrument', {'a.stl': read('vest_instruments', 'meshes', 'injection_needle_fixed.stl')}, 'a.stl',
                    reader('instrument', 'a.stl'), ['a.stl', 'shaft.stl']))
    out.append(Kind('motion table', {'table.csv': read('fuzz', 'corpus', 'motion_table', 'two_tools')}, 'table.csv',
                    [tool('vest_bringup', 'vest_metrics'), '{}/table.csv', '--json']))
    whole = b''.join((b'' if n == 'case.json' else b'\n=== ' + n.encode() + b'\n') + pelvis[n]
                     for n in ('case.json', 'network.csv', 'inflow.csv', 'vessels.yaml'))
    out += at_work(tool, good, volumes)
    out.append(Kind('vessels of the pelvis', {'all': whole}, 'all', reader('network', 'all'), sorted(pelvis) + ['/vest_fuzz_', '/all']))
    return out


def at_work(tool, good, volumes):
    """What else reads such files: programs that simulate, play, score, write and compare."""
    model, importer, image = (tool('vest_tissue', name) for name in ('vest_model', 'vest_import', 'vest_image'))
    bringup = lambda name: tool('vest_bringup', name)
    two, static, tube = kept('scene', 'two'), kept('scene', 'static'), kept('source', 'tube')
    way = (b'rate: 100\ninstruments:\n  endoscope:\n    - {t: 0.0, tip: [0.0, -0.02, 0.125], jaw: 0.0}\n    - {t: 0.05, tip: [0.0, 0.02, 0.11], jaw: 0.0}\n'
           b'  left:\n    - {t: 0, tip: [-0.02, 0.0, 0.06], roll: 0, jaw: 0.5}\n    - {t: 0.05, tip: [-0.01, 0.01, 0.06], jaw: 0.1, through: true}\n'
           b'tools: {left: grasper}\neffects: {lens: {start_temperature: 300}}\npictures: [0.01]\n')
    played = dict(two, **{'way.yaml': way})
    rehearse = [bringup('vest_rehearse'), '{}/way.yaml', '--scene', '{}/scene.yaml', '--seconds', '0.02']
    place = ('vest_bringup', 'exercises', 'look_round')
    exercise = {'exercise.yaml': read(*place, 'exercise.yaml'), 'pass.yaml': read(*place, 'pass.yaml'), 'post_never_turned.yaml': read(*place, 'post_never_turned.yaml')}
    run = [bringup('vest_exercise'), 'run', '{}/exercise.yaml', '--script', '{}/way.yaml', '--output', '{}/out']
    out = [Kind('scene that comes to rest', two, 'scene.yaml', [model, 'settle', '{}/scene.yaml', '--seconds', '0.01']),
           Kind('scene that is simulated', two, 'scene.yaml', [tool('vest_tissue', 'vest_simulate'), '{}/scene.yaml', '--steps', '3']),
           Kind('scene of sutures, simulated', kept('scene', 'suture'), 'scene.yaml', [tool('vest_tissue', 'vest_simulate'), '{}/scene.yaml', '--steps', '3']),
           Kind('scene that is played', played, 'scene.yaml', rehearse),
           Kind('waypoints that are played', played, 'way.yaml', rehearse),
           Kind('exercise that is played', dict(exercise, **{'way.yaml': way}), 'exercise.yaml', run),
           Kind('script of an exercise', dict(exercise, **{'way.yaml': way}), 'way.yaml', run),
           Kind('tools of an exercise', exercise, 'exercise.yaml', [bringup('vest_exercise'), 'tools', '{}/exercise.yaml']),
           Kind('edits that are proposed', tube, 'source.yaml', [model, 'propose', '{}/source.yaml', 'tube'])]
    out += [Kind('static scene: ' + target, static, target, [tool('vest_tissue', 'vest_simulate'), '{}/scene.yaml', '--static'])
            for target in sorted(static) if target != 'fem.csv']
    for name, arguments in (('listed', ['list']), ('shown', ['show', 'first']), ('with progress', ['progress', 'first', '--exercise', 'lift_tube']),
                            ('of a group', ['reference', '--exercise', 'lift_tube', '--of', 'first']), ('erased', ['erase', 'first'])):
        out.append(Kind('trainees, ' + name, {'trainees.db': good['trainees'][0]}, 'trainees.db',
                        [bringup('vest_trainee'), '--database', '{}/trainees.db', *arguments], ['trainees.db', "trainee 'first'"]))
    materials = {'materials.yaml': read('vest_tissue', 'data', 'materials.yaml')}
    out.append(Kind('material that is plotted', materials, 'materials.yaml',
                    [tool('vest_tissue', 'vest_material'), '--materials', '{}/materials.yaml', 'plot', 'liver', '--output', '{}/out.svg']))
    table = {'a.nii': volumes['nii'], 'table.csv': read('vest_tissue', 'scenes', 'ct_puncture', 'needle.csv')}
    feel = [importer, 'feel', '{}/a.nii', '{}/out', '--table', '{}/table.csv']
    out += [Kind('image that is felt', table, 'a.nii', feel), Kind('table of what is felt', table, 'table.csv', feel)]
    out += [Kind('image that is exported: a.' + ending, {'a.' + ending: file}, 'a.' + ending, [image, 'export', '{}/a.' + ending, '{}/out.nrrd'])
            for ending, file in volumes.items()]
    out += [Kind('slice of form %d' % i, {'slice': file}, 'slice', [image, 'probe', '{}/slice', '0', '0', '0']) for i, file in enumerate(slices(good)) if i > 0]
    session = {'session.bag': good['bag'][0]}
    out.append(Kind('session that is scored', dict(session, **exercise), 'session.bag', [bringup('vest_score'), '{}', '--exercise', '{}/exercise.yaml']))
    out.append(Kind('exercise that is scored', dict(session, **exercise), 'exercise.yaml', [bringup('vest_score'), '{}', '--exercise', '{}/exercise.yaml']))
    out.append(Kind('session that is exported', session, 'session.bag', [bringup('vest_export'), '--to', 'csv', '--output', '{}/out', '{}']))
    tables = {n: read('fuzz', 'corpus', 'motion_table', 'two_tools') for n in ('a.csv', 'b.csv')}
    out.append(Kind('motion of a cohort', tables, 'b.csv', [bringup('vest_metrics'), '{}/a.csv', '--cohort', '{}/b.csv']))
    database, log, index = logged(good['trainees'][0])
    listed = [bringup('vest_trainee'), '--database', '{}/trainees.db', 'list']
    whole = {'trainees.db': database, 'trainees.db-wal': log, 'trainees.db-shm': index}
    out += [Kind(name, whole, target, listed, ['trainees.db', "trainee 'first'"])
            for name, target in (('log beside a database', 'trainees.db-wal'), ('index of that log', 'trainees.db-shm'))]
    out.append(Kind('trainees, with a curriculum', {'trainees.db': good['trainees'][0]}, 'trainees.db',
                    [bringup('vest_trainee'), '--database', '{}/trainees.db', 'curriculum', 'first', '--exercises', 'lift_tube'], ['trainees.db', "trainee 'first'"]))
    series = {'s/%d.dcm' % i: slices(good)[0] for i in range(3)}
    out.append(Kind('slice among others', series, 's/1.dcm', [image, 'info', '{}/s'], ['/s', '.dcm']))
    apart = {'a.nrrd': b'NRRD0004\ntype: short\ndimension: 3\nsizes: 4 4 4\nspace: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n'
                       b'space origin: (0,0,0)\nendian: little\nencoding: raw\ndata file: a.raw\n\n', 'a.raw': bytes(range(128))}
    out += [Kind('image of two files: ' + target, apart, target, [image, 'info', '{}/a.nrrd']) for target in sorted(apart)]
    killed = {'session.bag.active': good['bag'][0], 'session.bag.progress': struct.pack('<2Q', 12, 0)}
    out += [Kind('killed session: ' + target, killed, target, [bringup('vest_recover_bag'), '{}', '--output', '{}/out.bag']) for target in sorted(killed)]
    if tool('vest_tissue', 'vest_compare_anatomy'):  # of developers
        mesh = {'VH_F_cervix.obj': read('fuzz', 'corpus', 'surface', 'obj')[1:]}
        out.append(Kind('reference mesh', mesh, 'VH_F_cervix.obj', [tool('vest_tissue', 'vest_compare_anatomy'), '--reference', '{}', '--limit', '1000000'],
                        ['VH_F_cervix.obj', 'holds none']))
    hands = {'map.yaml': b'instruments:\n  left: {source: haptic, device: replay}\n  right: {source: box}\n'}
    out.append(Kind('map of haptic devices', hands, 'map.yaml', [os.path.join(ROOT, 'vest_haptics', 'scripts', 'start_devices'), '{}/map.yaml', '--list']))
    if tool('vest_viz', 'vest_calibrate_camera'):  # the sanitizers' build leaves the view out
        pictures = {'a.jpg': good['picture'][1], 'b.png': good['picture'][0]}
        out.append(Kind('pictures of a board', pictures, 'a.jpg', [tool('vest_viz', 'vest_calibrate_camera'), '{}/b.png', '{}/a.jpg', '--output', '{}/out.yaml']))
        out.append(Kind('picture that is judged', {'b.png': good['picture'][0]}, 'b.png', [tool('vest_viz', 'vest_check_picture'), '{}/b.png']))
    return out
