#!/usr/bin/python3
"""`planar_vslam doctor --live` on a robot that drives: the checks of a recording, of topics that are there now."""
import os
import subprocess
import sys
import tempfile
import unittest

import roslib.packages
import rospy
import rostest
from nav_msgs.msg import Odometry


class DoctorLive(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.wait_for_message('odom', Odometry, timeout=120.0)
        cls.program = roslib.packages.find_node('planar_vslam', 'planar_vslam')[0]

    def doctor(self, *arguments, **environment):
        return subprocess.run([self.program, 'doctor', '--live', *arguments], env=dict(os.environ, **environment),
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=200.0, check=False)

    def test_says_what_the_robot_sends(self):
        with tempfile.TemporaryDirectory() as folder:
            result = self.doctor('--seconds', '12', '--set', 'topics.odometry=/odom', '--quiet', TMPDIR=folder)
            self.assertEqual(os.listdir(folder), [], 'nothing is left')
        self.assertNotEqual(result.stdout, '', result.stderr)
        lines = {line.split()[1]: line for line in reversed(result.stdout.splitlines())}
        for what, part in (('topics', '/image'), ('tf', 'base_footprint'), ('camera', '640x480'), ('images', 'a second'),
                           ('odometry', 'm/s'), ('laser', 'sweeps')):
            self.assertIn(part, lines[what])
        self.assertTrue(lines['topics'].startswith('ok'), lines['topics'])
        self.assertIn('heard /tf_static', result.stderr)

    def test_what_it_cannot_choose_or_reach_is_one_line(self):
        result = self.doctor('--seconds', '8', '--quiet')
        self.assertEqual(result.returncode, 2)
        self.assertIn('several nav_msgs/Odometry topics', result.stderr.splitlines()[-1])
        result = self.doctor('--seconds', '3', '--quiet', ROS_MASTER_URI='http://localhost:1')
        self.assertEqual(result.returncode, 2)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        self.assertIn('no ROS master at http://localhost:1', result.stderr)


if __name__ == '__main__':
    rospy.init_node('doctor_live_test')
    rostest.rosrun('planar_vslam', 'doctor_live', DoctorLive, sys.argv)
