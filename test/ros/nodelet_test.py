#!/usr/bin/python3
"""SlamNodelet in a manager: loaded and unloaded many times, and idle where its parameters are wrong."""
import signal
import subprocess
import sys
import time
import unittest

import rosgraph
import rospy
import rostest
from ros_testing import PATIENCE, wait_for

ROUNDS = 5


def services():
    return {name for name, _ in rosgraph.Master('/nodelet_test').getSystemState()[2]}


def load(name):
    return subprocess.Popen(['/usr/lib/nodelet/nodelet', 'load', 'planar_vslam/SlamNodelet', 'manager', '__name:=' + name],
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


class SlamNodelet(unittest.TestCase):
    def test_comes_and_goes(self):
        rospy.wait_for_service('/manager/load_nodelet', PATIENCE)
        for _ in range(ROUNDS):
            loader = load('slam')
            wait_for(lambda: '/load_map' in services(), 'the nodelet')
            loader.send_signal(signal.SIGINT)  # which unloads it
            loader.communicate(timeout=PATIENCE)
            wait_for(lambda: '/load_map' not in services(), 'its end')
        self.assertIn('/manager/load_nodelet', services(), 'the manager lives on')

    def test_wrong_parameters_leave_it_idle(self):
        rospy.wait_for_service('/manager/load_nodelet', PATIENCE)
        rospy.set_param('/wrong/tf_rate', 'fast')
        loader = load('wrong')
        time.sleep(2.0)
        self.assertNotIn('/load_map', services())
        loader.send_signal(signal.SIGINT)
        loader.communicate(timeout=PATIENCE)
        self.assertIn('/manager/load_nodelet', services())


if __name__ == '__main__':
    rostest.rosrun('planar_vslam', 'nodelet', SlamNodelet, sys.argv)
