"""Baked nets that are well made and lie (lies.py): sections as vest_model writes them, with counts and values that contradict each other."""
import struct


def sections(data):
    """[tag, bytes of an element, elements] (docs/scene_format.md)."""
    out, at = [], 8
    while at + 12 <= len(data):
        tag, count, each = data[at:at + 4], *struct.unpack_from('<2I', data, at + 4)
        out.append([tag, each, data[at + 12:at + 12 + count * each]])
        at += 12 + count * each
    return out


def joined(parts, magic=b'VESTNET1'):
    return magic + b''.join(tag + struct.pack('<2I', len(body) // max(1, each), each) + body for tag, each, body in parts)


def net(data):
    parts = sections(data)
    if joined(parts) != data:
        return

    def with_(i, body, each=None):
        return joined(parts[:i] + [[parts[i][0], each or parts[i][1], body]] + parts[i + 1:])

    for i, (tag, each, body) in enumerate(parts):
        name = tag.decode('latin-1')
        yield name + ' is empty', with_(i, b'')
        yield name + ' has one more', with_(i, body + body[-each:])
        yield name + ' has one less', with_(i, body[:-each])
        yield name + ' twice', joined(parts[:i] + [parts[i]] + parts[i:])
        yield name + ' is not there', joined(parts[:i] + parts[i + 1:])
        yield name + ' a thousand times', with_(i, body * (1000 if len(body) < 60000 else 60000000 // len(body)))
        yield name + ' in bytes', with_(i, body, 1)
        yield name + ' of elements without size', joined(parts[:i] + [[tag, 0, b'']] + parts[i + 1:])
        for count, size in ((0xffffffff, each), (len(body) // each, 0xffffffff), (0x80000000, 2), (1 << 22, each)):
            yield '%s: %d of %d bytes' % (name, count, size), joined(parts[:i]) + tag + struct.pack('<2I', count, size) + body + joined(parts[i + 1:], b'')
        doubles = each % 8 == 0 and tag not in (b'SKUV', b'HNGK', b'LNKK')
        values = [struct.pack('<d', v) for v in (float('nan'), float('inf'), -1.0, 0.0, 1e308, 5e-324, 4.9e5)] if doubles else \
            [struct.pack('<I', v) for v in (0, 1, 0xffffffff, 0x7fc00000, 0x7f7fffff, 65535)]
        for value in values:
            step = len(value)
            for at in sorted({0, len(body) // 2 // each * each, len(body) - each}):
                if body[at:at + step]:
                    yield '%s: %s at %d' % (name, value.hex(), at), with_(i, body[:at] + value[:max(1, min(step, each))] + body[at + max(1, min(step, each)):])
            yield '%s: all %s' % (name, value.hex()), with_(i, (value * (len(body) // step + 1))[:len(body)])
        yield name + ' backwards', with_(i, b''.join(body[at:at + each] for at in range(len(body) - each, -1, -each)))
        if i + 1 < len(parts):
            yield name + ' behind the next', joined(parts[:i] + [parts[i + 1], parts[i]] + parts[i + 2:])
    yield 'no sections', b'VESTNET1'
    yield 'another version', b'VESTNET2' + data[8:]
    yield 'one byte more', data + b'\0'
