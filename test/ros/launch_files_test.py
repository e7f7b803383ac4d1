#!/usr/bin/python3
"""Every launch file can be read with its arguments, and names the nodes it should."""
import os
import subprocess
import sys
import unittest

import roslib.packages
import rostest

# launch file, arguments -> nodes
CASES = [('slam.launch', [], ['/slam']),
         ('slam.launch', ['rviz:=true'], ['/rviz', '/slam']),
         ('replay.launch', ['bag:=/nonexistent.bag', 'rviz:=false'], ['/play', '/slam']),
         ('simulation.launch', [], ['/simulation']),
         ('simulation.launch', ['world:=office', 'variants:=[light=daylight, glossy]', 'start:=[2, 1, 90]', 'rviz:=true'],
          ['/rviz', '/simulation']),
         ('demo.launch', [], ['/simulation', '/slam']),
         ('demo.launch', ['rviz:=true', 'variants:=[moved-furniture]'], ['/rviz', '/simulation', '/slam'])]


class LaunchFiles(unittest.TestCase):
    def test_name_their_nodes(self):
        for name, arguments, nodes in CASES:
            command = ['roslaunch', '--nodes', 'planar_vslam', name] + arguments
            result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            self.assertEqual(result.returncode, 0, '%s: %s' % (' '.join(command), result.stderr))
            self.assertEqual(sorted(result.stdout.split()), nodes, ' '.join(command))

    def test_none_is_left_out(self):
        folder = os.path.join(roslib.packages.get_pkg_dir('planar_vslam'), 'launch')
        self.assertEqual(sorted(os.listdir(folder)), sorted({name for name, _, _ in CASES}))


if __name__ == '__main__':
    rostest.rosrun('planar_vslam', 'launch_files', LaunchFiles, sys.argv)
