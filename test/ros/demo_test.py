#!/usr/bin/python3
"""demo.launch, short: a robot maps a part of the small laboratory, is found in its map, and drives to two goals."""
import os
import re
import signal
import subprocess
import sys
import tempfile
import unittest

import roslib.packages
import rostest

FOLDER = roslib.packages.get_pkg_dir('planar_vslam')
PATIENCE = 240.0  # s


class Demo(unittest.TestCase):
    def test_maps_localises_and_reaches_its_goals(self):
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(FOLDER, 'config/worlds/sample_lab.yaml'), encoding='utf-8') as file:
                world, count = re.subn(r'laps: 1\.1\b', 'laps: 0.4', file.read())
            self.assertEqual(count, 1)
            with open(folder + '/short.yaml', 'w', encoding='utf-8') as file:
                file.write(world)
            command = ['roslaunch', 'planar_vslam', 'demo.launch', 'world:=%s/short.yaml' % folder, 'goals:=2',
                       'map_directory:=' + folder, 'map_name:=short']
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            try:
                output, _ = process.communicate(timeout=PATIENCE)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGINT)  # roslaunch ends its nodes
                output, _ = process.communicate(timeout=40)
                self.fail('not over after %g s:\n%s' % (PATIENCE, output))
            self.assertIn('2 of 2 goals reached, 0 collisions', output)
            self.assertIn(': well', output)
            self.assertEqual(len(re.findall(r'^goal +\d+ +reached', output, re.MULTILINE)), 2, output)
            self.assertTrue(all(os.path.exists('%s/short.%s' % (folder, kind)) for kind in ('pvm', 'yaml', 'pgm')))

    def test_wrong_parameters_are_named(self):
        command = [roslib.packages.find_node('planar_vslam', 'demo_goals')[0], '_goals:=0', '_speed:=1']
        result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=60, text=True)
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn('goals', result.stdout)
        self.assertIn('speed', result.stdout)


if __name__ == '__main__':
    rostest.rosrun('planar_vslam', 'demo', Demo, sys.argv)
