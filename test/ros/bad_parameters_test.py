#!/usr/bin/python3
"""slam_node and mapping2d_node with wrong parameters: every problem is named and the exit code is 2."""
import subprocess
import sys
import unittest

import roslib.packages
import rospy
import rostest


def run_node(name, parameters, kind="slam_node", arguments=()):
    for key, value in parameters.items():
        rospy.set_param(f"/{name}/{key}", value)
    command = [roslib.packages.find_node("planar_vslam", kind)[0], f"__name:={name}", *arguments]
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=30, text=True)


class BadParameters(unittest.TestCase):
    def test_every_problem_is_named(self):
        result = run_node("several", {"queue_size_images": 0, "map_perod": 3.0, "tf_rate": "fast",
                                      "odometry_source": "wheels", "map_period": 0.0, "obstacle_band_min": 0.5,
                                      "set": ["no.such_key=1", "orb.feature_count=many"]})
        self.assertEqual(result.returncode, 2, result.stdout)
        for problem in ("queue_size_images", "map_perod", "tf_rate", "wheels", "map_period", "no.such_key", "orb.feature_count"):
            self.assertIn(problem, result.stdout)

    def test_missing_configuration_file(self):
        result = run_node("missing", {"config": "/nonexistent/robot.yaml"})
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn("/nonexistent/robot.yaml", result.stdout)

    def test_unknown_transport(self):
        result = run_node("transport", {"image_transport": "pigeon"})
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn("pigeon", result.stdout)

    def test_lists_on_the_command_line(self):
        result = run_node("listed", {}, arguments=["_set:=[mode=localization, no.such_key=1]"])
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn("no.such_key", result.stdout)
        self.assertIn("map_file", result.stdout, "localization needs one")
        result = run_node("unlisted", {}, arguments=["_set:=mode=localization"])
        self.assertIn("expected a list", result.stdout)

    def test_mapping2d_node(self):
        result = run_node("saved", {"map_file": "/nonexistent/lab.pvm", "mode": "mapping"}, "mapping2d_node")
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn("/nonexistent/lab.pvm", result.stdout)
        self.assertIn("mode", result.stdout)


if __name__ == "__main__":
    rostest.rosrun("planar_vslam", "bad_parameters", BadParameters, sys.argv)
