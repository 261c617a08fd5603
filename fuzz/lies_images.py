"""Images that are well made and lie (lies.py)."""
import bz2
import functools
import gzip
import struct
import zlib


@functools.lru_cache(None)
def packed(how, megabytes):
    """Zeros."""
    maker = {'bz2': bz2.BZ2Compressor, 'zlib': zlib.compressobj, 'gzip': lambda: zlib.compressobj(9, zlib.DEFLATED, 31),
             'deflate': lambda: zlib.compressobj(9, zlib.DEFLATED, -15)}[how]()
    return b''.join(maker.compress(bytes(1 << 20)) for _ in range(megabytes)) + maker.flush()


def last(how, megabytes, value, first=b''):
    """A head, zeros, and one value behind them. The pieces of a stream that begin anew are the same: one is packed."""
    check = {'gzip': zlib.crc32, 'zlib': zlib.adler32}[how]
    begin = zlib.compressobj(9, zlib.DEFLATED, {'gzip': 31, 'zlib': 15}[how]).flush()[:{'gzip': 10, 'zlib': 2}[how]]
    maker = zlib.compressobj(9, zlib.DEFLATED, -15)
    begin += maker.compress(first) + maker.flush(zlib.Z_FULL_FLUSH)
    piece = maker.compress(bytes(1 << 20)) + maker.flush(zlib.Z_FULL_FLUSH)
    rest = bytes((1 << 20) - len(value)) + value
    total = check(first)
    for _ in range(megabytes - 1):
        total = check(bytes(1 << 20), total)
    total = check(rest, total)
    end = struct.pack('<2I', total, (len(first) + (megabytes << 20)) % 2**32) if how == 'gzip' else struct.pack('>I', total)
    return begin + piece * (megabytes - 1) + maker.compress(rest) + maker.flush() + end


def nrrd(data):
    head = b'NRRD0004\ntype: short\ndimension: 3\nsizes: %s\nspace: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n' \
           b'space origin: (0,0,0)\nendian: little\n'
    for sizes in (b'2 2 2', b'1 1 1', b'0 0 0', b'-1 2 2', b'65536 65536 65536', b'4294967296 1 1', b'1024 1024 256', b'2 2', b'2 2 2 2'):
        for encoding in (b'raw', b'gzip', b'bzip2', b'hex', b'ascii', b'txt', b'zrl'):
            body = {b'raw': bytes(16), b'gzip': gzip.compress(bytes(16)), b'bzip2': bz2.compress(bytes(16))}.get(encoding, b'0 ' * 8)
            yield '%s as %s' % (sizes.decode(), encoding.decode()), head % sizes + b'encoding: %s\n\n' % encoding + body
    yield 'a bomb', head % b'1024 1024 224' + b'encoding: gzip\n\n' + packed('gzip', 448)
    yield 'more than the header says', head % b'2 2 2' + b'encoding: gzip\n\n' + packed('gzip', 512)
    for kind, form, megabytes in ((b'double', '<d', 2048), (b'float', '<f', 1024)):
        for value in (float('inf'), 1e31):
            yield 'the last %s is %g' % (kind.decode(), value), (head % b'1024 1024 256').replace(b'short', kind) + b'encoding: gzip\n\n' + \
                last('gzip', megabytes, struct.pack(form, value))
    for line in (b'data file: ../../../../etc/passwd', b'data file: LIST 2\n/etc/passwd\n/etc/passwd', b'data file: ~root/.profile', b'data file: http://localhost/a',
                 b'data file: /proc/self/mem', b'data file: /dev/stdin', b'data file: a.nrrd\0', b'datafile: /etc/passwd', b'DATA FILE: /etc/passwd',
                 b'data file: LIST\na.raw\nb.raw', b'data file: %d.raw 1 1000000000 1', b'data file: /etc/passwd', b'data file: ../a',
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
    for name in (b'../../../../etc/passwd', b'/proc/self/mem', b'/dev/stdin', b'~root/.profile', b'http://localhost/a', b'LIST 2D\n/etc/passwd\n/etc/passwd', b'LOCAL\0',
                 b'%d 1 2 1', b'LIST', b'LIST 3\na.raw', b'/etc/passwd', b'../a', b'/dev/zero', b'a.mha', b'slice%d.raw 1 1000000000 1', b'%s%s%s%n', b'', b'Local', b'x' * 5000):
        yield 'data in ' + name[:30].decode(), head % (b'3', b'2 2 2', b'MET_SHORT', b'', name) + bytes(16)
    yield 'a bomb', head % (b'3', b'1024 1024 224', b'MET_SHORT', b'CompressedData = True\n', b'LOCAL') + packed('zlib', 448)
    for kind, form, megabytes in ((b'MET_DOUBLE', '<d', 2048), (b'MET_FLOAT', '<f', 1024)):
        yield 'the last %s is infinite' % kind.decode(), head % (b'3', b'1024 1024 256', kind, b'CompressedData = True\n', b'LOCAL') + \
            last('zlib', megabytes, struct.pack(form, float('inf')))


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
    yield 'packed twice', gzip.compress(gzip.compress(data))
    yield 'packed, then cut', gzip.compress(data)[:-20]
    yield 'packed, a wrong sum', gzip.compress(data)[:-8] + bytes(8)
    yield 'a packed bomb', gzip.compress(data[:352]) + packed('gzip', 600)
    yield 'a packed bomb of its size', gzip.compress(changed(40, '<8h', 3, 1024, 1024, 224, 1, 1, 1, 1)[:352]) + packed('gzip', 448)
    for kind, bits, form, megabytes in ((64, 64, '<d', 2048), (16, 32, '<f', 1024)):
        large = bytearray(changed(40, '<8h', 3, 1024, 1024, 256, 1, 1, 1, 1)[:352])
        struct.pack_into('<2h', large, 70, kind, bits)
        yield 'the last of type %d is infinite' % kind, last('gzip', megabytes, struct.pack(form, float('inf')), bytes(large))
    yield 'turned bytes', b''.join(data[i:i + 2][::-1] for i in range(0, 352, 2)) + data[352:]
    yield 'the second kind of header', struct.pack('<i8s', 540, b'n+2\0\r\n\x1a\n') + bytes(528) + data[352:]
    yield 'data in another file', changed(344, '4s', b'ni1\0')[:348]
    for at in range(0, 348, 4):
        yield 'ones at byte %d' % at, data[:at] + b'\xff' * 4 + data[at + 4:]


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
    for syntax in (b'1.2.840.10008.1.2', b'1.2.840.10008.1.2.2', b'1.2.840.10008.1.2.4.50', b'1.2.840.10008.1.2.4.70', b'1.2.840.10008.1.2.4.80', b'1.2.840.10008.1.2.4.100',
                   b'1.2.840.10008.1.2.4.201', b'', b'1.2.840.10008.1.2.1' + b'.9' * 2000, b'..', b'\x1b[2J'):
        yield 'syntax ' + ascii(syntax[:30].decode()), whole(syntax, pixels())
    for group, number, vr, name in ((0x20, 0x32, b'DS', 'position'), (0x20, 0x37, b'DS', 'orientation'), (0x28, 0x1052, b'DS', 'intercept'), (0x28, 0x1053, b'DS', 'slope'),
                                    (8, 5, b'CS', 'character set'), (0x10, 0x10, b'PN', 'patient'), (0x18, 0x50, b'DS', 'thickness')):
        for value in (b'', b'nan ', b'1e999 ', b'1e308\\1e308\\1e308 ', b'0\\0\\0\\0\\0\\0 ', b'1\\2 ', b'a\\b\\c ', b'ISO 2022 IR 999 ', b'\x1b[2J', b'\x1b$)C\xff\xff', b'9' * 60000, b'\\' * 60000):
            yield '%s is %s' % (name, ascii(value[:12].decode('latin-1'))), whole(explicit, pixels(), element(group, number, vr, value)) if (group, number) > (0x28, 0x30) else \
                whole(explicit, start, element(group, number, vr, value), pixels()[len(start):])
    for inner in (b'', item(b''), item(b'\xff' * 8), item(struct.pack('<2HI', 8, 0x1140, 0xffffffff)) * 1000, struct.pack('<2HI', 0xfffe, 0xe000, 0xfffffff0), stop * 3,
                  struct.pack('<2HI', 0xfffe, 0xe00d, 0) * 1000, pixels()):
        for length in (None, 0xffffffff, 0, 7, 0x7fffffff):
            yield 'a sequence of %d bytes, length %s' % (len(inner), length), whole(explicit, element(8, 0x1140, b'SQ', inner, length), pixels())
            yield 'unknown of %d bytes, length %s' % (len(inner), length), whole(explicit, element(9, 0x1001, b'UN', inner, length), pixels())
    yield 'a hundred thousand fragments', whole(jpeg2000, pixels(data=item(b'') + item(b'\xff\x4f') * 100000 + stop, vr=b'OB', length=0xffffffff))
    yield 'fragments without an end', whole(rle, pixels(data=item(b'') + item(bytes(66)), vr=b'OB', length=0xffffffff))
    yield 'a fragment longer than the file', whole(rle, pixels(data=item(b'') + struct.pack('<2HI', 0xfffe, 0xe000, 0x7ffffff0), vr=b'OB', length=0xffffffff))
    yield 'pixels twice', whole(explicit, pixels(), pixels()[len(start):])
    yield 'elements backwards', whole(explicit, pixels()[len(start):], start)
    yield 'no group length', bytes(128) + b'DICM' + pixels()
    yield 'without a preamble', pixels()
    yield 'an element a hundred thousand times', whole(explicit, element(0x10, 0x10, b'PN', b'aa') * 100000, pixels())


def png(data):
    def chunk(kind, body, length=None, check=None):
        return struct.pack('>I', len(body) if length is None else length) + kind + body + struct.pack('>I', zlib.crc32(kind + body) if check is None else check)

    def whole(*chunks):
        return b'\x89PNG\r\n\x1a\n' + b''.join(chunks) + chunk(b'IEND', b'')

    def head(width, height, bits=8, colour=2, interlaced=0):
        return chunk(b'IHDR', struct.pack('>2I5B', width, height, bits, colour, 0, 0, interlaced))

    rows = chunk(b'IDAT', zlib.compress(b'\0' + bytes(200) * 3 * 64))
    for width, height in ((1, 1), (3, 3), (0, 0), (1, 1000000), (1000000, 1), (65535, 65535), (2147483647, 1), (4294967295, 4294967295), (3000, 3000), (8000, 8000), (1, 9437184)):
        yield '%d x %d' % (width, height), whole(head(width, height), rows)
    for bits, colour in ((16, 6), (16, 2), (1, 0), (1, 3), (2, 2), (8, 7), (0, 0), (255, 255)):
        yield '%d bits of colour %d' % (bits, colour), whole(head(64, 64, bits, colour), rows)
    yield 'interlaced', whole(head(3000, 3000, interlaced=1), chunk(b'IDAT', packed('zlib', 30)))
    yield 'a bomb', whole(head(64, 64), chunk(b'IDAT', packed('zlib', 900)))
    yield 'nine megapixels of nothing', whole(head(3000, 3000), chunk(b'IDAT', packed('zlib', 27)))
    for kind, body in ((b'iCCP', b'a\0\0' + packed('zlib', 900)), (b'zTXt', b'a\0\0' + packed('zlib', 900)), (b'iTXt', b'a\0\1\0\0\0' + packed('zlib', 900)), (b'tEXt', b'a\0' + b'\x1b[2J' * 90000),
                       (b'PLTE', bytes(5)), (b'PLTE', bytes(769)), (b'tRNS', bytes(9000)), (b'gAMA', bytes(4)), (b'sBIT', b'\xff' * 3), (b'eXIf', b'MM\0*' + b'\xff' * 60), (b'acTL', b'\xff' * 8)):
        yield 'a chunk ' + kind.decode(), whole(head(64, 64), chunk(kind, body), rows)
    yield 'a hundred thousand chunks', whole(head(64, 64), chunk(b'tEXt', b'a\0b') * 100000, rows)
    yield 'a chunk of 4 GB', whole(head(64, 64), chunk(b'IDAT', b'', 0xffffffff))
    yield 'a wrong sum', whole(head(64, 64), chunk(b'IDAT', b'', check=7))
    yield 'two heads', whole(head(64, 64), head(65000, 65000), rows)
    yield 'no end', data[:-12]


def jpeg(data):
    frame = max(data.find(b'\xff\xc0'), data.find(b'\xff\xc2'))
    sized = lambda height, width: data[:frame + 5] + struct.pack('>2H', height, width) + data[frame + 9:]
    for height, width in ((0, 64), (64, 0), (65535, 65535), (3000, 3000), (8000, 8000), (65500, 144), (1, 1)):
        yield '%d x %d' % (width, height), sized(height, width)
    last = data[data.rfind(b'\xff\xda'):-2]
    for count in (100, 3000):
        yield '%d scans more' % count, data[:-2] + last * count + data[-2:]
        yield '%d scans more of nine megapixels' % count, sized(3000, 3000)[:-2] + last * count + data[-2:]
    small = b'\xff\xc0' + struct.pack('>HB2H', 11, 8, 64, 64) + b'\1\1\x11\0'
    # A marker without a length, then a comment: who reads a length there comes to another frame.
    yield 'a frame within a comment', b'\xff\xd8\xff\x01\xff\xfe' + struct.pack('>H', 65535) + bytes(65530) + small + bytes(30) + sized(30000, 30000)[2:]
    yield 'a frame twice', data[:frame] + small + data[frame:]
    for marker in (0xd0, 0xd9, 0xda, 0x01, 0xff, 0x00, 0xc4, 0xcc, 0xdb, 0xdd, 0xe1, 0xfe):
        for length in (0, 1, 2, 65535):
            yield 'a segment %02x of %d' % (marker, length), data[:2] + b'\xff%c' % marker + struct.pack('>H', length) + data[2:]
    for at in range(frame, min(frame + 20, len(data) - 1)):
        yield 'ones at byte %d' % at, data[:at] + b'\xff' + data[at + 1:]
    yield 'turned by what its camera says', data[:2] + b'\xff\xe1' + struct.pack('>H', 34) + b'Exif\0\0MM\0*\0\0\0\x08\0\1\x01\x12\0\3\0\0\0\1\0\7\0\0\0\0\0\x08' + data[2:]
