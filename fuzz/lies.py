"""Files that are well made and lie: headers that contradict their data, bombs, numbers at the edges (hostile_files.py).

Each function yields (title, bytes) in the place of a good file of its format.
"""
import bz2
import re
import sqlite3
import struct
import tempfile

from lies_images import dicom, jpeg, mha, nii, nrrd, packed, png
from lies_scene import net

NUMBERS = [b'1e-400', b'1e400', b'-0', b'+1', b'1.', b'.5', b'0b1', b'1,5', b'1:30', b'0o17', b'.inf', b'-.nan', b'1_0', b'\xef\xbc\x91',
           b'9' * 400, b'0.' + b'0' * 400 + b'1', b'2147483648', b'-2147483649', b'9223372036854775808', b'18446744073709551616',
           b'1e15', b'-1e15', b'1e-15', b'4.9e-324', b'3.5e38', b'16777217', b'0x1p10', b'1e', b'infinity', b'1d3', b'1 2', b'1e99999999999999999999',
           b'nan(7)', b'1__0', b'\xd9\xa3', b'1\0', b'00012', b'1f', b'\xe2\x88\x921']

# In the place of a number of a YAML file: what other parsers make a number, a date, a program of.
VALUES = [b'"5"', b"'5'", b"!!int ''", b'!!bool x', b'!!float ""', b'!!timestamp x', b'!!int 5', b'!!float nan', b'!!binary NQ==', b'!!python/object/apply:os.system [id]', b'!mine 5', b'!!null', b'!!set {5}', b'~', b'',
          b'[]', b'{}', b'[5', b'&x 5', b'*x', b'|\n      5', b'>-\n      5', b'2001-12-14', b'12:30:45', b'5#c', b'@5', b'`5', b'%5', b'? 5', b'- 5', b'<<', b'=',
          b'yes', b'$(rospack find x)', b'5\xc2\xa0', b'5\xe2\x80\x8b', b'\xef\xbb\xbf5']


def numbers(data):
    """Every number of the file, one at a time and all at once, is one that readers understand differently."""
    places = [m.span() for m in re.finditer(rb'(?<![\w.])-?[0-9][0-9.]*(?:e-?[0-9]+)?(?![\w.])', data)]
    if not places:
        return
    for i, number in enumerate(NUMBERS):
        for at in sorted({len(places) * (i % 3 + 1) // 4, len(places) - 1, 0}):
            start, end = places[at]
            yield 'number %d is %s' % (at, number[:20].decode('utf-8', 'replace')), data[:start] + number + data[end:]
    for number in (b'0', b'-1', b'1e9', b'1e-9', b'4294967295'):
        yield 'all numbers are ' + number.decode(), re.sub(rb'(?<![\w.])-?[0-9][0-9.]*(?![\w.])', number, data)


def yaml(data):
    first = re.match(rb'(?:#.*\n|\s*\n)*([a-z_]+):', data)
    key = first[1] if first else b'name'
    yield 'nested blocks', data + b'\nextra:\n' + b''.join(b' ' * i + b'a:\n' for i in range(2000))
    yield 'nested dashes', b'- ' * 500000
    yield 'nested question marks', b'? ' * 500000
    yield 'nested brackets that close', b'[' * 200000 + b']' * 200000
    yield 'a key that is a map', data + b'\n? {a: 1}\n: 2\n'
    yield 'a key that is a list', data + b'\n? [a, b]\n: 2\n'
    yield 'no key', data + b'\n~: 1\n: 2\n'
    yield 'the same key in quotes', data + b'\n"' + key + b'": 1\n'
    yield 'the same key, escaped', data + b'\n"\\x%02x' % key[0] + key[1:] + b'": 1\n'
    yield 'a merge key', data + b'\n<<: {name: other}\n'
    yield 'an anchor to itself', b'&a [*a]\n' + data
    yield 'a directive', b'%YAML 9.9\n---\n' + data
    yield 'many directives', b''.join(b'%%TAG !a%d! tag:x,2000:\n' % i for i in range(100000)) + b'---\n' + data
    yield 'ends, then goes on', data + b'\n...\n' + data
    yield 'a document before it', b'---\n--- \n' + data
    yield 'a block of 3 MB', data + b'\nname: |\n' + b'  x\n' * 800000
    yield 'a folded text of 3 MB', data + b'\nname: >\n' + b'  x\n' * 800000
    yield 'an open quote', data + b'\nname: "' + b'\\n' * 1500000
    yield 'an open single quote', data + b"\nname: '" + b"''" * 1500000
    yield '3 MB of comments', data + b'\n#' * 1500000
    yield '3 MB of tags', data + b'\nname: ' + b'!' * 3000000
    yield 'marks of other line ends', data.replace(b'\n', b'\xc2\x85')
    yield 'separators of paragraphs', data.replace(b'\n', b'\xe2\x80\xa9')
    yield 'tabs', data.replace(b'  ', b'\t')
    yield 'utf-32', data.decode('latin-1').encode('utf-32')
    yield 'overlong utf-8', data + b'\nname: "\xc0\x80\xed\xa0\x80\xf5\x90\x80\x80"\n'
    yield 'names that turn round', data + '\n"\u202e\u2066\u200b\ufeff": 1\n'.encode()
    yield 'names that write', data + b'\n"\\e]0;x\\a\\e[2J\\r": 1\n'
    yield 'a name of 3 MB', data + b'\n' + b'k' * 3000000 + b': 1\n'
    yield 'a hundred thousand keys', data + b''.join(b'\nk%d: 1' % i for i in range(100000))
    for name in set(re.findall(rb'(?:name|scene|object|title|file|organ|nodes|links|mesh|surface|labels): ([\w.]+)', data)):
        for other in (b'""', b'~', b'.', b'..', b'/dev/stdin', b'/dev/zero', b'/proc/self/environ', b'"a\\0b"', b'"' + b'x/' * 3000 + b'"',
                      b'[a]', b'"%s%n"', b'"{0.__class__}"'):
            yield '%s is %s' % (name.decode(), other[:20].decode()), data.replace(b': ' + name, b': ' + other, 1)
    lines = data.splitlines(keepends=True)
    keys = [i for i, line in enumerate(lines) if re.match(rb'\s*(?:- )?[\w]+:', line)]
    for i in keys[::max(1, len(keys) // 25)]:
        own = lines[i].replace(b'- ', b'  ', 1)
        yield 'line %d twice' % i, b''.join(lines[:i + 1]) + own + b''.join(lines[i + 1:])
        name, value = own.split(b':', 1)
        yield 'the key of line %d as a merge' % i, b''.join(lines[:i]) + lines[i].replace(name.strip() + b':', b'<<: {' + name.strip() + b':', 1).rstrip() + b'}\n' + b''.join(lines[i + 1:])
        yield 'the key of line %d with a mark' % i, b''.join(lines[:i]) + lines[i].replace(name.strip(), b'!!str &k ' + name.strip(), 1) + b''.join(lines[i + 1:])
    places = [m.span(1) for m in re.finditer(rb'[\w\]]: (-?[0-9][0-9.]*(?:e-?[0-9]+)?)\s*(?=[\n,}#])', data)]
    for at in sorted({0, len(places) // 2, len(places) - 1} if places else ()):
        for value in VALUES:
            yield 'value %d is %s' % (at, ascii(value.decode())), data[:places[at][0]] + value + data[places[at][1]:]
    yield 'a million objects of nothing', data + b'\nmore:\n' + b'- {}\n' * 600000
    yield 'a million objects in one line', data + b'\nmore: [' + b'{},' * 1000000 + b'{}]\n'
    yield 'spaces of Unicode', data.replace(b'  ', b'\xc2\xa0 ')
    yield 'a zero in the middle', data[:len(data) // 2] + b'\0' + data[len(data) // 2:]
    yield 'a blank before each colon', data.replace(b': ', b' : ')
    yield 'no blank behind a colon', data.replace(b': ', b':')
    yield 'comments behind all', data.replace(b'\n', b' # \x1b[2J\n')
    yield 'json', b'{"' + key + b'": 1e999, "a": [1, 2,]}'
    yield 'a line of 3 MB', data.rstrip() + b' ' * 3000000 + b'x\n'
    for name in set(re.findall(rb'name: ([\w.]+)', data)):
        for other in (b'a' * 255, b'a' * 4096, b'scene.yaml', b'source.yaml', b'-rf', b'"a b"', b'"a\\nb"', b"it's", b'"a/b"', b'"~"', b'CON', b'"a;id"', b'\xc3\xa9', b'1e5'):
            yield 'name %s is %s' % (name.decode(), ascii(other[:20].decode())), data.replace(b'name: ' + name, b'name: ' + other, 1)
    for number in numbers(data):
        yield number


def table(data):
    """CSV."""
    lines = data.splitlines()
    header = next((line for line in lines if b',' in line and not line.startswith(b'#')), b'')
    row = lines[-1]
    yield 'zeros at each end of line', data.replace(b'\n', b'\x00\n')
    yield 'a zero in a name', data.replace(b',', b'\x00,', 1)
    yield 'a column twice', data.replace(header, header + b',' + header.split(b',')[-1], 1) if header else b'a,a\n'
    yield 'a million columns', data.replace(header, header + b',c' * 1000000, 1) if header else b'a,' * 1000000
    yield 'quotes', b'"' + data.replace(b',', b'","').replace(b'\n', b'"\n"')
    yield 'an open quote', data + b'"' + b',' * 3000000
    yield 'semicolons', data.replace(b',', b';')
    yield 'only carriage returns', data.replace(b'\n', b'\r')
    yield 'only the header', header + b'\n'
    yield 'a million rows of one', data + b'\n' + (row + b'\n') * (60000000 // (len(row) + 1))
    yield 'a row of 60 MB', data + b'\n' + b'1,' * 30000000
    yield 'blanks of 60 MB', data + b' ' * 60000000
    yield 'rows backwards', header + b'\n' + b'\n'.join(reversed(lines[1:])) + b'\n'
    yield 'arabic digits', data.translate(None).decode('latin-1').translate({48 + i: 0x660 + i for i in range(10)}).encode()
    yield 'commas of another language', data.replace(b',', b';').replace(b'.', b',')
    yield 'the header twice', header + b'\n' + data
    yield 'columns in another order', re.sub(re.escape(header), b','.join(reversed(header.split(b','))), data, count=1) if header else data
    yield 'names in capitals', data.replace(header, header.upper(), 1)
    yield 'a comma at each end', data.replace(b'\n', b',\n')
    yield 'one value less', data.rstrip().rsplit(b',', 1)[0] + b'\n'
    yield 'a comment in a row', data.rstrip() + b'#,1\n'
    yield 'no number at all', re.sub(rb'[0-9]+', b'', data)
    yield 'a zero at the end', data + b'\0'
    yield 'a byte order mark and carriage returns', b'\xef\xbb\xbf' + data.replace(b'\n', b'\r\n')
    for value in (b'-1', b'0.5', b'1e18', b'4294967296', b'2', b' 1', b'"1"', b'', b'+1', b'-0', b'1e0'):
        yield 'the first of a row is ' + value.decode(), data.rstrip()[:-len(row)] + value + (b',' + row.split(b',', 1)[1] if b',' in row else b'') + b'\n'
    yield 'formulas', data.replace(b'\n', b'\n=1+', 2)
    for number in numbers(data):
        yield number


def ply(data):
    head = b'ply\nformat ascii 1.0\n'
    most = b'4294967295'
    yield 'vertices without a property', head + b'element vertex %s\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n' % most
    yield 'an element of nothing, often', data.replace(b'element vertex', b'element nothing %s\nelement vertex' % most, 1)
    yield 'a hundred thousand elements', data.replace(b'element vertex', b'element e 0\n' * 100000 + b'element vertex', 1)
    yield 'a hundred thousand properties', data.replace(b'property float x', b'property float q\n' * 100000 + b'property float x', 1)
    yield 'x twice', data.replace(b'property float y', b'property float x', 1)
    yield 'x is a list', data.replace(b'property float x', b'property list uchar float x', 1)
    yield 'counts are floats', data.replace(b'list uchar int', b'list float int', 1)
    yield 'indices are doubles', data.replace(b'list uchar int', b'list uchar double', 1)
    yield 'counts are signed', data.replace(b'list uchar int', b'list char int', 1)
    yield 'no end of the header', data.replace(b'end_header', b'comment', 1)
    for order in (b'ascii', b'binary_little_endian', b'binary_big_endian'):
        yield 'said to be ' + order.decode(), re.sub(rb'format \w+', b'format ' + order, data, count=1)
    big = b'ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\n' \
          b'property list %s %s vertex_indices\nend_header\n'
    for name, form in ((b'char', 'b'), (b'uchar', 'B'), (b'short', 'h'), (b'int', 'i'), (b'uint', 'I')):
        for count in (0, 1, 3, 255, -1, 1 << 30):
            try:
                body = struct.pack('>' + form, count)
            except struct.error:
                continue
            for corner in (2, -1, 3, 0x7fffffff):
                yield 'a face of %d as %s, to %d' % (count, name.decode(), corner), big % (name, b'int') + struct.pack('>9d', 0, 0, 0, 1, 0, 0, 0, 1, 0) + body + \
                    struct.pack('>3i', 0, 1, corner)
    for value in (float('nan'), float('inf'), 1e308, -1e38, 5e-324):
        yield 'a vertex at %g' % value, big % (b'uchar', b'int') + struct.pack('>9d', value, value, value, 1, 0, 0, 0, 1, 0) + struct.pack('>B3i', 3, 0, 1, 2)
    yield 'only carriage returns in the header', data.replace(b'\n', b'\r')
    yield 'blanks behind the header', data.replace(b'end_header', b'end_header   ', 1)
    yield 'a comment of 3 MB', data.replace(b'element vertex', b'comment ' + b'x' * 3000000 + b'\nelement vertex', 1)
    yield 'a list of a million in a vertex', data.replace(b'property float x', b'property list uint uchar more\nproperty float x', 1)
    yield 'two formats', data.replace(b'format', b'format binary_big_endian 1.0\nformat', 1)
    yield 'faces first', data.replace(b'element vertex', b'element fxce', 1).replace(b'element face', b'element vertex', 1)
    for count in (0, 1, 2, 1 << 31, (1 << 32) - 1, (1 << 63) - 1, 1 << 64, -1):
        for element in (b'vertex', b'face'):
            yield '%d of %s' % (count, element.decode()), re.sub(b'element %s [0-9]+' % element, b'element %s %d' % (element, count), data)


def stl_text(data):
    text = b'solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n  endloop\n endfacet\nendsolid a\n'
    yield 'text that is as long as a binary file', b'solid ' + b' ' * 74 + struct.pack('<I', 1) + b'\n' + text[8:57]
    yield 'text behind a binary head', bytes(80) + struct.pack('<I', 12) + text
    yield 'binary behind text', data + bytes(80) + struct.pack('<I', 1) + bytes(50)
    yield 'capitals', text.upper()
    yield 'two solids in one', text.replace(b' facet', b'solid b\n facet', 1)
    yield 'four corners', text.replace(b'  endloop', b'   vertex 1 1 0\n  endloop')
    yield 'a corner that is nan', text.replace(b'1 0 0', b'nan 0 0')
    for number in numbers(data):
        yield number


def stl(data):
    for count in (0, 1, 1 << 31, (1 << 32) - 1, 85899345):
        yield '%d triangles' % count, b'\0' * 80 + struct.pack('<I', count) + data[84:]
    yield 'solid and binary', b'solid x\n' + b'\0' * 72 + data[80:]
    yield 'a solid without an end', b'solid a\n' + b'facet normal 0 0 1\nouter loop\n' * 100000
    yield '60 MB of one point', b'\0' * 80 + struct.pack('<I', 1200000) + b'\0' * 60000000
    yield 'one byte more', data + b'\0'
    yield 'one byte less', data[:-1]
    flat = b''.join(struct.pack('<12fH', 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0) for _ in range(100000))
    yield 'one triangle a hundred thousand times', b'\0' * 80 + struct.pack('<I', 100000) + flat
    for value in (float('nan'), float('inf'), 3e38, 1e-45):
        yield 'a corner at %g' % value, data[:96] + struct.pack('<3f', value, value, value) + data[108:]


def obj(data):
    yield 'a face of a million corners', data + b'\nf' + b' 1 2 3' * 400000
    yield 'a million faces of one corner', data + b'\nf 1 1 1' * 1000000
    yield 'a million vertices', b'v 0 0 0\n' * 1000000 + data
    yield 'indices below all', data + b'\nf -1 -2 -99999999\n'
    yield 'index zero', data + b'\nf 0 1 2\n'
    yield 'index beyond 64 bits', data + b'\nf 1 2 99999999999999999999\n'
    yield 'lines that go on', data.replace(b'\n', b' \\\n')
    yield 'five coordinates', data.replace(b'v 0 0 0', b'v 0 0 0 0 0', 1)
    yield 'weight zero', data.replace(b'v 0 0 0', b'v 0 0 0 0', 1)
    yield 'corners of no vertex', b'f 1 2 3\n' + data
    yield 'textures far away', re.sub(rb'(f [0-9]+)[^ ]*', rb'\1/999999999/-999999999', data)
    yield 'slashes', data + b'\nf 1/ 2// /3\n'
    yield 'a corner of nan', data + b'\nv nan inf -inf\n'
    yield 'names that write', data + b'\nusemtl \x1b[2J\no \xe2\x80\xae\n'
    yield 'another file', data + b'\nmtllib /etc/passwd\ncall /etc/passwd\n'
    yield 'a line that goes on at the end', data.rstrip() + b' \\'
    yield 'curves', data + b'\ncstype bspline\ncurv 0 1 1 2 3\n' * 10000


def msh(data):
    most = b'9223372036854775807'
    for section in (b'Nodes', b'Elements', b'Entities'):
        yield 'no %s' % section.decode(), re.sub(rb'\$%s.*\$End%s\n' % (section, section), b'', data, flags=re.S)
        yield '%s twice' % section.decode(), re.sub(rb'(\$%s.*\$End%s\n)' % (section, section), rb'\1\1', data, flags=re.S)
        yield '%s without an end' % section.decode(), data.replace(b'$End' + section, b'', 1)
        for count in (b'0', b'-1', b'4294967295', most, b'18446744073709551615', b'1e9'):
            yield '%s: first count %s' % (section.decode(), count.decode()), re.sub(rb'(\$%s\n)[0-9]+' % section, rb'\g<1>' + count, data)
            yield '%s: second count %s' % (section.decode(), count.decode()), re.sub(rb'(\$%s\n[0-9]+ )[0-9]+' % section, rb'\g<1>' + count, data)
        for least, greatest in ((b'1', b'9999'), (b'0', b'50'), (b'50', b'1')):
            yield '%s: tags from %s to %s' % (section.decode(), least.decode(), greatest.decode()), re.sub(
                rb'(\$%s\n[0-9]+ [0-9]+ )[0-9]+ [0-9]+' % section, rb'\g<1>' + least + b' ' + greatest, data)
    old = b'2.2' in data[:40]
    rows = re.search(rb'\$Elements\n.*?\n(.*?)\$EndElements', data, re.S)[1].splitlines(keepends=True)
    last = rows[-1]
    for kind in (b'0', b'-4', b'5', b'11', b'15', b'20', b'31', b'92', b'140', b'99999999', b'4.5', b'four'):
        if old:
            changed = re.sub(rb'^([0-9]+) [0-9]+', rb'\1 ' + kind, last)
            yield 'an element of kind ' + kind.decode(), data.replace(last, changed, 1)
        else:
            yield 'elements of kind ' + kind.decode(), re.sub(rb'(\$Elements\n.*\n[0-9]+ [0-9]+) [0-9]+', rb'\1 ' + kind, data, count=1)
    for tag in (b'-1', b'0', b'1073741824', b'1073741825', b'2147483648', b'1e9', b'1.5', b'nan', b'+1', b'01'):
        yield 'an element with the tag ' + tag.decode(), data.replace(last, re.sub(rb'^[0-9]+', tag, last), 1)
        yield 'an element to node ' + tag.decode(), data.replace(last, re.sub(rb'[0-9]+\s*$', tag + b'\n', last), 1)
        yield 'a node with the tag ' + tag.decode(), re.sub(rb'(\$Nodes\n[0-9]+\n)[0-9]+' if old else rb'(\$Nodes\n.*\n.*\n)[0-9]+', rb'\g<1>' + tag, data, count=1)
    for count in (b'-1', b'0', b'64', b'65', b'99999999'):
        yield 'an element of %s tags' % count.decode(), data.replace(last, re.sub(rb'^([0-9]+ [0-9]+) [0-9]+', rb'\1 ' + count, last), 1)
    yield 'a million elements of one node', data.replace(b'$Elements', b'$Elements\n' + b'1 15 0 1\n' * 1000000, 1)
    yield 'names of groups that write', data.replace(b'$Nodes', b'$PhysicalNames\n1\n3 1 "\x1b[2J"\n$EndPhysicalNames\n$Nodes', 1)
    yield 'an open comment', data.replace(b'$Nodes', b'$Comments\n$Nodes', 1)
    yield 'the format twice', data[:data.find(b'$Nodes')] + data
    yield 'elements before nodes', data[:data.find(b'$Nodes')] + data[data.find(b'$Elements'):] + data[data.find(b'$Nodes'):data.find(b'$Elements')]
    yield 'a tetrahedron twice', data.replace(last, last + last, 1)
    yield 'blocks of nothing', re.sub(rb'(\$Nodes\n)[0-9]+ ([0-9]+) .*', rb'\g<1>2000000 \2 1 50\n' + b'3 1 0 0\n' * 2000000, data, count=1)
    yield 'binary', data.replace(b' 0 8', b' 1 8', 1)
    yield 'another version', data.replace(b'4.1', b'4.0', 1).replace(b'2.2', b'1', 1)
    yield 'tags near the end of numbers', data.replace(b'50', b'9223372036854775807')
    yield 'one tag twice', data.replace(b'50', b'40')


def vtk(data):
    for word in (b'POINTS', b'CELLS', b'CELL_TYPES', b'OFFSETS', b'CONNECTIVITY'):
        for count in (b'0', b'-1', b'2147483647', b'9223372036854775807', b'1e3'):
            yield '%s %s' % (word.decode(), count.decode()), re.sub(rb'(\b%s )[0-9]+' % word, rb'\g<1>' + count, data, count=1)
        yield 'no ' + word.decode(), data.replace(word, b'NOTHING', 1)
        yield word.decode() + ' again', data + b'\n' + data[data.find(word):]
    yield 'binary', data.replace(b'ASCII', b'BINARY', 1)
    for kind in (b'0', b'-1', b'5', b'11', b'24', b'42', b'255', b'1e1', b'4294967306'):
        yield 'a cell of type ' + kind.decode(), re.sub(rb'(CELL_TYPES [0-9]+\n)[0-9]+', rb'\g<1>' + kind, data, count=1)
    for value in (b'nan', b'inf', b'1e308', b'-1e6', b'1e7', b'0x1'):
        yield 'a point at ' + value.decode(), re.sub(rb'(POINTS.*\n)[-0-9.e]+', rb'\g<1>' + value, data, count=1)
    yield 'another version', re.sub(rb'Version [0-9.]+', b'Version 99.9', data, count=1)
    yield 'data of a million fields', data + b'\nFIELD F 1000000\n' + b'a 1 1 float\n1\n' * 100000
    yield 'labels of nothing', data + b'\nCELL_DATA 99999999\nSCALARS l int 1\nLOOKUP_TABLE default\n1\n'
    yield 'a grid of another kind', data.replace(b'UNSTRUCTURED_GRID', b'STRUCTURED_POINTS', 1)


def urdf(data):
    laughs = b'<?xml version="1.0"?>\n<!DOCTYPE robot [<!ENTITY a0 "ha">' + b''.join(
        b'<!ENTITY a%d "%s">' % (i, b'&a%d;' % (i - 1) * 10) for i in range(1, 12)) + b']>\n<robot name="&a11;"/>'
    yield 'a billion laughs', laughs
    yield 'a file from elsewhere', b'<?xml version="1.0"?>\n<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>\n<robot name="&x;"/>'
    yield 'a hundred thousand attributes', data.replace(b'name="arm"', b'name="arm" ' + b' '.join(b'a%d="1"' % i for i in range(100000)), 1)
    yield 'a hundred thousand links', data.replace(b'</robot>', b''.join(b'<link name="l%d"/>' % i for i in range(100000)) + b'</robot>')
    chain = b''.join(b'<link name="l%d"/><joint name="j%d" type="fixed"><parent link="l%d"/><child link="l%d"/></joint>' % (i, i, i, i + 1)
                     for i in range(20000))
    yield 'a chain of twenty thousand', b'<robot name="a">' + chain + b'<link name="l20000"/></robot>'
    yield 'a ring', data.replace(b'</robot>', b'<joint name="b" type="fixed"><parent link="tip"/><child link="base"/></joint></robot>')
    yield 'its own child', data.replace(b'link="tip"', b'link="base"', 1)
    yield 'references to characters', data.replace(b'arm', b'&#0;&#x1b;[2J&#1114112;', 1)
    yield 'an open comment', data.replace(b'-->', b'', 1)
    yield 'open data', data + b'<![CDATA[' * 1000
    yield 'one attribute of 3 MB', data.replace(b'arm', b'a' * 3000000, 1)


def json(data):
    yield 'a key twice', data.replace(b'{', b'{"title": 1, "title": 2, ', 1)
    yield 'half a pair', data.replace(b'"', b'"\\ud800', 1)
    yield 'zero in a key', data.replace(b'{', b'{"a\\u0000b": 1, ', 1)
    yield 'nested and closed', b'{"a":' * 100000 + b'1' + b'}' * 100000
    yield 'nested lists and closed', b'[' * 100000 + b']' * 100000
    yield 'a number of a million digits', data.replace(b'{', b'{"x": ' + b'9' * 1000000 + b', ', 1)
    yield 'a million keys', data.replace(b'{', b'{' + b''.join(b'"k%d":1,' % i for i in range(300000)), 1)
    yield 'a comma at the end', data.replace(b'}', b',}')
    yield 'comments', data.replace(b'{', b'{/* */', 1)
    for value in (b'NaN', b'Infinity', b'-Infinity', b'null', b'[]', b'{}', b'true', b'"1"', b'1e999', b'01', b"'a'", b'undefined', b'"\\ud83d"', b'"\x01"'):
        for at in (0, 1):
            places = [m.span(1) for m in re.finditer(rb':\s*("[^"]*"|-?[0-9.eE+-]+)', data)]
            if places:
                start, end = places[0 if at == 0 else len(places) // 2]
                yield 'value %d is %s' % (at, ascii(value.decode('latin-1'))), data[:start] + value + data[end:]
    yield 'single quotes', data.replace(b'"', b"'")
    yield 'a second document', data + data
    for i, (start, end) in enumerate([m.span() for m in re.finditer(rb'"\w+"\s*:\s*("[^"]*"|-?[0-9.eE+-]+)', data)][:12]):
        own = data[start:end]
        yield 'pair %d twice' % i, data[:end] + b', ' + own + data[end:]
        yield 'pair %d twice, the key escaped' % i, data[:end] + b', "\\u%04x' % own[1] + own[2:] + data[end:]
    for unit in (b'0', b'[]', b'{}', b'""', b'{"a":[]}'):
        yield '3 MB of ' + unit.decode(), data.replace(b'{', b'{"x": [' + (unit + b',') * (3000000 // (len(unit) + 1)) + unit + b'], ', 1)
    for number in numbers(data):
        yield number


def trainees(data):
    def changed(at, form, *values):
        b = bytearray(data)
        struct.pack_into(form, b, at, *values)
        return bytes(b)
    for size in (0, 1, 512, 1000, 32768):
        yield 'pages of %d' % size, changed(16, '>H', size)
    for at, name in ((18, 'write version'), (20, 'reserved'), (21, 'fraction')):
        yield name, changed(at, 'B', 255)
    for at, name in ((28, 'pages'), (32, 'free list'), (36, 'free pages'), (40, 'schema'), (44, 'schema format'), (52, 'root'), (56, 'encoding'), (60, 'user version')):
        for value in (0, 1, 2, 3, 0x7fffffff, 0xffffffff):
            yield '%s %d' % (name, value), changed(at, '>I', value)

    def made(*statements):
        with tempfile.NamedTemporaryFile(suffix='.db') as file:
            file.write(data)
            file.flush()
            base = sqlite3.connect(file.name, isolation_level=None)
            base.text_factory = bytes
            for statement in ('PRAGMA journal_mode=DELETE', 'PRAGMA writable_schema=ON') + statements:
                base.execute(statement)
            base.close()
            with open(file.name, 'rb') as again:
                return again.read()

    with tempfile.NamedTemporaryFile(suffix='.db') as file:
        file.write(data)
        file.flush()
        base = sqlite3.connect(file.name)
        tables = {name: [row[1] for row in base.execute('PRAGMA table_info(%s)' % name)]
                  for name, in base.execute("SELECT name FROM sqlite_master WHERE type='table' AND name NOT LIKE 'sqlite_%'")}
        base.close()
    for name, columns in sorted(tables.items()):
        for column in columns:
            for what, value in (('null', 'NULL'), ('a blob', "x'00ff1b5b324a'"), ('text that writes', "char(27)||'[2J'||char(10)||char(0x202e)"), ('nan', "'nan'"),
                                ('1e308', '1e308'), ('a page', "'<script>alert(1)</script>'"), ('100 MB', 'zeroblob(100000000)'), ('nested', "replace(hex(zeroblob(100000)),'0','[')"),
                                ('bytes', "CAST(x'c328ff' AS TEXT)"), ('-1', '-1'), ('2^63', '9223372036854775807')):
                try:
                    yield '%s.%s is %s' % (name, column, what), made('UPDATE OR IGNORE %s SET %s = %s' % (name, column, value))
                except sqlite3.Error:
                    pass  # the tables refuse it
    for title, statement in (('a column more', 'ALTER TABLE %s ADD COLUMN more TEXT'), ('a generated column', "ALTER TABLE %s ADD COLUMN more AS (randomblob(1000000000))"),
                             ('an index with an expression', 'CREATE INDEX more ON %s (abs(-9223372036854775808 + rowid * 0))'),
                             ('a check that is long', "UPDATE sqlite_master SET sql = replace(sql, ')', ' CHECK (length(hex(zeroblob(900000000))) > 0))') WHERE name = '%s'"),
                             ('no statement', "UPDATE sqlite_master SET sql = 'CREATE TABLE x(' WHERE name = '%s'"),
                             ('another root', "UPDATE sqlite_master SET rootpage = 1 WHERE name = '%s'"),
                             ('a root beyond the end', "UPDATE sqlite_master SET rootpage = 99999999 WHERE name = '%s'"),
                             ('a virtual table', 'CREATE VIRTUAL TABLE more USING fts5(%s)')):
        for name in sorted(tables):
            try:
                yield '%s: %s' % (name, title), made(statement % name)
            except sqlite3.Error:
                pass


def database_log(data):
    """What SQLite writes beside a database (wal): a head, then pages, all with checksums."""
    size = struct.unpack_from('>I', data, 8)[0]
    page = data[56:56 + size]

    def made(frames, size=size, version=3007000):
        head, a, b, out = struct.pack('>6I', 0x377f0682, version, size, 0, 1, 2), 0, 0, b''
        for part, body in [(head, None)] + [(struct.pack('>2I', number, pages), body) for number, pages, body in frames]:
            summed = part + (body or b'')
            for x, y in struct.iter_unpack('<2I', summed):
                a = (a + x + b) & 0xffffffff
                b = (b + y + a) & 0xffffffff
            out += part + (b'' if body is None else struct.pack('>2I', 1, 2)) + struct.pack('>2I', a, b) + (body or b'')
        return out
    for number, pages in ((1, 1), (0, 1), (0xffffffff, 1), (1, 0x7fffffff), (2, 0), (3, 0xffffffff)):
        yield 'page %d of %d' % (number, pages), made([(number, pages, page)])
        yield 'page %d of %d, zeros' % (number, pages), made([(number, pages, bytes(size))])
    for other in (0, 3, 512, 65536, 0x80000000):
        yield 'pages of %d' % other, made([], size=other)
    yield 'another version', made([(1, 1, page)], version=9)
    yield 'no pages', made([])
    yield 'five hundred times one page', made([(1, 1, page)] * 500)


def bag(data):
    """Version 2.0 of rosbag's format: records with lengths before header and data."""
    def record(op, fields, body):
        parts = b''.join(struct.pack('<I', len(n) + 1 + len(v)) + n + b'=' + v for n, v in [(b'op', bytes([op]))] + fields)
        return struct.pack('<I', len(parts)) + parts + struct.pack('<I', len(body)) + body

    def head(index, connections=0, chunks=0):
        fields = [(b'index_pos', struct.pack('<Q', index)), (b'conn_count', struct.pack('<I', connections)), (b'chunk_count', struct.pack('<I', chunks))]
        r = record(3, fields, b'')
        return b'#ROSBAG V2.0\n' + r[:-4] + struct.pack('<I', 4096 - len(r)) + b' ' * (4096 - len(r))

    def connection(number, topic=b'/step_inputs', kind=b'std_msgs/Empty', md5=b'd41d8cd98f00b204e9800998ecf8427e', text=b''):
        body = b''.join(struct.pack('<I', len(n) + 1 + len(v)) + n + b'=' + v for n, v in
                        [(b'topic', topic), (b'type', kind), (b'md5sum', md5), (b'message_definition', text)])
        return record(7, [(b'conn', struct.pack('<I', number)), (b'topic', topic)], body)

    def message(number, body):
        return record(2, [(b'conn', struct.pack('<I', number)), (b'time', struct.pack('<2I', 100, 0))], body)

    def with_chunk(inner, compression, size=None, raw=None):
        body = raw if raw is not None else bz2.compress(inner) if compression == b'bz2' else inner
        chunk = record(5, [(b'compression', compression), (b'size', struct.pack('<I', len(inner) if size is None else size))], body)
        index = 13 + 4096 + len(chunk) - 13
        start = head(0)
        at = len(start)
        index = at + len(chunk)
        info = record(6, [(b'ver', struct.pack('<I', 1)), (b'chunk_pos', struct.pack('<Q', at)), (b'start_time', struct.pack('<2I', 100, 0)),
                          (b'end_time', struct.pack('<2I', 100, 0)), (b'count', struct.pack('<I', 1))], struct.pack('<2I', 0, 1))
        return head(index, 1, 1) + chunk + connection(0) + info

    inner = connection(0) + message(0, b'')
    for compression in (b'none', b'bz2', b'lz4', b'gz', b'', b'none\0', b'x' * 5000):
        for size in (None, 0, 1, 0x7fffffff, 0xffffffff):
            yield 'a chunk of %s, size %s' % (compression[:10].decode(), size), with_chunk(inner, compression, size)
    yield 'a bomb of bz2', with_chunk(b'', b'bz2', 0xfffffff0, packed('bz2', 256) * 16)
    yield 'a bomb of bz2 that says its size', with_chunk(b'', b'bz2', 900 << 20, packed('bz2', 900))
    lz4 = b'\x04\x22\x4d\x18\x64\x70\xb9' + struct.pack('<I', 4000) + b'\x1f\0\x01\0' + b'\xff' * 3996
    for size in (0, 1 << 20, 1 << 30, 0xffffffff):
        yield 'lz4 that grows, size %d' % size, with_chunk(b'', b'lz4', size, lz4)
    for place in (0, 1, 13, 4109, len(data), (1 << 63) - 1, (1 << 64) - 1):
        yield 'index at %d' % place, head(place, 1, 1) + data[4109:]
    for count in (0, 1, 0x7fffffff, 0xffffffff):
        yield '%d connections' % count, re.sub(rb'(conn_count=)....', lambda m: m[1] + struct.pack('<I', count), data, count=1, flags=re.S)
        yield '%d chunks' % count, re.sub(rb'(chunk_count=)....', lambda m: m[1] + struct.pack('<I', count), data, count=1, flags=re.S)
        yield 'chunks of %d messages' % count, re.sub(rb'(\x0a\0\0\0count=)....', lambda m: m[1] + struct.pack('<I', count), data, flags=re.S)
    for place in (0, 4109, len(data) - 1, (1 << 63) - 1):
        yield 'chunks at %d' % place, re.sub(rb'(chunk_pos=)........', lambda m: m[1] + struct.pack('<Q', place), data, flags=re.S)
    yield 'a hundred thousand connections', with_chunk(b''.join(connection(i, b'/t%d' % i) for i in range(100000)), b'none')
    yield 'a connection twice, other types', with_chunk(connection(0) + connection(0, b'/tissue/scene', b'vest_msgs/SceneFiles') + message(0, b''), b'none')
    yield 'a chunk in a chunk', with_chunk(record(5, [(b'compression', b'none'), (b'size', struct.pack('<I', len(inner)))], inner), b'none')
    yield 'headers that may begin chunks', data[:5000] + b'\x20\0\0\0\x10\0\0\0compression=none' * 200000
    yield 'words that may begin chunks', data[:5000] + b'compression=' * 400000
    for size in (0, 1 << 24):
        rest = record(5, [(b'compression', b'none'), (b'size', struct.pack('<I', size))], b'')[:-4] + struct.pack('<I', size)
        yield 'chunks that claim the rest, size %d' % size, data[:5000] + rest * 60000
    yield 'many bombs of bz2', data[:5000] + record(5, [(b'compression', b'bz2'), (b'size', struct.pack('<I', 200 << 20))], packed('bz2', 200)) * 2000
    yield 'a definition of 50 MB', with_chunk(connection(0, text=b'float64 x\n' * 5000000) + message(0, b''), b'none')
    yield 'a definition that contains itself', with_chunk(connection(0, kind=b'vest_msgs/StepInput', text=b'vest_msgs/StepInput x\n') + message(0, b''), b'none')
    yield 'a topic that writes', with_chunk(connection(0, b'/step_inputs\x1b[2J\n') + message(0, b''), b'none')
    yield 'ten thousand header fields', b'#ROSBAG V2.0\n' + record(3, [(b'f%d' % i, b'') for i in range(10000)], b'')
    yield 'fields of no length', b'#ROSBAG V2.0\n' + struct.pack('<I', 4000) + bytes(4000) + struct.pack('<I', 0)
    yield 'a header of 4 GB', b'#ROSBAG V2.0\n' + struct.pack('<I', 0xfffffff0)
    for version in (b'1.2', b'1.1', b'2.1', b'2.00', b'3.0', b'2.0\r', b'-2.0', b'\x1b[2J'):
        yield 'version ' + ascii(version.decode()), data.replace(b'V2.0', b'V' + version, 1)
    both = lambda name, form, value: re.sub(re.escape(name) + b'=' + b'.' * struct.calcsize(form), lambda m: name + b'=' + struct.pack(form, value), data, flags=re.S)
    for name, form, values in ((b'conn', '<I', (0, 1, 0x7fffffff, 0xffffffff)), (b'time', '<Q', (0, 1, (1 << 64) - 1, 0x3b9aca00ffffffff)), (b'op', '<B', (0, 1, 2, 3, 4, 5, 6, 7, 8, 255)),
                               (b'ver', '<I', (0, 2, 0xffffffff)), (b'start_time', '<Q', (0, (1 << 64) - 1)), (b'end_time', '<Q', (0, (1 << 64) - 1)), (b'size', '<I', (0, 1, 0xffffffff))):
        for value in values:
            yield 'every %s is %d' % (name.decode(), value), both(name, form, value)
    for name in (b'topic', b'type', b'md5sum', b'message_definition', b'conn', b'time', b'op', b'size', b'compression', b'chunk_pos', b'index_pos'):
        yield 'no ' + name.decode(), data.replace(name + b'=', b'X' * len(name) + b'=')
        yield name.decode() + ' without a value', data.replace(name + b'=', name + b'X')
    # An index (op 4) lies behind each chunk: version, connection, count, then a time and an offset into the chunk each.
    index = [m.end() for m in re.finditer(rb'ver=\x01\0\0\0', data)]
    for at in index[:2]:
        for offset in (0, 1, 0x7fffffff, 0xffffffff):
            body = data.find(b'count=', at - 200)
            yield 'entries of index %d at %d' % (at, offset), data[:body + 22] + struct.pack('<I', offset) + data[body + 26:]
    for kind in (b'std_msgs/String', b'vest_msgs/StepInput', b'vest_msgs/TissueTopology', b'vest_msgs/SceneFiles', b'tf2_msgs/TFMessage'):
        for name in (b'vest_msgs/StepInput', b'vest_msgs/StateHash', b'vest_msgs/TissueTopology', b'vest_msgs/SceneFiles'):
            if kind != name:
                yield '%s says that it is %s' % (name.decode(), kind.decode()), data.replace(b'type=' + name, (b'type=' + kind)[:5 + len(name)].ljust(5 + len(name), b'X'))
    body = max(data.find(b'compression=none'), 5000)
    for at in range(body, len(data) - 4, max(4, (len(data) - body) // 60)):
        yield 'a count of 2^28 at byte %d' % at, data[:at] + struct.pack('<I', 0x10000000) + data[at + 4:]
    for times in (0, 1 << 31, (1 << 32) - 1):
        yield 'a message of %d bytes' % times, with_chunk(connection(0) + record(2, [(b'conn', bytes(4)), (b'time', bytes(8))], b'')[:-4] + struct.pack('<I', times), b'none')


def raw_log(data):
    for value in (0, 1, 0x7fffffff, 0xffffffff):
        for at in range(0, min(len(data) - 4, 64), 4):
            yield '%d at byte %d' % (value, at), data[:at] + struct.pack('<I', value) + data[at + 4:]
    yield 'often', data + data[16:] * 100000


def snapshot(data):
    """Its checksum is put right by the reader (fuzz/readers_state.cpp): what lies is behind it."""
    for magic in (b'vestsna0', data[:7] + b'0', data[:7] + b'9', data[:7] + b'\xff', data[:8].upper(), b'\x7fELF\x02\x01\x01\0'):
        yield 'begins with ' + ascii(magic.decode('latin-1')), magic + data[8:]
    values = [struct.pack('<d', v) for v in (float('nan'), float('inf'), 1e308, -1.0)] + [struct.pack('<Q', v) for v in ((1 << 64) - 1, 1 << 63, 1 << 32, 1 << 20)]
    step = max(8, (len(data) - 8) // 200 // 4 * 4)
    for i, at in enumerate(range(8, len(data) - 8, step)):
        yield 'value %d at byte %d' % (i % len(values), at), data[:at] + values[i % len(values)] + data[at + 8:]
    yield 'twice', data + data[8:]
    yield 'one byte more', data + b'\0'


def batch(data):
    """A manifest of vest_batch, in YAML."""
    yield from yaml(data)
    start = b'vest_batch: 1\ncommand: [echo, "{a}"]\n'
    for tag in (b"!!int ''", b'!!float ""', b'!!timestamp x', b'!!bool x', b'!!int 0b', b'!!pairs [1]', b'!!omap {a: 1}', b'!!set [a]'):
        yield 'a value is ' + tag.decode(), start + b'parameters: {a: [%s]}\n' % tag
    yield 'a number of thousands of digits', start + b'parameters: {a: [0x%s]}\n' % (b'f' * 5000)
    yield 'a name of thousands of digits', start + b'parameters:\n  ? 0x%s\n  : [1]\n' % (b'f' * 390)
    yield 'a number in base 60', start + b'parameters: {a: [1%s]}\n' % (b':59' * 300000)
    yield 'a word of gigabytes', b'vest_batch: 1\ncommand: ["%s"]\nparameters: {a: [%s]}\n' % (b'{a}' * 100000, b'x' * 100000)
    yield 'words of gigabytes in all', b'vest_batch: 1\ncommand: [%s]\nparameters: {a: [%s], b: [%s]}\n' % (
        b','.join([b'"{a}"'] * 100), b'x' * 100000, b','.join(b'%d' % i for i in range(90000)))
    yield 'many runs of many parameters', start + b'parameters: {a: [%s]}\nruns:\n' % b','.join(b'%d' % i for i in range(1000)) + b''.join(
        b'  - {' + b', '.join(b'k%d: %d' % (j, i) for j in range(500)) + b'}\n' for i in range(90))
    yield 'a key twice, behind many', start + b''.join(b'k%d: 1\n' % i for i in range(30000)) + b'k29999: 1\n'
    yield 'all products', start + b'parameters: {%s}\n' % b', '.join(b'p%d: [0,1,2,3,4,5,6,7,8,9]' % i for i in range(500))
    for word in (b'{a', b'{}', b'{{a}}', b'{a!r}', b'{a.__class__}', b'{a:>999999999}', b'%(a)s', b'$(id)', b'{0}', b'{\xc3\xa9}'):
        yield 'a word is ' + word.decode(), b'vest_batch: 1\ncommand: [echo, "%s"]\nparameters: {a: [1]}\n' % word
    for where in (b'/', b'/proc', b'/dev', b'/sys', b'..', b'.', b'""', b'/proc/self/fd/0'):
        for kind in (b'files', b'folders'):
            yield '%s: %s' % (kind.decode(), where.decode()), start + b'%s: [a]\nparameters: {a: [%s]}\n' % (kind, where)


def result(data):
    """What a run of vest_batch left."""
    yield from json(data)
    for value in (b'NaN', b'1e999', b'-Infinity', b'"\\ud800"', b'"\\u001b[2J"', b'[' * 900 + b']' * 900, b'9' * 5000, b'1' + b'0' * 4000, b'{"a": {"b": NaN}}', b'"' + b'x' * 3000000 + b'"'):
        yield 'a value is ' + ascii(value[:12].decode()), data.replace(b'1.5', value, 1)
        yield 'a parameter is ' + ascii(value[:12].decode()), data.replace(b'"one"', value, 1)
    yield 'a name that writes', data.replace(b'"x"', b'"\\u001b[2J\\n\\u202e"', 1)
    yield 'a name that no text can hold', data.replace(b'"x"', b'"\\udfff"', 1)
    yield 'a key twice, behind many', b'{%s"k9": 1}' % b''.join(b'"k%d": 1, ' % i for i in range(200000))


def script(data):
    """Edits."""
    yield from yaml(data)
    edit = b'  - {op: %s, path: %s, value: %s}\n'
    for title, lines in (('names', [edit % (b'set', b'/name', b'n%d' % i) for i in range(12000)]),
                         ('mirrors', [edit % (b'insert', b'/objects/-', b'{name: b%d, mirror_of: tube}' % i) for i in range(3000)]),
                         ('undone and done again', [edit % (b'set', b'/name', b'n') + b'  - {op: undo}\n  - {op: redo}\n'] * 4000)):
        yield 'thousands of ' + title, b'vest_edits: 1\nedits:\n' + b''.join(lines)
    for path in (b'/' + b'a/' * 30000, b'//', b'/objects/-1', b'/objects/99999999999999999999', b'/objects/+0', b'/objects/00', b'/~1', b'""', b'/objects/tube/../name',
                 b'/objects/-/name', b'"/na\\0me"', b'/objects/tube/tube/centre/1/0/0'):
        for op in (b'set', b'insert', b'remove'):
            yield '%s %s' % (op.decode(), ascii(path[:20].decode())), b'vest_edits: 1\nedits:\n' + (edit % (op, path, b'1') if op != b'remove' else b'  - {op: remove, path: %s}\n' % path)


FORMATS = {'yaml': yaml, 'csv': table, 'ply': ply, 'stl': stl, 'obj': obj, 'msh': msh, 'vtk': vtk, 'urdf': urdf, 'json': json, 'nrrd': nrrd, 'mha': mha, 'nii': nii,
           'db': trainees, 'db-wal': database_log, 'bag': bag, 'log': raw_log, 'snapshot': snapshot, 'net': net, 'png': png, 'jpg': jpeg}
# Those whose name says more than its ending.
NAMES = {'slice': dicom, 'manifest.yaml': batch, '0f' * 32: result, 'plan.json': result, 'edits.yaml': script}


def lies(target, data):
    """(title, bytes) in the place of a file of this name."""
    ending = target.rsplit('.', 1)[-1]
    if target in NAMES:
        return NAMES[target](data)
    if ending == 'stl' and data[:5] == b'solid':
        return stl_text(data)
    return FORMATS.get(ending, numbers)(data)
