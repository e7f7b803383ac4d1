"""Copies a dataset folder with one fault of a robot. Used by run_recordings."""
import math
import os
import re

from wrong_calibration_values import turned_camera


def rows(change):
    """A filter of csv lines: `change` takes the numbers of a line and gives them back changed."""
    def filtered(lines):
        for line in lines:
            if re.match(r'[-\d.]', line):
                yield ','.join('%.9g' % v if i else '%.9f' % v for i, v in enumerate(change([float(f) for f in line.rstrip(',\n').split(',')]))) + '\n'
            else:
                yield line
    return filtered


def scaled(factor):
    return rows(lambda v: [v[0], factor * v[1], factor * v[2], v[3]])


def later(seconds):
    return rows(lambda v: [v[0] + seconds] + v[1:])


def turned_mount(name, turn):
    """calibration.yaml with a mount whose rotation is `turn` of the old one; quaternions x, y, z, w."""
    def filtered(lines):
        for line in lines:
            match = re.match(r'(%s: \{t: \[[^\]]*\], q_xyzw: \[)([^\]]*)(\].*)' % name, line, re.DOTALL)
            q = turn([float(v) for v in match[2].split(',')]) if match else None
            yield match[1] + ', '.join('%.9f' % v for v in q) + match[3] if match else line
    return filtered


def rolled_over(q):
    x, y, z, w = q
    return [w, z, -y, -x]  # times half a turn about x, from the right


def half_of_the_images(lines):
    """Irregular, as a full queue drops them."""
    kept = (0, 1, 4, 6)
    image = 0
    for line in lines:
        if line[0].isdigit() or line[0] == '-':
            image += 1
            if (image - 1) % 8 not in kept:
                continue
        yield line


def wrong_yaw(lines):
    for line in lines:
        yield turned_camera(line, math.radians(2.0), 0.0)


# name -> (file, filter of its lines, what a line that names it says)
FAULTS = {
    'wheels 2 % long': ('odometry.csv', scaled(1.02), r'scale: by the wheels.* larger than by the laser'),
    'wheels sign-flipped': ('odometry.csv', scaled(-1.0), r'backwards'),
    'camera yaw off 2 deg': ('calibration.yaml', wrong_yaw, r'yaw'),
    'camera frame not optical': ('calibration.yaml', turned_mount('T_base_camera', lambda q: [0.0, 0.0, 0.0, 1.0]), r'body frame'),
    'odometry 80 ms late': ('odometry.csv', later(0.08), r"odometry's stamps are .* ms later"),
    'laser upside down': ('calibration.yaml', turned_mount('T_base_laser', rolled_over), r'upside down'),
    'odometry in mm': ('odometry.csv', scaled(1000.0), r'not in metres'),
    'half of the images missing': ('images.csv', half_of_the_images, r'lost on the way'),
}


def moved_mount(forward, up):
    """calibration.yaml with the camera elsewhere, m."""
    def filtered(lines):
        for line in lines:
            match = re.match(r'(T_base_camera: \{t: \[)([^\]]*)(\].*)', line, re.DOTALL)
            t = [float(v) for v in match[2].split(',')] if match else None
            yield '%s%.9g, %.9g, %.9g%s' % (match[1], t[0] + forward, t[1], t[2] + up, match[3]) if match else line
    return filtered


def focal_times(factor):
    def filtered(lines):
        for line in lines:
            yield re.sub(r'(f[xy]: )([\d.]+)', lambda m: '%s%.6f' % (m[1], factor * float(m[2])), line)
    return filtered


def tilted_up(degrees):
    """The camera turned about its own x axis, from the right."""
    s, c = math.sin(math.radians(degrees) / 2), math.cos(math.radians(degrees) / 2)
    return turned_mount('T_base_camera', lambda q: [c * q[0] + s * q[3], c * q[1] + s * q[2], c * q[2] - s * q[1], c * q[3] - s * q[0]])


def yawed(lines):
    for line in lines:
        yield turned_camera(line, math.pi, 0.0)


def jittered(seconds):
    """Stamps off by up to so much, in no order anybody could guess."""
    def change(v):
        return [v[0] + seconds * math.sin(12.9898 * v[0] * 43.0)] + v[1:]
    return rows(change)


def jittered_images(seconds):
    def filtered(lines):
        for line in lines:
            t, comma, rest = line.partition(',')
            yield '%.6f,%s' % (float(t) + seconds * math.sin(12.9898 * float(t) * 43.0), rest) if comma and t[0] != '#' else line
    return filtered


def whole_seconds(lines):
    for line in lines:
        t, comma, rest = line.partition(',')
        yield '%d,%s' % (int(float(t)), rest) if comma and t[0] != '#' else line


def turned_in_tf(degrees):
    s, c = math.sin(math.radians(degrees) / 2), math.cos(math.radians(degrees) / 2)
    return turned_mount('T_base_laser', lambda q: [c * q[0] + s * q[1], c * q[1] - s * q[0], c * q[2] + s * q[3], c * q[3] - s * q[2]])


# Relatives: others of which something was said once that nothing told them.
RELATIVES = {
    'camera 10 cm too high in tf': ('calibration.yaml', moved_mount(0.0, 0.1), r'height in tf'),
    'camera 5 cm too low in tf': ('calibration.yaml', moved_mount(0.0, -0.05), r'height in tf'),
    'camera 30 cm too far in front in tf': ('calibration.yaml', moved_mount(0.3, 0.0), r'mount|calibrat|camera'),
    'camera tilted by 7 deg in tf': ('calibration.yaml', tilted_up(7), r'tilt|height|camera'),
    'rear camera called front': ('calibration.yaml', yawed, r'backwards'),
    'focal length doubled': ('calibration.yaml', focal_times(2.0), r'focal|calibration|camera_info'),
    'focal length 3 % too long': ('calibration.yaml', focal_times(1.03), r'focal|calibrat'),
    'stamps of images in whole seconds': ('images.csv', whole_seconds, r'stamp'),
    'stamps of images 40 ms to and fro': ('images.csv', jittered_images(0.04), r'stamp|clock|contradict'),
    'heading of odometry in degrees': ('odometry.csv', rows(lambda v: v[:3] + [math.remainder(57.29578 * v[3], 2 * math.pi)]), r'turn|odometry'),
    'gyro that drifts 2 deg/s': ('odometry.csv', rows(lambda v: v[:3] + [v[3] + 0.035 * v[0]]), r'turn|wheels|odometry'),
    'odometry in steps of 2 cm': ('odometry.csv', rows(lambda v: [v[0], round(v[1] / 0.02) * 0.02, round(v[2] / 0.02) * 0.02, v[3]]), r'odometry|wheels'),
    'laser ranges in mm': ('scan.csv', rows(lambda v: v[:1] + [1000.0 * r for r in v[1:]]), r'laser'),
    'laser ranges halved': ('scan.csv', rows(lambda v: v[:1] + [0.5 * r for r in v[1:]]), r'laser'),
    'laser ranges 2 % long': ('scan.csv', rows(lambda v: v[:1] + [1.02 * r for r in v[1:]]), r'check the laser.s ranges'),
    'laser 150 ms late': ('scan.csv', later(0.15), r"laser's stamps are .* later"),
    'laser turned by 30 deg in tf': ('calibration.yaml', turned_in_tf(30), r'further to the right than tf says'),
    'laser turned by 5 deg in tf': ('calibration.yaml', turned_in_tf(5), r'laser'),
}


def make(folder, out, fault):
    """The folder with that fault: the changed file, and links to all others."""
    changed, lines_filter, _ = {**FAULTS, **RELATIVES}[fault]
    os.makedirs(out, exist_ok=True)
    for name in os.listdir(folder):
        source, target = os.path.join(os.path.abspath(folder), name), os.path.join(out, name)
        if os.path.lexists(target):
            os.remove(target)
        if name == changed:
            with open(source) as lines, open(target, 'w') as wrong:
                wrong.writelines(lines_filter(iter(lines)))
        else:
            os.symlink(source, target)
