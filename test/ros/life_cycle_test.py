#!/usr/bin/python3
"""slam_node over a long life, beside a simulated robot: modes switched, maps loaded and nodes started many times, without a crash,
a hang or memory that grows; mapping2d_node on the map that was saved."""
import shutil
import signal
import subprocess
import sys
import unittest
import xmlrpc.client

import roslib.packages
import rospy
import rosgraph
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from planar_vslam.msg import State
from planar_vslam.srv import LoadMap, SaveMap, SetMode
from ros_testing import Recorder, resident_mib, wait_for
from std_srvs.srv import Trigger

MODES, LOADS, SETTLED = 20, 10, 5  # how often; after so many times memory no longer grows
GROWTH = 60.0  # MiB: less than a map each time


def call(name, kind, *arguments):
    answer = rospy.ServiceProxy(name, kind)(*arguments)
    if not answer.success:
        raise AssertionError('%s%s: %s' % (name, arguments, answer.message))


class LifeCycle(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = rospy.get_param('/slam/map_directory')
        cls.states = Recorder('state', State)
        cls.poses = Recorder('pose', PoseWithCovarianceStamped)
        cls.pid = xmlrpc.client.ServerProxy(rosgraph.Master('/life_cycle').lookupNode('/slam')).getPid('/life_cycle')[2]
        wait_for(lambda: len(cls.poses.messages) > 60, 'poses')
        call('save_map', SaveMap, 'lab')

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def frames(self, count):
        since = len(self.states.messages)
        wait_for(lambda: len(self.states.messages) >= since + count, 'frames')

    def repeat(self, times, act):
        """Memory stays as it was after the first few times."""
        for number in range(times):
            act(number)
            self.frames(2)
            if number == SETTLED:
                before = resident_mib(self.pid)
        grown = resident_mib(self.pid) - before
        print('%d times: memory grew by %.0f MiB' % (times, grown))
        self.assertLess(grown, GROWTH)

    def test_1_modes(self):
        def switch(number):
            mode = 'mapping' if number % 2 else 'localization'
            call('set_mode', SetMode, mode)
            wait_for(lambda: self.states.messages[-1].mode == mode, 'mode ' + mode)
        self.repeat(MODES, switch)
        self.assertEqual(self.states.messages[-1].mode, 'mapping')

    def test_2_maps(self):
        call('set_mode', SetMode, 'localization')
        self.repeat(LOADS, lambda number: call('load_map', LoadMap, 'lab'))
        found = len(self.poses.messages)
        wait_for(lambda: len(self.poses.messages) > found, 'a pose in the map that was loaded last')

    def test_3_resets_and_pauses(self):
        def act(_):
            call('pause', Trigger)
            call('resume', Trigger)
            call('reset', Trigger)
        self.repeat(LOADS, act)

    def test_4_starts(self):
        command = [roslib.packages.find_node('planar_vslam', 'slam_node')[0], '_map_file:=' + self.folder + '/lab.pvm',
                   '_mode:=localization', '_publish_tf:=false']
        for number in range(rospy.get_param('~starts')):
            name = 'start_%d' % number
            states = Recorder(name + '/state', State)
            node = subprocess.Popen(command + ['__name:=' + name, 'state:=' + name + '/state', 'pose:=' + name + '/pose',
                                               'map:=' + name + '/map', 'events:=' + name + '/events'])
            try:
                # Some end while they work, some before they have begun to listen to signals.
                at_once = number % 4 == 3
                wait_for(lambda: states.messages or at_once, 'state')
                node.send_signal(signal.SIGINT)
                self.assertIn(node.wait(30), (0, -signal.SIGINT) if at_once else (0,))
            finally:
                node.kill()
            states.subscriber.unregister()

    def test_5_mapping2d_node_shows_the_map(self):
        node = subprocess.Popen([roslib.packages.find_node('planar_vslam', 'mapping2d_node')[0], '_map_file:=' + self.folder + '/lab.pvm',
                                 '_set:=[mapping2d.resolution=0.1]', '__name:=shown', 'map:=shown/map', 'static_map:=shown/static_map'])
        try:
            grid = rospy.wait_for_message('shown/map', OccupancyGrid, 60.0)
            self.assertAlmostEqual(grid.info.resolution, 0.1)
            self.assertTrue(any(cell > 50 for cell in grid.data))
        finally:
            node.send_signal(signal.SIGINT)
            self.assertEqual(node.wait(30), 0)


if __name__ == '__main__':
    rospy.init_node('life_cycle_test')
    rostest.rosrun('planar_vslam', 'life_cycle', LifeCycle, sys.argv)
