#!/usr/bin/python3
"""A second decoder, written from docs/phantom_box_protocol.md and nothing else.

It shares no code with the driver, so an error that encoder and decoder of the driver have in common shows here.
  decoder_from_page.py PAGE EMULATOR   checks the page's example, then the bytes that the emulator writes.
"""
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
import tty

ARMS = ["left", "right", "third", "endoscope"]


def crc(data):
    c = 0xFFFF
    for b in data:
        c ^= b << 8
        for _ in range(8):
            c = ((c << 1) ^ 0x1021 if c & 0x8000 else c << 1) & 0xFFFF
    return c


def frames(data):
    """Yields (type, sequence, time, payload) of each good frame, and the number of bytes that belong to none."""
    at, skipped, found = 0, 0, []
    while at + 13 <= len(data):
        n = data[at + 3]
        if data[at:at + 2] != b"\x56\xb5" or n > 46:
            at, skipped = at + 1, skipped + 1
            continue
        if at + 13 + n > len(data):
            break
        kind, _, seq, t = struct.unpack_from("<BBHI", data, at + 2)
        check, end = struct.unpack_from("<HB", data, at + 10 + n)
        if check != crc(data[at + 2:at + 10 + n]) or end != (seq & 0xFF) ^ 0xA5:
            at, skipped = at + 1, skipped + 1
            continue
        found.append((kind, seq, t, data[at + 10:at + 10 + n]))
        at += 13 + n
    return found, skipped


def hello(p):
    major, minor, instruments, flags, rate, firmware = struct.unpack_from("<BBBBHH", p)
    return dict(major=major, minor=minor, instruments=instruments, light_post=flags & 1, start=flags >> 1 & 1,
                rate=rate, firmware=firmware, serial=p[8:24].rstrip(b"\0").decode("ascii"))


def motion(p):
    arms = {36: ["left", "right", "endoscope"], 46: ARMS}[len(p)]
    pedals, status, invalid = struct.unpack_from("<BBI", p)
    counts = {a: struct.unpack_from("<5h", p, 6 + 10 * i) for i, a in enumerate(arms)}
    return dict(pedals=pedals, status=status, invalid=invalid, counts=counts)


def expect(got, want, what):
    if got != want:
        sys.exit("%s: got %r, expected %r" % (what, got, want))


def example(page, name):
    text = open(page, encoding="utf-8").read().split("<!-- example %s -->" % name)[1]
    block = re.match(r"\s*((?:[0-9A-F]{2}\s+)+)", text).group(1)
    return bytes(int(x, 16) for x in block.split())


def check_page(page):
    expect(crc(b"123456789"), 0x29B1, "CRC check value")
    found, skipped = frames(example(page, "hello"))
    expect((len(found), skipped, found[0][:3]), (1, 0, (1, 0, 0)), "hello example, header")
    expect(hello(found[0][3]), dict(major=1, minor=0, instruments=3, light_post=1, start=1, rate=1000,
                                    firmware=258, serial="VEST-0001"), "hello example")
    found, skipped = frames(example(page, "motion"))
    expect((len(found), skipped, found[0][:3]), (1, 0, (2, 1, 1000)), "motion example, header")
    expect(motion(found[0][3]), dict(pedals=0x21, status=1, invalid=1 << 9, counts=dict(
        left=(100, -100, 12000, 1, 2), right=(-1, 0, 32767, -32767, -32768),
        endoscope=(5, -5, 10000, 256, 0))), "motion example")


def read_emulator(emulator, count, *arguments):
    """The first `count` bytes that a reader of a fresh emulator gets, and how many frames the emulator dropped."""
    with tempfile.TemporaryDirectory() as folder:
        link = os.path.join(folder, "box")
        process = subprocess.Popen([emulator, "--link", link, *arguments], stdout=subprocess.PIPE, text=True)
        try:
            for _ in range(500):
                if os.path.exists(link):
                    break
                time.sleep(0.02)
            fd = os.open(link, os.O_RDONLY | os.O_NOCTTY)
            tty.setraw(fd, termios.TCSANOW)
            data = b""
            while len(data) < count:
                piece = os.read(fd, 4096)
                if not piece:
                    break
                data += piece
            os.close(fd)
        finally:
            process.send_signal(signal.SIGTERM)
            said, _ = process.communicate()
        expect(process.returncode, 0, "exit status of the emulator after SIGTERM")
        expect(os.path.lexists(link), False, "link left behind")
        return data, int(re.search(r"dropped (\d+)", said).group(1))


def check_emulator(emulator):
    with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
        # Ends at once and holds: every frame must carry exactly these counts (1e-4 rad, 1e-5 m per count).
        file.write("t_s,left_yaw,left_insertion,right_jaw,third_roll,endoscope_pitch,footswitches\n"
                   "0,0.25,0.1234,0.5,-1.5,-0.05,42\n")
        file.flush()
        for instruments in (2, 3):
            data, dropped = read_emulator(emulator, 60000, "--trajectory", file.name, "--instruments", str(instruments))
            found, skipped = frames(data)
            expect(skipped, 0, "bytes that belong to no frame")
            expect(found[0][:3], (1, 0, 0), "first frame is a hello with sequence 0 at 0 us")
            expect(hello(found[0][3])["instruments"], instruments, "number of instruments")
            expect(hello(found[0][3])["start"], 1, "start flag of the first hello")
            # A reader that a busy machine holds up misses whole frames, which the emulator counts. No other may be missing.
            sequence = [f[1] for f in found]
            expect(sequence, sorted(set(sequence)), "sequence numbers that rise")
            if sequence[-1] + 1 - len(sequence) > dropped:
                sys.exit("%d frames are missing, and the emulator dropped %d" % (sequence[-1] + 1 - len(sequence), dropped))
            moves = [f for f in found if f[0] == 2]
            # Each second of the device begins with a hello, which 1,000 frames of motion follow.
            expect([f[2] for f in moves], [1000000 * (f[1] // 1001) + 1000 * (f[1] % 1001 - 1) for f in moves],
                   "device times")
            hellos = [f for f in found if f[0] == 1]
            expect([f[1:3] for f in hellos], [(1001 * (f[1] // 1001), 1000000 * (f[1] // 1001)) for f in hellos],
                   "times of hello frames")
            for f in moves:
                m = motion(f[3])
                expect((m["pedals"], m["status"], m["invalid"]), (42, 0, 0), "pedals, status, invalid")
                expect(m["counts"]["left"], (2500, 0, 12340, 0, 0), "left")
                expect(m["counts"]["right"], (0, 0, 12000, 0, 5000), "right")
                expect(m["counts"]["endoscope"], (0, -500, 10000, 0, 0), "endoscope")
                if instruments == 3:
                    expect(m["counts"]["third"], (0, 0, 5000, -15000, 0), "third")
            if len(moves) < 1000:
                sys.exit("only %d motion frames in 60,000 bytes" % len(moves))


if __name__ == "__main__":
    check_page(sys.argv[1])
    check_emulator(sys.argv[2])
    print("page and emulator agree")
