"""A plain shaded drawing of a scene, by NumPy alone. Sessions have better ones (vest_render)."""
import struct
import zlib

import numpy as np

EYE, LOOK_AT = np.array([-0.03, -0.04, 0.125]), np.array([0.0, 0.05, 0.056])  # m, world
COLOURS = {"tube": (214, 120, 112), "vessel": (196, 70, 66), "cavity": (150, 84, 76)}


def _rotation(q):
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def _rod(begin, end, radius, around=10):
    axis = (end - begin) / np.linalg.norm(end - begin)
    side = np.cross(axis, [1, 0, 0] if abs(axis[0]) < 0.9 else [0, 1, 0])
    side /= np.linalg.norm(side)
    angle = 2 * np.pi * np.arange(around) / around
    ring = radius * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(axis, side))
    i, j = np.arange(around), np.roll(np.arange(around), -1)
    return np.vstack([begin + ring, end + ring, [end]]), np.vstack([
        np.stack([i, j, j + around], 1), np.stack([i, j + around, i + around], 1),
        np.stack([i + around, j + around, np.full(around, 2 * around)], 1)])


def _instrument(pose):
    """Shaft of 5 mm and two jaws, as the tip's pose says (Core's tip())."""
    tip, turn, jaw = pose[:3], _rotation(pose[3:7]), pose[7]
    hinge = tip - 0.016 * turn[:, 2]
    # In pieces: what begins behind the eye is left out.
    parts = [_rod(hinge - 0.01 * (k + 1) * turn[:, 2], hinge - 0.01 * k * turn[:, 2], 0.0025) for k in range(14)]
    for sign in (-1, 1):
        way = np.cos(jaw / 2) * turn[:, 2] + sign * np.sin(jaw / 2) * turn[:, 0]
        parts.append(_rod(hinge, hinge + 0.016 * way, 0.0011, 6))
    return parts


def draw(env, width=480, height=360, field_of_view=55.0):
    """@return uint8 height x width x 3"""
    forward = (LOOK_AT - EYE) / np.linalg.norm(LOOK_AT - EYE)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward])  # x right, y down, z away
    focal = 0.5 * width / np.tan(np.radians(field_of_view) / 2)
    picture = np.zeros((height, width, 3), np.uint8)
    depth = np.full((height, width), np.inf)
    bodies = [(env.positions(o), env.triangles(o), COLOURS.get(o, (200, 150, 140))) for o in env.objects]
    bodies += [(points, corners, (176, 182, 190)) for points, corners in _instrument(env.tip())]
    for points, corners, colour in bodies:
        seen = (np.asarray(points, float) - EYE) @ axes.T
        for corner in seen[corners]:
            if corner[:, 2].min() < 0.005:
                continue
            normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
            size = np.linalg.norm(normal)
            pixel = corner[:, :2] / corner[:, 2:] * focal + (width / 2, height / 2)
            low = np.maximum(np.floor(pixel.min(0)).astype(int), 0)
            high = np.minimum(np.ceil(pixel.max(0)).astype(int) + 1, (width, height))
            (ax, ay), (bx, by), (cx, cy) = pixel
            area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            if size == 0 or area == 0 or (high <= low).any():
                continue
            x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
            u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
            v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
            z = 1 / (u / corner[0, 2] + v / corner[1, 2] + (1 - u - v) / corner[2, 2] + 1e-12)
            there = depth[low[1]:high[1], low[0]:high[0]]
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (z < there) & (z > 0)
            there[hit] = z[hit]
            # Light at the eye: facing surfaces are bright, far ones dark.
            middle = corner.mean(0)
            light = abs(normal @ middle) / (size * np.linalg.norm(middle)) * (0.09 / np.linalg.norm(middle)) ** 2
            picture[low[1]:high[1], low[0]:high[0]][hit] = np.clip(np.array(colour) * (0.12 + 0.95 * light), 0, 255)
    return picture


def write_png(path, picture):
    """Writes uint8 height x width x 3."""
    height, width = picture.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in np.ascontiguousarray(picture, np.uint8))

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
                + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
