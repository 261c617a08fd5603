"""Files that are well made and lie: headers that contradict their data, bombs, numbers at the edges (hostile_files.py).

Each function yields (title, bytes) in the place of a good file of its format.
"""
import bz2
import functools
import gzip
import re
import sqlite3
import struct
import tempfile
import zlib

NUMBERS = [b'1e-400', b'1e400', b'-0', b'+1', b'1.', b'.5', b'0b1', b'1,5', b'1:30', b'0o17', b'.inf', b'-.nan', b'1_0', b'\xef\xbc\x91',
           b'9' * 400, b'0.' + b'0' * 400 + b'1', b'2147483648', b'-2147483649', b'9223372036854775808', b'18446744073709551616',
           b'1e15', b'-1e15', b'1e-15', b'4.9e-324', b'3.5e38', b'16777217']


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
    yield 'two formats', data.replace(b'format', b'format binary_big_endian 1.0\nformat', 1)
    yield 'faces first', data.replace(b'element vertex', b'element fxce', 1).replace(b'element face', b'element vertex', 1)
    for count in (0, 1, 2, 1 << 31, (1 << 32) - 1, (1 << 63) - 1, 1 << 64, -1):
        for element in (b'vertex', b'face'):
            yield '%d of %s' % (count, element.decode()), re.sub(b'element %s [0-9]+' % element, b'element %s %d' % (element, count), data)


def stl(data):
    for count in (0, 1, 1 << 31, (1 << 32) - 1, 85899345):
        yield '%d triangles' % count, b'\0' * 80 + struct.pack('<I', count) + data[84:]
    yield 'solid and binary', b'solid x\n' + b'\0' * 72 + data[80:]
    yield 'a solid without an end', b'solid a\n' + b'facet normal 0 0 1\nouter loop\n' * 100000
    yield '60 MB of one point', b'\0' * 80 + struct.pack('<I', 1200000) + b'\0' * 60000000
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
    for number in numbers(data):
        yield number


@functools.lru_cache(None)
def packed(how, megabytes):
    """Zeros."""
    maker = {'bz2': bz2.BZ2Compressor, 'zlib': zlib.compressobj, 'gzip': lambda: zlib.compressobj(9, zlib.DEFLATED, 31),
             'deflate': lambda: zlib.compressobj(9, zlib.DEFLATED, -15)}[how]()
    return b''.join(maker.compress(bytes(1 << 20)) for _ in range(megabytes)) + maker.flush()


def nrrd(data):
    head = b'NRRD0004\ntype: short\ndimension: 3\nsizes: %s\nspace: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n' \
           b'space origin: (0,0,0)\nendian: little\n'
    for sizes in (b'2 2 2', b'1 1 1', b'0 0 0', b'-1 2 2', b'65536 65536 65536', b'4294967296 1 1', b'1024 1024 256', b'2 2', b'2 2 2 2'):
        for encoding in (b'raw', b'gzip', b'bzip2', b'hex', b'ascii', b'txt', b'zrl'):
            body = {b'raw': bytes(16), b'gzip': gzip.compress(bytes(16)), b'bzip2': bz2.compress(bytes(16))}.get(encoding, b'0 ' * 8)
            yield '%s as %s' % (sizes.decode(), encoding.decode()), head % sizes + b'encoding: %s\n\n' % encoding + body
    yield 'a bomb', head % b'1024 1024 224' + b'encoding: gzip\n\n' + packed('gzip', 448)
    yield 'more than the header says', head % b'2 2 2' + b'encoding: gzip\n\n' + packed('gzip', 512)
    for line in (b'data file: LIST\na.raw\nb.raw', b'data file: %d.raw 1 1000000000 1', b'data file: /etc/passwd', b'data file: ../a',
                 b'data file: /dev/zero', b'data file: a.nrrd', b'byte skip: -1', b'byte skip: -2', b'byte skip: 99999999999', b'line skip: 999999999',
                 b'kinds: domain domain list', b'block size: 4294967295', b'content: ' + b'x' * 90000, b'measurement frame: (1,0,0)',
                 b'thicknesses: nan nan nan', b'space units: "a" "b" "c"', b'old min: nan', b'spacings: 1 1 1', b'key:=' + b'v' * 90000):
        yield line[:40].decode(), head % b'2 2 2' + line + b'\nencoding: raw\n\n' + bytes(16)
    yield 'blocks', (head % b'2 2 2').replace(b'short', b'block') + b'block size: 1000000\nencoding: raw\n\n' + bytes(16)
    for a, b in ((b'(1,0,0)', b'(nan,0,0)'), (b'(1,0,0)', b'none'), (b'(1,0,0)', b'(1e308,1e308,0)'), (b'(1,0,0)', b'(0,1,0)'),
                 (b'(0,0,0)\n', b'(1e300,0,0)\n'), (b'little', b'middle'), (b'dimension: 3', b'dimension: 17'), (b'dimension: 3', b'dimension: 0')):
        yield b.decode(), (head % b'2 2 2').replace(a, b, 1) + b'encoding: raw\n\n' + bytes(16)
    yield 'fields a thousand times', head % b'2 2 2' + b'encoding: raw\n' * 1000 + b'\n' + bytes(16)


def mha(data):
    head = b'ObjectType = Image\nNDims = %s\nDimSize = %s\nElementType = %s\nElementSpacing = 1 1 1\nOffset = 0 0 0\n%sElementDataFile = %s\n'
    for dims, size in ((b'3', b'2 2 2'), (b'3', b'65536 65536 65536'), (b'3', b'-2 2 2'), (b'3', b'0 0 0'), (b'10000', b'2 ' * 10000), (b'-1', b'2'),
                       (b'0', b''), (b'3', b'2 2'), (b'2', b'2 2'), (b'4', b'2 2 2 2'), (b'11', b'1 ' * 11)):
        for kind in (b'MET_SHORT', b'MET_DOUBLE', b'MET_OTHER', b'MET_STRING', b'MET_ASCII_CHAR'):
            yield '%s axes, %s, %s' % (dims.decode(), size[:20].decode(), kind.decode()), head % (dims, size, kind, b'', b'LOCAL') + bytes(64)
    for line in (b'ElementNumberOfChannels = 1000000\n', b'ElementNumberOfChannels = -1\n', b'HeaderSize = -1\n', b'HeaderSize = 99999999\n',
                 b'HeaderSize = -2\n', b'CompressedData = True\n', b'CompressedData = True\nCompressedDataSize = -1\n', b'CompressedDataSize = 99999999999\n',
                 b'BinaryData = False\n', b'BinaryDataByteOrderMSB = Perhaps\n', b'TransformMatrix = ' + b'nan ' * 9 + b'\n', b'TransformMatrix = 1 0\n',
                 b'Offset = 1e300 0 0\n', b'ElementSpacing = 0 0 0\n', b'Comment = ' + b'x' * 90000 + b'\n', b'AnatomicalOrientation = XXXXXXXXXX\n',
                 b'ElementSize = ' + b'1 ' * 20000 + b'\n', b'Modality = MET_MOD_NO\n', b'CenterOfRotation = 1\n', b'ID = ' + b'9' * 400 + b'\n'):
        yield line[:50].decode().strip(), head % (b'3', b'2 2 2', b'MET_SHORT', line, b'LOCAL') + bytes(16)
    for name in (b'LIST', b'LIST 3\na.raw', b'/etc/passwd', b'../a', b'/dev/zero', b'a.mha', b'slice%d.raw 1 1000000000 1', b'%s%s%s%n', b'', b'Local', b'x' * 5000):
        yield 'data in ' + name[:30].decode(), head % (b'3', b'2 2 2', b'MET_SHORT', b'', name) + bytes(16)
    yield 'a bomb', head % (b'3', b'1024 1024 224', b'MET_SHORT', b'CompressedData = True\n', b'LOCAL') + packed('zlib', 448)


def nii(data):
    """NIfTI-1: 348 bytes of header (nifti1.h)."""
    def changed(at, form, *values):
        b = bytearray(data)
        struct.pack_into(form, b, at, *values)
        return bytes(b)
    for i in range(8):
        for value in (0, 1, -1, 32767, -32768):
            yield 'dim[%d] %d' % (i, value), changed(40 + 2 * i, '<h', value)
    yield 'every dim 32767', changed(40, '<8h', 7, *[32767] * 7)
    for value in (0, 1, 3, 7, 128, 511, 1536, 2304, -1):
        yield 'datatype %d' % value, changed(70, '<h', value)
        yield 'bits %d' % value, changed(72, '<h', value)
    for value in (float('nan'), float('inf'), -1.0, 0.0, 1e30, 1e-30, 3.4e38):
        for at, name in ((80, 'spacing'), (108, 'vox_offset'), (112, 'slope'), (116, 'intercept'), (76, 'qfac'), (256, 'quatern'), (268, 'qoffset'), (280, 'srow')):
            yield '%s %g' % (name, value), changed(at, '<f', value)
    for value in (0, 347, 540, 1543569408, -1):
        yield 'header of %d' % value, changed(0, '<i', value)
    for code in (0, 1, 2, 9, -1, 32767):
        yield 'codes %d' % code, changed(252, '<2h', code, code)
    for size in (0, 8, 15, 16, 1 << 30, -16, 2147483632):
        yield 'extension of %d' % size, data[:348] + b'\1\0\0\0' + struct.pack('<2i', size, 4) + data[352:]
    yield 'magic ni1', changed(344, '4s', b'ni1\0')
    yield 'packed', gzip.compress(data)


def dicom(data):
    def element(group, number, vr, value, length=None):
        long = vr in (b'OB', b'OW', b'SQ', b'UN', b'UT')
        size = len(value) if length is None else length
        return struct.pack('<2H2s', group, number, vr) + struct.pack('<2xI' if long else '<H', size & (0xffffffff if long else 0xffff)) + value

    def whole(syntax, *elements):
        meta = element(2, 0x10, b'UI', syntax + b'\0' * (len(syntax) % 2))
        return bytes(128) + b'DICM' + element(2, 0, b'UL', struct.pack('<I', len(meta))) + meta + b''.join(elements)

    explicit, deflated, jpeg2000, rle = b'1.2.840.10008.1.2.1', b'1.2.840.10008.1.2.1.99', b'1.2.840.10008.1.2.4.90', b'1.2.840.10008.1.2.5'
    us = lambda group, number, value: element(group, number, b'US', struct.pack('<H', value))
    start = element(8, 0x16, b'UI', b'1.2.840.10008.5.1.4.1.1.2\0') + element(8, 0x18, b'UI', b'1.2\0') + element(8, 0x60, b'CS', b'CT') + \
        element(0x20, 0x0d, b'UI', b'1.2\0') + element(0x20, 0x0e, b'UI', b'1.2\0') + element(0x20, 0x32, b'DS', b'0\\0\\0 ') + \
        element(0x20, 0x37, b'DS', b'1\\0\\0\\0\\1\\0 ')

    def pixels(rows=2, columns=2, bits=16, stored=16, samples=1, frames=b'1 ', spacing=b'1\\1 ', data=bytes(8), vr=b'OW', length=None):
        return start + us(0x28, 2, samples) + element(0x28, 4, b'CS', b'MONOCHROME2 ') + element(0x28, 8, b'IS', frames) + us(0x28, 0x10, rows) + \
            us(0x28, 0x11, columns) + element(0x28, 0x30, b'DS', spacing) + us(0x28, 0x100, bits) + us(0x28, 0x101, stored) + \
            us(0x28, 0x102, (stored - 1) % 65536) + us(0x28, 0x103, 0) + element(0x7fe0, 0x10, vr, data, length)

    for title, options in (('as it should be', {}), ('65535 x 65535', dict(rows=65535, columns=65535)), ('no rows', dict(rows=0)), ('1 bit', dict(bits=1, stored=1)),
                           ('64 bits', dict(bits=64, stored=64)), ('more bits stored', dict(bits=8, stored=16)), ('no bits', dict(bits=0, stored=0)),
                           ('60000 samples', dict(samples=60000)), ('a billion frames', dict(frames=b'1000000000')), ('-1 frames', dict(frames=b'-1')),
                           ('no number of frames', dict(frames=b'1e9 ')), ('spacing nan', dict(spacing=b'nan\\nan ')), ('spacing 0', dict(spacing=b'0\\0 ')),
                           ('spacing negative', dict(spacing=b'-1\\-1 ')), ('spacing 1e308', dict(spacing=b'1e308\\1e308 ')),
                           ('pixels of 4 GB', dict(length=0xfffffffe)), ('pixels without an end', dict(length=0xffffffff)), ('one pixel', dict(data=b'\0\0')),
                           ('pixels of 8 bits', dict(vr=b'OB'))):
        for name, syntax in (('explicit', explicit), ('jpeg 2000', jpeg2000), ('rle', rle), ('unknown', b'1.2.3')):
            yield '%s, %s' % (title, name), whole(syntax, pixels(**options))
    squeeze = zlib.compressobj(9, zlib.DEFLATED, -15)
    yield 'a bomb', whole(deflated, squeeze.compress(pixels() + element(0x9, 1, b'OB', bytes(400 << 20))) + squeeze.flush())
    nested = b''.join(struct.pack('<2H2s2xI', 8, 0x1140, b'SQ', 0xffffffff) + struct.pack('<2HI', 0xfffe, 0xe000, 0xffffffff) for _ in range(20000))
    yield 'twenty thousand nested sequences', whole(explicit, nested, pixels())
    known = b''.join(struct.pack('<2H2s2xI', 8, 0x1140, b'SQ', 8 + 20 * (3000 - i)) + struct.pack('<2HI', 0xfffe, 0xe000, 20 * (3000 - i)) for i in range(3000))
    yield 'three thousand nested sequences with lengths', whole(explicit, known, pixels())
    item = lambda b: struct.pack('<2HI', 0xfffe, 0xe000, len(b)) + b
    stop = struct.pack('<2HI', 0xfffe, 0xe0dd, 0)
    for offsets in (b'', struct.pack('<I', 0xffffffff), struct.pack('<2I', 8, 4), bytes(40000)):
        yield 'offsets of %d' % len(offsets), whole(rle, pixels(data=item(offsets) + item(struct.pack('<16I', 2, 64, 66, *[0] * 13) + b'\x03\0\x03\0') + stop,
                                                                  vr=b'OB', length=0xffffffff))
    for segments in (0, 1, 15, 16, 0xffffffff):
        yield 'rle of %d segments' % segments, whole(rle, pixels(data=item(b'') + item(struct.pack('<16I', segments, *[64] * 15) + b'\x81\0' * 50) + stop,
                                                                 vr=b'OB', length=0xffffffff))
    size = b'\xff\x4f\xff\x51' + struct.pack('>HHIIIIIIIIHBBB', 41, 0, 60000, 60000, 0, 0, 1, 1, 0, 0, 1, 15, 1, 1)
    yield 'jpeg 2000 of 3.6 billion tiles', whole(jpeg2000, pixels(data=item(b'') + item(size + b'\0' * 100) + stop, vr=b'OB', length=0xffffffff))
    yield 'no group length', bytes(128) + b'DICM' + pixels()
    yield 'without a preamble', pixels()
    yield 'an element a hundred thousand times', whole(explicit, element(0x10, 0x10, b'PN', b'aa') * 100000, pixels())


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


def raw_log(data):
    for value in (0, 1, 0x7fffffff, 0xffffffff):
        for at in range(0, min(len(data) - 4, 64), 4):
            yield '%d at byte %d' % (value, at), data[:at] + struct.pack('<I', value) + data[at + 4:]
    yield 'often', data + data[16:] * 100000


FORMATS = {'yaml': yaml, 'csv': table, 'ply': ply, 'stl': stl, 'obj': obj, 'msh': msh, 'vtk': vtk, 'urdf': urdf, 'json': json, 'nrrd': nrrd, 'mha': mha, 'nii': nii,
           'db': trainees, 'bag': bag, 'log': raw_log}


def lies(target, data):
    """(title, bytes) in the place of a file of this name."""
    ending = target.rsplit('.', 1)[-1]
    if target == 'slice':
        return dicom(data)
    if ending == 'stl' and data[:5] == b'solid':
        return numbers(data)
    return FORMATS.get(ending, numbers)(data)
