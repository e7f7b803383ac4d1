#!/usr/bin/python3
"""Every launch file can be read with its arguments, and names the nodes it should."""
import glob
import os
import subprocess
import sys
import unittest
import xml.etree.ElementTree

import roslaunch.config
import roslaunch.core
import roslib.packages
import rostest
import yaml

# launch file, arguments -> nodes
CASES = [('slam.launch', [], ['/slam']),
         ('slam.launch', ['rviz:=true'], ['/rviz', '/slam']),
         ('replay.launch', ['bag:=/nonexistent.bag', 'rviz:=false'], ['/play', '/slam']),
         ('localization.launch', ['map_file:=/maps/lab.pvm'], ['/slam']),
         ('localization.launch', ['map_file:=/maps/lab.pvm', 'pose:=amcl_pose', 'rviz:=true'], ['/rviz', '/slam']),
         ('pepper.launch', [], ['/slam']),
         ('pepper.launch', ['driver:=/pepper_robot', 'camera:=bottom', 'mode:=localization', 'map_file:=/maps/lab.pvm', 'rviz:=true'],
          ['/rviz', '/slam']),
         ('simulation.launch', [], ['/simulation']),
         ('simulation.launch', ['world:=office', 'variants:=[light=daylight, glossy]', 'start:=[2, 1, 90]', 'rviz:=true'],
          ['/rviz', '/simulation']),
         ('navigation.launch', [], ['/move_base']),
         ('navigation.launch', ['planner:=move_base'], ['/move_base']),
         ('demo.launch', [], ['/demo_goals', '/move_base', '/simulation', '/slam']),
         ('demo.launch', ['rviz:=true', 'variants:=[moved-furniture]'],
          ['/demo_goals', '/move_base', '/rviz', '/simulation', '/slam'])]

FOLDER = os.path.join(roslib.packages.get_pkg_dir('planar_vslam'), 'launch')


def node_of(name, *arguments):
    """What roslaunch makes of the launch file's slam_node."""
    config = roslaunch.config.load_config_default([(os.path.join(FOLDER, name), list(arguments))], None, verbose=False)
    return [node for node in config.nodes if node.type == 'slam_node'][0]


class LaunchFiles(unittest.TestCase):
    def test_name_their_nodes(self):
        for name, arguments, nodes in CASES:
            command = ['roslaunch', '--nodes', 'planar_vslam', name] + arguments
            result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            self.assertEqual(result.returncode, 0, '%s: %s' % (' '.join(command), result.stderr))
            self.assertEqual(sorted(result.stdout.split()), nodes, ' '.join(command))

    def test_every_argument_says_what_it_is(self):
        for name in ('slam.launch', 'localization.launch', 'replay.launch', 'pepper.launch', 'demo.launch'):
            root = xml.etree.ElementTree.parse(os.path.join(FOLDER, name)).getroot()
            page = open(os.path.join(FOLDER, '..', 'docs', 'ros_api.md'), encoding='utf-8').read()
            for argument in root.findall('arg'):
                self.assertTrue(argument.get('doc'), '%s: %s' % (name, argument.get('name')))
                self.assertIn('`%s`' % argument.get('name'), page, name)

    def test_rviz_shows_topics_that_are_there(self):
        page = open(os.path.join(FOLDER, '..', 'docs', 'ros_api.md'), encoding='utf-8').read()
        files = glob.glob(os.path.join(FOLDER, '..', 'rviz', '*.rviz'))
        self.assertGreater(len(files), 3)
        for path in files:
            with open(path) as file:
                shown = yaml.safe_load(file)
            self.assertIn('QMainWindow State', shown['Window Geometry'], path + ': panels would fill the window')
            for display in shown['Visualization Manager']['Displays'] + shown['Visualization Manager']['Tools']:
                for key in ('Topic', 'Marker Topic', 'Image Topic'):
                    name = display.get(key, '').replace('/move_base/Navfn', 'Navfn').lstrip('/')
                    self.assertTrue(not name or '`%s`' % name in page, '%s: %s' % (path, name))

    def test_topics_go_where_amcl_has_them(self):
        remaps = node_of('localization.launch', 'map_file:=/maps/lab.pvm', 'pose:=amcl_pose', 'scan:=/base_scan').remap_args
        self.assertIn(['pose', 'amcl_pose'], [list(r) for r in remaps])
        self.assertIn(['scan', '/base_scan'], [list(r) for r in remaps])

    def test_pepper_listens_to_its_driver(self):
        remaps = [list(r) for r in node_of('pepper.launch', 'camera:=bottom').remap_args]
        for ours, theirs in (('image', 'camera/bottom/image_raw'), ('camera_info', 'camera/bottom/camera_info'),
                             ('odom', 'odom'), ('scan', 'laser')):
            self.assertIn([ours, '/naoqi_driver/' + theirs], remaps)

    def test_none_is_left_out(self):
        folder = FOLDER
        self.assertEqual(sorted(os.listdir(folder)), sorted({name for name, _, _ in CASES}))


if __name__ == '__main__':
    rostest.rosrun('planar_vslam', 'launch_files', LaunchFiles, sys.argv)
