#!/usr/bin/env python3
"""The largest file that the limits of each reader allow, or nearly, given to the tool that reads it.

usage: fuzz/largest_files.py [--devel FOLDER] [--only WORDS]

Prints what each cost. Exit 1 where one took more than 5 s of processor time or 1 GB, crashed, or was refused
without its name. The option --devel names the devel space of a build (default: build/test/devel).
"""
import argparse
import gzip
import math
import os
import shutil
import sqlite3
import struct
import sys
import tempfile

import hostile_files
from hostile_kinds import ROOT, Kind, kept, made, read

MIB = 1 << 20
PATIENCE = 60  # s of processor time, after which one is ended


def repeated(head, line, size):
    """A text of just less than `size` bytes: head, then line(0), line(1)…"""
    parts, total, n = [head], len(head), 0
    while True:
        one = line(n)
        total += len(one)
        if total >= size:
            return b''.join(parts)
        parts.append(one)
        n += 1


def rows(head, line, count):
    return head + b''.join(line(n) for n in range(count))


def grid(n, m, cell=0.001):
    """A sheet of n x m knots: the lines of nodes, of triangles."""
    nodes = b'node,x,y,z\n' + b''.join(b'%d,%g,%g,0.05\n' % (j * n + i, cell * i, cell * j) for j in range(m) for i in range(n))
    corners = [(j * n + i, j * n + i + 1, (j + 1) * n + i + 1, (j + 1) * n + i) for j in range(m - 1) for i in range(n - 1)]
    return nodes, b'n0,n1,n2\n' + b''.join(b'%d,%d,%d\n%d,%d,%d\n' % (a, b, c, a, c, d) for a, b, c, d in corners)


def springs(n, m):
    at = lambda i, j: j * n + i
    lines = [b'%d,%d\n' % (at(i, j), at(i + 1, j)) for j in range(m) for i in range(n - 1)]
    lines += [b'%d,%d\n' % (at(i, j), at(i, j + 1)) for j in range(m - 1) for i in range(n)]
    lines += [b'%d,%d\n' % (at(i, j), at(i + 1, j + 1)) for j in range(m - 1) for i in range(n - 1)]
    lines += [b'%d,%d\n' % (at(i + 1, j), at(i, j + 1)) for j in range(m - 1) for i in range(n - 1)]
    return b'n0,n1\n' + b''.join(lines)


HEAD = b'vest_scene: 1\nname: large\ngravity: [0, 0, -9.81]\nsolution: {integrator: newton_euler, dt: 0.001}\nobjects:\n'
NET = (b'  - {name: %s, model: net, nodes: %s, links: links.csv, fixed: fixed.csv, triangles: triangles.csv, knot_mass: 1e-5, link_area: 1e-6, '
       b'material: {youngs_modulus: 6000, density: 1000, rayleigh_mass: 2}}\n')


def sheet_scene(n, m):
    nodes, triangles = grid(n, m)
    fixed = b'node\n' + b''.join(b'%d\n' % i for i in range(n))
    return {'scene.yaml': HEAD + NET % (b'sheet', b'nodes.csv'), 'nodes.csv': nodes, 'links.csv': springs(n, m), 'triangles.csv': triangles, 'fixed.csv': fixed}


def block(n, m, k, cell=0.002):
    """A block of cubes of five tetrahedra each."""
    at = lambda i, j, l: (l * (m + 1) + j) * (n + 1) + i
    nodes = b'node,x,y,z\n' + b''.join(b'%d,%g,%g,%g\n' % (at(i, j, l), cell * i, cell * j, 0.05 + cell * l) for l in range(k + 1) for j in range(m + 1) for i in range(n + 1))
    five = (((0, 1, 3, 4), (1, 2, 3, 6), (1, 4, 6, 5), (3, 4, 7, 6), (1, 3, 4, 6)), ((0, 1, 2, 5), (0, 2, 3, 7), (0, 5, 7, 4), (2, 5, 6, 7), (0, 2, 7, 5)))
    lines = []
    for l in range(k):
        for j in range(m):
            for i in range(n):
                c = [at(i, j, l), at(i + 1, j, l), at(i + 1, j + 1, l), at(i, j + 1, l), at(i, j, l + 1), at(i + 1, j, l + 1), at(i + 1, j + 1, l + 1), at(i, j + 1, l + 1)]
                lines += [b'%d,%d,%d,%d\n' % tuple(c[v] for v in t) for t in five[(i + j + l) % 2]]
    return nodes, b'n0,n1,n2,n3\n' + b''.join(lines)


FEM = (b'  - {name: %s, model: fem, strain: %s, nodes: %s, tetrahedra: %s, fixed_boxes: [[[-1, -1, -1], [1, 1, %g]]], '
       b'material: {youngs_modulus: 6000, poisson_ratio: 0.4, density: 1000, rayleigh_mass: 1, rayleigh_stiffness: 0.01}}\n')


def block_scene(strain, fixed_up_to, *size):
    nodes, tets = block(*size)
    return {'scene.yaml': HEAD + FEM % (b'block', strain, b'nodes.csv', b'tets.csv', fixed_up_to), 'nodes.csv': nodes, 'tets.csv': tets}


def cube_scene(count, side, cuts=1):
    """Rigid boxes beside a small net."""
    files = dict(kept('scene', 'two'))
    half = side / 2
    ends = [(-half, -half, -half), (half, -half, -half), (half, half, -half), (-half, half, -half), (-half, -half, half), (half, -half, half), (half, half, half), (-half, half, half)]
    files['box.csv'] = b'node,x,y,z\n' + b''.join(b'%d,%g,%g,%g\n' % (i, x + 1, y + 1, z + 1) for i, (x, y, z) in enumerate(ends))
    faces = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), (0, 1, 5), (0, 5, 4), (1, 2, 6), (1, 6, 5), (2, 3, 7), (2, 7, 6), (3, 0, 4), (3, 4, 7)]
    files['faces.csv'] = b'n0,n1,n2\n' + b''.join(b'%d,%d,%d\n' % f for f in faces)
    box = (b'  - {name: box%d, model: rigid, nodes: box.csv, links: none.csv, knot_mass: 1, link_area: 1e-5, triangles: faces.csv, material: {youngs_modulus: 6000}}\n')
    scene = files['scene.yaml'].replace(b'connections:', b''.join(box % i for i in range(count)) + b'connections:')
    return dict(files, **{'scene.yaml': scene})


def fan_scene(triangles, side):
    """A rigid fan: each triangle is as long as the object, so that each covers much of the grid of its walls."""
    files = dict(kept('scene', 'two'))
    nodes = [(0.0, 0.0, 0.0)] + [(side * i / triangles, side * (1 - i / triangles), side * (i % 97) / 97) for i in range(triangles + 1)]
    files['box.csv'] = b'node,x,y,z\n' + b''.join(b'%d,%.9g,%.9g,%.9g\n' % (i, x + 0.2, y + 0.2, z + 0.2) for i, (x, y, z) in enumerate(nodes))
    files['faces.csv'] = b'n0,n1,n2\n' + b''.join(b'0,%d,%d\n' % (i + 1, i + 2) for i in range(triangles))
    box = b'  - {name: fan, model: rigid, nodes: box.csv, links: none.csv, knot_mass: 1, link_area: 1e-5, triangles: faces.csv, material: {youngs_modulus: 6000}}\n'
    return dict(files, **{'scene.yaml': files['scene.yaml'].replace(b'connections:', box + b'connections:')})


def ball(n):
    """Vertices and triangles of a ball of 2n(n-1) triangles."""
    vertices, triangles = [(0, 0, 0.04)], []
    for i in range(1, n):
        for j in range(n):
            a, b = math.pi * i / n, 2 * math.pi * j / n
            vertices.append((0.01 * math.sin(a) * math.cos(b), 0.01 * math.sin(a) * math.sin(b), 0.05 - 0.01 * math.cos(a)))
    vertices.append((0, 0, 0.06))
    last = len(vertices) - 1
    for j in range(n):
        k = (j + 1) % n
        triangles.append((0, 1 + k, 1 + j))
        triangles.append((last, last - n + j, last - n + k))
        for i in range(n - 2):
            a, b = 1 + i * n + j, 1 + i * n + k
            triangles += [(a, b, b + n), (a, b + n, a + n)]
    return vertices, triangles


def surface_scene(ending, n, cell):
    vertices, triangles = ball(n)
    if ending == 'obj':
        data = b''.join(b'v %.9g %.9g %.9g\n' % v for v in vertices) + b''.join(b'f %d %d %d\n' % (a + 1, b + 1, c + 1) for a, b, c in triangles)
    elif ending == 'ply':
        data = (b'ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n' %
                (len(vertices), len(triangles)) + b''.join(b'%.9g %.9g %.9g\n' % v for v in vertices) + b''.join(b'3 %d %d %d\n' % t for t in triangles))
    else:
        data = bytes(80) + struct.pack('<I', len(triangles)) + b''.join(struct.pack('<12fH', 0, 0, 0, *vertices[a], *vertices[b], *vertices[c], 0) for a, b, c in triangles)
    scene = (b'  - {name: lump, model: volume, surface: ball.%s, cell: %g, fixed_boxes: [[[-1, -1, -1], [1, 1, 0.042]]], '
             b'material: {youngs_modulus: 6000, poisson_ratio: 0.4, density: 1000}}\n' % (ending.encode(), cell))
    return {'scene.yaml': HEAD + scene, 'ball.' + ending: data}


def msh(nodes):
    """A file of gmsh 2.2: that many nodes, and about as many tetrahedra."""
    side = int(nodes ** (1 / 3))
    at = lambda i, j, k: 1 + (k * side + j) * side + i
    points = [b'%d %d %d %d\n' % (at(i, j, k), i, j, k) for k in range(side) for j in range(side) for i in range(side)]
    tets = []
    for k in range(side - 1):
        for j in range(side - 1):
            for i in range(side - 1):
                tets.append(b'%d 4 2 1 1 %d %d %d %d\n' % (len(tets) + 1, at(i, j, k), at(i + 1, j, k), at(i, j + 1, k), at(i, j, k + 1)))
    return (b'$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n' % len(points) + b''.join(points) + b'$EndNodes\n$Elements\n%d\n' % len(tets) + b''.join(tets) + b'$EndElements\n')


def database(size):
    """Trainees with attempts, of nearly that many bytes."""
    def grow(good, place):
        path = os.path.join(place, 'trainees.db')
        with open(path, 'wb') as file:
            file.write(good)
        connection = sqlite3.connect(path)
        columns = [row[1] for row in connection.execute('PRAGMA table_info(attempt)')]
        row = connection.execute('SELECT * FROM attempt').fetchone()
        row = dict(zip(columns, row))
        row['json'] = '{"total": 3.5, "note": "' + 'x' * 1000 + '"}'
        names = [c for c in columns if c != 'id']
        for _ in range(size // 1200):
            connection.execute('INSERT INTO attempt (%s) VALUES (%s)' % (','.join(names), ','.join('?' * len(names))), [row[c] for c in names])
        connection.commit()
        connection.close()
        with open(path, 'rb') as file:
            return file.read()
    return grow


def flow_tree(size):
    """Blood flow: a tree of vessels, of nearly that many bytes."""
    head = b'id,name,node_in,node_out,length_m,r_prox_m,r_dist_m,h_prox_m,h_dist_m,E_Pa,P_ref_Pa,terminal,R1_Pa_s_m3,R2_Pa_s_m3,C_m3_Pa,P_out_Pa\n'
    count = size // 80
    line = lambda n: b'%d,v%d,%d,%d,0.01,0.002,0.002,0.0004,0.0004,600000,9500,%s\n' % (n + 1, n, (n + 1) // 2 + 1, n + 2, b'0,0,0,0,0' if 2 * n + 2 <= count else b'1,8e7,3e9,4e-10,0')
    return dict(kept('network', 'bifurcation'), **{'network.csv': head + b''.join(line(n) for n in range(count))})


def largest(tool, good):
    """What is the largest of each kind: Kind; named by what is large in it."""
    model, simulate = tool('vest_tissue', 'vest_model'), tool('vest_tissue', 'vest_simulate')
    reader = lambda name, target: [tool('', 'vest_read'), name, '{}/' + target]
    box = read('vest_instruments', 'config', 'trainer_box.yaml')
    emulator = [tool('vest_hw_phantom_box', 'phantom_box_emulator'), '--seconds', '0.01']
    joints = [side + a for side in ('left_', 'right_') for a in ('yaw', 'pitch', 'insertion', 'roll', 'jaw')]

    def one(name, target, data, command, named=None, beside=None):
        return Kind(name, dict(beside or {}, **{target: data}), target, command, named)

    hand = b't_s,px_mm,py_mm,pz_mm,qx,qy,qz,qw\n'
    yield 'trajectory: 720,000 rows', lambda: one('', 't.csv', rows(('t_s,' + ','.join(joints) + '\n').encode(), lambda n: b'%.2f,0.%d,0.1,0.05,-0.1,0.2,-0.1,0.1,0.06,0.2,0.3\n' % (0.01 * n, n % 10), 720000),
                                                  emulator + ['--trajectory', '{}/t.csv', '--interpolation', 'cubic'])
    yield 'trajectory: 128 MB', lambda: one('', 't.csv', repeated(('t_s,' + ','.join(joints) + '\n').encode(), lambda n: b'%d.25' % n + b',0.12345678901234567' * 10 + b'\n', 128 * MIB),
                                            emulator + ['--trajectory', '{}/t.csv', '--interpolation', 'cubic'])
    from_motion = [tool('vest_instruments', 'trajectory_from_motion'), '{}/motion.csv', '--box', '{}/box.yaml', '--output', '{}/out.csv']
    yield 'recorded motion: 600,000 samples', lambda: one('', 'motion.csv', rows(hand, lambda n: b'%.3f,1.25,2.%d,3.75,0,0,0,1\n' % (0.001 * n, n % 10), 600000), from_motion, beside={'box.yaml': box})
    yield 'recorded motion: 64 MB of 256 columns', lambda: one('', 'motion.csv', repeated(hand[:-1] + b''.join(b',c%d' % n for n in range(248)) + b'\n', lambda n: b'%.3f,1,2,3,0,0,0,1' % (0.001 * n) + b',0' * 248 + b'\n', 64 * MIB),
                                                               from_motion, beside={'box.yaml': box})
    yield 'haptic motion: 1,200,000 rows', lambda: one('', 'hand.csv', rows(hand, lambda n: b'%.3f,1.25,2.%d,3.75,0,0,0,1\n' % (0.001 * n, n % 10), 1200000), reader('haptic_motion', 'hand.csv'), ['hand.csv', 'motion.csv'])
    yield 'haptic motion: 60 MB of 256 columns', lambda: one('', 'hand.csv', repeated(hand[:-1] + b''.join(b',c%d' % n for n in range(248)) + b'\n', lambda n: b'%.3f,1,2,3,0,0,0,1' % (0.001 * n) + b',0' * 248 + b'\n', 60 * MIB),
                                                             reader('haptic_motion', 'hand.csv'), ['hand.csv', 'motion.csv'])
    metrics = [tool('vest_bringup', 'vest_metrics'), '{}/table.csv', '--json']
    pose = (b'x_m', b'y_m', b'z_m', b'qx', b'qy', b'qz', b'qw', b'jaw_rad')
    head = lambda count: b't_s,' + b','.join(b'a%d_%s' % (t, c) for t in range(count) for c in pose) + b'\n'
    # 128 MB are less than its rows of that length would be.
    yield 'motion table: 750,000 rows, two tools', lambda: one('', 'table.csv', rows(head(2), lambda n: b'%.2f' % (0.01 * n) + b',0.%d,0.2,0.3,0,0,0,1,0.5' % (n % 10) * 2 + b'\n', 750000), metrics)
    yield 'motion table: 499,999 rows, two tools, filtered', lambda: one('', 'table.csv', rows(head(2), lambda n: b'%.3f' % (0.01 * n + (n % 7 == 3) * 0.001) + b',0.%d,0.2,0.3,0,0,0,1,0.5' % (n % 10) * 2 + b'\n', 499999), metrics)
    yield 'motion table: 999,999 rows, filtered', lambda: one('', 'table.csv', rows(b't_s,a_x_m,a_y_m,a_z_m\n', lambda n: b'%.3f,0.%d,0,0\n' % (0.01 * n + (n % 7 == 3) * 0.001, n % 10), 999999), metrics)
    yield 'motion table: 12,096 rows, 124 tools', lambda: one('', 'table.csv', rows(head(124), lambda n: b'%d' % n + b',0,%d,0,0,0,0,1,0' % (n % 10) * 124 + b'\n', 12096), metrics)
    yield 'motion table: 1,000 columns, 128 MB', lambda: one('', 'table.csv', repeated(b't_s,a_x_m,a_y_m,a_z_m' + b''.join(b',c%d' % n for n in range(996)) + b'\n', lambda n: b'%d,0,%d,0' % (n, n % 10) + b',0' * 996 + b'\n', 128 * MIB), metrics)
    yield 'input events: 64 MB', lambda: one('', 'pad.csv', repeated(b't_s,type,code,value\n', lambda n: b'%d,EV_KEY,BTN_0,1\n' % n, 64 * MIB), reader('events', 'pad.csv'), ['events.csv', 'pad.csv'])
    log = good['raw_log'][0][:good['raw_log'][0].index(bytes(8))]  # its first line
    for size, count in ((51, 8000000), (1, 41000000)):
        yield 'log of raw bytes: %d pieces' % count, lambda n=count, size=size: one('', 'raw.log', log + (struct.pack('<QI', 0, size) + b'V' * size) * n, emulator + ['--replay', '{}/raw.log'])
    yield 'calibration: 1 MB', lambda: one('', 'c.yaml', repeated(read('vest_hw_phantom_box', 'config', 'default.yaml'), lambda n: b'x%d: {per_count: 0.0001}\n' % n, MIB), emulator + ['--calibration', '{}/c.yaml'])
    yield 'waypoints: 100,000 values', lambda: one('', 'way.yaml', b'rate: 20\ninstruments:\n  left:\n' + b''.join(b'    - {t: %g, tip: [-0.02, 0.0, 0.06]}\n' % (0.5 * n) for n in range(11000)),
                                                   [tool('vest_instruments', 'trajectory_from_waypoints'), '{}/way.yaml', '--box', '{}/box.yaml', '--output', '{}/out.csv'], beside={'box.yaml': box})
    yield 'waypoints: 1,000,000 rows', lambda: one('', 'way.yaml', b'rate: 1000\ninstruments:\n  left:\n' + b''.join(b'    - {t: %g, tip: [-0.02, 0.0, 0.06]}\n' % (999.0 * n) for n in range(2)),
                                                   [tool('vest_instruments', 'trajectory_from_waypoints'), '{}/way.yaml', '--box', '{}/box.yaml', '--output', '{}/out.csv'], beside={'box.yaml': box})
    yield 'index of a library: 4 MB', lambda: one('', 'index.yaml', repeated(b'vest_library: 1\nentries:\n', lambda n: b'  - {kind: part, name: p%d, file: library/tube.yaml, licence: BSD-3-Clause, source: "%s", about: "A"}\n' % (n, b'd' * 200), 4 * MIB - 1), reader('library', 'index.yaml'))
    yield 'sutures: 100,000 values', lambda: one('', 'sutures.yaml', read('vest_tissue', 'data', 'sutures.yaml') + b''.join(b'  - {name: m%d, density: {value: 1, assumed: true, why: x}}\n' % n for n in range(9000)), reader('sutures', 'sutures.yaml'))
    materials = read('vest_tissue', 'data', 'materials.yaml')
    entry = materials[materials.rindex(b'\n  - name: ') + 1:]
    yield 'materials: 100,000 values', lambda: one('', 'materials.yaml', materials + b''.join(entry.replace(entry[:entry.index(b'\n')], b'  - name: m%d' % n) for n in range(4 * MIB // len(entry) - 40)), [tool('vest_tissue', 'vest_material'), '--materials', '{}/materials.yaml', 'list'])
    yield 'measured curve: 16 MB', lambda: one('', 'curve.csv', repeated(b'strain,stress\n', lambda n: b'%.6f,%d\n' % (n * 1e-6, n), 16 * MIB), [tool('vest_tissue', 'vest_material'), 'fit', '{}/curve.csv'])
    yield 'urdf: 4 MB', lambda: one('', 'arm.urdf', b'<robot name="a"><link name="l0"/>' + b''.join(b'<link name="l%d"/><joint name="j%d" type="fixed"><parent link="l%d"/><child link="l%d"/></joint>' % (n + 1, n, n, n + 1) for n in range(42000)) + b'</robot>',
                                    [tool('vest_instruments', 'make_urdf'), '--check', '{}/arm.urdf'])
    yield 'instrument: 16 MB', lambda: one('', 'a.stl', surface_scene('stl', 400, 1)['ball.stl'][:16 * MIB], reader('instrument', 'a.stl'), ['a.stl', 'shaft.stl'])
    yield 'session.json: 64 MB', lambda: one('', 'session.json', repeated(b'{"version": "1", "events": [0', lambda n: b',1', 64 * MIB - 10) + b']}', [tool('vest_bringup', 'vest_check_session'), '{}'], ['session.json', 'session.bag'], {'session.bag': good['bag'][0]})
    yield 'session.json: a million values', lambda: one('', 'session.json', rows(b'{"version": "1", "events": [{"kind": "cut", "time": 0}', lambda n: b',{"kind": "cut", "time": %d}' % n, 300000) + b']}', [tool('vest_bringup', 'vest_check_session'), '{}'], ['session.json', 'session.bag'], {'session.bag': good['bag'][0]})
    yield 'reference group: 1 MB', lambda: one('', 'reference.json', good['reference'][0][:-2] + b', "x": [' + b'0,' * 480000 + b'0]}', reader('reference', 'reference.json'))
    yield 'trainees: 64 MB', lambda: one('', 'trainees.db', database(56 * MIB)(good['trainees'][0], good['place']), [tool('vest_bringup', 'vest_trainee'), '--database', '{}/trainees.db', 'export', 'first'], ['trainees.db', "trainee 'first'"])
    pulse = [tool('vest_effects', 'vest_pulse'), '{}', '--cycles', '1', '--dx', '0.02', '--output', '{}/out']
    yield 'blood flow: 4 MB of vessels', lambda: Kind('', flow_tree(4 * MIB - 100000), 'network.csv', reader('network', 'all'), ['case.json', 'network.csv', '/all'])
    yield 'blood flow: 4 MB of inflow', lambda: Kind('', dict(kept('network', 'bifurcation'), **{'inflow.csv': repeated(b't_s,Q_m3_s\n', lambda n: b'%.6f,7e-6\n' % (n * 3e-6), 4 * MIB - 30) + b'0.8,7e-6\n'}), 'inflow.csv', pulse, ['inflow.csv', 'case.json', 'vest_pulse'])
    tube = kept('source', 'tube')
    yield 'source: 250,000 vertices of skin', lambda: Kind('', dict(tube, **{'source.yaml': tube['source.yaml'].replace(b'rings: 6', b'rings: 500').replace(b'around: 6', b'around: 40').replace(b'along: 2, around: 3', b'along: 4, around: 3')}), 'source.yaml', [model, 'bake', '{}/source.yaml', '{}/out'])
    yield 'edits: 2,000', lambda: Kind('', dict(tube, **{'edits.yaml': b'vest_edits: 1\nedits:\n' + b''.join(b'  - {op: set, path: /objects/tube/tube/centre/1, value: [0.00%d, 0.05, 0.06]}\n' % (n % 9 + 1) for n in range(2000))}), 'edits.yaml',
                                      [model, 'edit', '{}/source.yaml', '--script', '{}/edits.yaml', '-o', '{}/out'], ['edits.yaml', 'source.yaml'])
    large = tube['source.yaml'].replace(b'rings: 6', b'rings: 200').replace(b'around: 6', b'around: 40')
    yield 'edits: 8,000 knots each', lambda: Kind('', {'source.yaml': large, 'edits.yaml': b'vest_edits: 1\nedits:\n' + b''.join(b'  - {op: set, path: /objects/tube/tube/centre/1, value: [0.00%d, 0.05, 0.06]}\n' % (n % 9 + 1) for n in range(260))}, 'edits.yaml',
                                              [model, 'edit', '{}/source.yaml', '--script', '{}/edits.yaml', '-o', '{}/out'], ['edits.yaml', 'source.yaml'])
    check, steps = [model, 'check', '{}/scene.yaml'], [simulate, '{}/scene.yaml', '--steps', '1']
    for way, command in (('checked', check), ('a step', steps)):
        yield 'net: 131,044 knots, 522,724 springs, %s' % way, lambda command=command: Kind('', sheet_scene(362, 362), 'nodes.csv', command, ['scene.yaml', 'nodes.csv', 'links.csv'])
        yield 'elements: 17,904 nodes, nearly all held, %s' % way, lambda command=command: Kind('', block_scene(b'corotational', 0.0959, 23, 30, 23), 'nodes.csv', command, ['scene.yaml', 'nodes.csv', 'tets.csv'])
        yield 'elements: 19,683 nodes, free, %s' % way, lambda command=command: Kind('', block_scene(b'corotational', 0.0501, 26, 26, 26), 'nodes.csv', command, ['scene.yaml', 'nodes.csv', 'tets.csv'])
        yield 'rigid: 65 boxes of 0.32 m, %s' % way, lambda command=command: Kind('', cube_scene(65, 0.32), 'scene.yaml', command)
        yield 'rigid: a fan of 20,000 long triangles, %s' % way, lambda command=command: Kind('', fan_scene(20000, 0.3), 'scene.yaml', command)
        for ending, n, cell in (('obj', 499, 0.001), ('ply', 499, 0.0006), ('stl', 499, 0.0006)):
            yield 'surface: 496,504 triangles, %s, cells of %g mm, %s' % (ending, 1000 * cell, way), lambda command=command, e=ending, n=n, c=cell: Kind('', surface_scene(e, n, c), 'ball.' + e, command, ['scene.yaml', 'ball.' + e])
    mesh = kept('scene', 'mesh')
    yield 'mesh: 1,000,000 nodes', lambda: Kind('', dict(mesh, **{'a.msh': msh(1000000)}), 'a.msh', check, ['scene.yaml', 'a.msh'])
    side = 640
    nrrd = lambda packed: (b'NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: %d %d %d\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nkinds: domain domain domain\nendian: little\nencoding: %s\n\n' %
                           (side, side, side, b'gzip' if packed else b'raw'))
    image = tool('vest_tissue', 'vest_image')
    yield 'image: 2^28 voxels, packed', lambda: one('', 'a.nrrd', nrrd(True) + gzip.compress(bytes(2 * side ** 3), 1), [image, 'info', '{}/a.nrrd'])
    yield 'image: 2^28 voxels, plain', lambda: one('', 'a.nrrd', nrrd(False) + bytes(2 * side ** 3), [image, 'info', '{}/a.nrrd'])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--devel', default=os.path.join(ROOT, 'build', 'test', 'devel'))
    parser.add_argument('--only', default='', help='kinds that have these words')
    options = parser.parse_args()
    os.environ['LD_LIBRARY_PATH'] = os.path.abspath(options.devel) + '/lib:' + os.environ.get('LD_LIBRARY_PATH', '')

    def tool(package, name):
        paths = [os.path.join(options.devel, 'lib', place, name) for place in (package, 'vest')]
        return os.path.abspath(next((p for p in paths if os.path.exists(p)), ''))

    bad = 0
    with tempfile.TemporaryDirectory() as place:
        good = dict(made(tool), place=place)
        for name, make in largest(tool, good):
            if options.only not in name:
                continue
            kind = make()
            kind.name = name
            folder = os.path.join(place, 'files')
            os.mkdir(folder)
            for file, bytes_ in kind.files.items():
                with open(os.path.join(folder, file), 'wb') as out:
                    out.write(bytes_)
            size = sum(len(b) for b in kind.files.values())
            spent = {'seconds': 0, 'megabytes': 0}
            outcome, message = hostile_files.run(kind, folder, PATIENCE / hostile_files.SECONDS, spent=spent)
            seconds, megabytes = spent['seconds'], spent['megabytes']
            shutil.rmtree(folder)
            failed = hostile_files.OUTCOMES.index(outcome) >= 3 or seconds > hostile_files.SECONDS or megabytes > hostile_files.MEGABYTES
            bad += failed
            print('%-60s %6.1f MB  %-22s %5.1f s %5d MB  %s' % (name, size / MIB, outcome, seconds, megabytes, ('BAD ' if failed else '') + message[:120]), flush=True)
    return bad > 0


if __name__ == '__main__':
    sys.exit(main())
