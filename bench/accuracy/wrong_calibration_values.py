"""What wrong_calibration makes wrong, and run_calibration expects to be found."""
import math

SCALE, YAW_SCALE = 1.02, 1.03  # factors on what the wheels read
DELAY = 0.08  # s, odometry and laser stamps late
CAMERA_YAW, CAMERA_X = math.radians(2.0), 0.03  # rad, m, of the mount
