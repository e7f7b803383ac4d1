"""What wrong_calibration makes wrong, and run_calibration expects to be found."""
import math
import re

SCALE, YAW_SCALE = 1.02, 1.03  # factors on what the wheels read
DELAY = 0.08  # s, odometry and laser stamps late
CAMERA_YAW, CAMERA_X = math.radians(2.0), 0.03  # rad, m, of the mount


def turned_camera(text, yaw, forward):
    """A calibration.yaml whose camera is turned to the left about the base's z axis, rad, and moved forward, m."""
    match = re.search(r'(T_base_camera: \{t: \[)([^\]]*)(\], q_xyzw: \[)([^\]]*)\]', text)
    if not match:
        return text
    t, (x, y, z, w) = [float(v) for v in match[2].split(',')], [float(v) for v in match[4].split(',')]
    s, c = math.sin(yaw / 2), math.cos(yaw / 2)
    turned = (c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z)
    t[0] += forward
    new = match[1] + ', '.join('%.9g' % v for v in t) + match[3] + ', '.join('%.9f' % v for v in turned) + ']'
    return text[:match.start()] + new + text[match.end():]
