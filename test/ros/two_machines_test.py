#!/usr/bin/python3
"""slam_node on a laptop, the robot at the other end of a bad Wi-Fi: compressed images go over, poses come back.

usage: two_machines_test.py PLANAR_VSLAM SLAM_NODE. Exit status 77 where there can be no such link.
"""
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import bad_link

SECONDS, PATIENCE = 14.0, 60.0  # s, of the drive; of wall time
HERE = os.path.dirname(os.path.abspath(__file__))


def truth(file):
    with open(file) as lines:
        rows = [[float(v) for v in line.split()] for line in lines if line[0] != '#']
    return {round(row[0], 3): (row[1], row[2]) for row in rows}


def stop(process):
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        return process.wait(30)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


class TwoMachines(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        self.drive = os.path.join(self.folder, 'drive')
        subprocess.run([sys.argv[1], 'simulate', 'sample_lab', '--out', self.drive, '--until', str(SECONDS)], check=True,
                       stderr=subprocess.DEVNULL)
        self.link = bad_link.TwoMachines()
        self.addCleanup(self.link.close)
        os.environ['ROS_LOG_DIR'] = self.folder

    def start(self, machine, *words):
        with open(os.path.join(self.folder, os.path.basename(words[0]) + '.txt'), 'w') as output:
            process = subprocess.Popen(self.link.command(machine, *words), stdout=output, stderr=subprocess.STDOUT)
        self.addCleanup(stop, process)
        return process

    def wait_for_master(self):
        ask = self.link.command(0, sys.executable, '-c', 'import rosgraph; rosgraph.Master("/test").getPid()')
        until = time.time() + PATIENCE
        while subprocess.run(ask, stderr=subprocess.DEVNULL).returncode != 0:
            self.assertLess(time.time(), until, 'no master')
            time.sleep(0.2)

    def test_poses_come_back(self):
        self.start(0, 'rosmaster', '--core', '-p', '11311')
        self.wait_for_master()
        slam = self.start(1, sys.argv[2], 'image:=/camera/image_raw', 'camera_info:=/camera/camera_info', '__name:=slam',
                          '_image_transport:=compressed', '_queue_size_images:=10', '_transform_tolerance:=0.8')
        robot = subprocess.run(self.link.command(0, sys.executable, HERE + '/two_machines_robot.py', self.drive, str(SECONDS)),
                               stdout=subprocess.PIPE, timeout=240, check=True)
        self.assertEqual(stop(slam), 0)
        row = json.loads(robot.stdout)
        self.assertGreater(row['poses'], 0.6 * row['images'])
        late = sorted(row['late_ms'])
        print('%d of %d poses came back, %.0f ms late in the median, %.0f ms at most; %d of %d packets were lost' % (
            row['poses'], row['images'], late[len(late) // 2], late[-1], sum(w.lost for w in self.link.ways),
            sum(w.lost + w.carried for w in self.link.ways)))
        with open(os.path.join(self.folder, 'slam_node.txt')) as output:
            self.assertNotIn('starting over', output.read())
        self.compare_with_truth(row['positions'])

    def compare_with_truth(self, positions):
        true = truth(self.drive + '/groundtruth_base.txt')
        pairs = [((x, y), true[round(t, 3)]) for t, x, y in positions if round(t, 3) in true]
        self.assertGreater(len(pairs), 30)
        (first, true_first), (last, true_last) = pairs[0], pairs[-1]
        driven, truly = math.dist(first, last), math.dist(true_first, true_last)
        self.assertGreater(truly, 0.5)
        self.assertAlmostEqual(driven, truly, delta=0.05)


if __name__ == '__main__':
    reason = bad_link.reason_not_to()
    if reason:
        print('skipped: ' + reason)
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], '-v'])
