#!/usr/bin/python3
"""Writes a dataset folder as the rosbag a robot would have recorded: compressed images, camera_info, odometry, tf, scans."""
import argparse
import csv
import math
import pathlib

import rosbag
import rospy
import yaml
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, CompressedImage, LaserScan
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

EPOCH = 1_000_000  # s, where second 0 of the folder lies: stamps of zero are not valid in ROS
BASE, ODOM, CAMERA, LASER = "base_footprint", "odom", "camera_optical_frame", "laser_frame"


def stamped(seconds, frame):
    return Header(stamp=rospy.Time(EPOCH) + rospy.Duration.from_sec(float(seconds)), frame_id=frame)


def rows(path):
    with open(path, newline="") as file:
        return [row for row in csv.reader(file) if row and not row[0].startswith("#")]


def transform(header, child, translation, rotation):
    message = TransformStamped(header=header, child_frame_id=child)
    for axis, value in zip("xyz", translation):
        setattr(message.transform.translation, axis, float(value))
    for axis, value in zip("xyzw", rotation):
        setattr(message.transform.rotation, axis, float(value))
    return message


def images(folder, calibration):
    camera = calibration["camera"]
    fx, fy, cx, cy = (float(camera[key]) for key in ("fx", "fy", "cx", "cy"))
    distortion = [float(camera.get(key, 0.0)) for key in ("k1", "k2", "p1", "p2", "k3")]
    for seconds, name in rows(folder / "images.csv"):
        header = stamped(seconds, CAMERA)
        image = CompressedImage(header=header, format="jpeg", data=(folder / name).read_bytes())
        info = CameraInfo(header=header, width=camera["width"], height=camera["height"], D=distortion)
        info.distortion_model = "plumb_bob"
        info.K = [fx, 0, cx, 0, fy, cy, 0, 0, 1]
        info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        info.P = [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0]
        yield header.stamp, "/camera/image_raw/compressed", image
        yield header.stamp, "/camera/camera_info", info


def odometry(folder):
    for row in rows(folder / "odometry.csv"):
        seconds, x, y, theta = row[:4]
        header = stamped(seconds, ODOM)
        rotation = (0.0, 0.0, math.sin(float(theta) / 2), math.cos(float(theta) / 2))
        message = Odometry(header=header, child_frame_id=BASE)
        message.pose.pose.position.x, message.pose.pose.position.y = float(x), float(y)
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = rotation[2], rotation[3]
        yield header.stamp, "/odom", message
        yield header.stamp, "/tf", TFMessage([transform(header, BASE, (x, y, 0.0), rotation)])


def scans(folder, calibration):
    if not (folder / "scan.csv").exists():
        return
    laser = calibration["laser"]
    for row in rows(folder / "scan.csv"):
        message = LaserScan(header=stamped(row[0], LASER), ranges=[float(value) for value in row[1:]])
        message.angle_min, message.angle_increment = laser["angle_min"], laser["angle_increment"]
        message.angle_max = message.angle_min + message.angle_increment * (len(message.ranges) - 1)
        message.range_min, message.range_max = laser.get("range_min", 0.05), laser["range_max"]
        yield message.header.stamp, "/scan", message


def mounts(calibration):
    header = stamped(0.0, BASE)
    message = TFMessage()
    for key, child in (("T_base_camera", CAMERA), ("T_base_laser", LASER)):
        if key in calibration:
            mount = calibration[key]
            message.transforms.append(transform(header, child, mount["t"], mount["q_xyzw"]))
    return header.stamp, "/tf_static", message


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("bag", type=pathlib.Path)
    parser.add_argument("--until", type=float, help="leave out what is later than this many seconds")
    arguments = parser.parse_args()
    calibration = yaml.safe_load((arguments.folder / "calibration.yaml").read_text())
    messages = [mounts(calibration)]
    messages += odometry(arguments.folder)
    messages += scans(arguments.folder, calibration)
    messages += images(arguments.folder, calibration)
    if arguments.until is not None:
        end = stamped(arguments.until, "").stamp
        messages = [entry for entry in messages if entry[0] <= end]
    messages.sort(key=lambda entry: entry[0])
    with rosbag.Bag(str(arguments.bag), "w") as bag:
        for stamp, topic, message in messages:
            bag.write(topic, message, stamp)


if __name__ == "__main__":
    main()
