#!/usr/bin/python3
"""What navigation relies on: map -> odom never goes back, never lags behind odometry, has one parent and one child; the node survives
a clock that jumps and commands in any order. The robot here has wheels only: what is tested comes before every image."""
import sys
import threading
import time
import unittest

import dynamic_reconfigure.client
import rospy
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from planar_vslam.msg import State
from planar_vslam.srv import LoadMap, SetMode
from ros_testing import wait_for
from std_srvs.srv import Empty, Trigger
from tf2_msgs.msg import TFMessage

TOLERANCE = 0.1  # s, transform_tolerance by default
PERIOD = 0.02  # s between odometry


class Wheels(threading.Thread):
    """Odometry at a steady rate, by a clock that can be set."""

    def __init__(self):
        super().__init__(daemon=True)
        self.publisher = rospy.Publisher('odom', Odometry, queue_size=100)
        self.now = 10000.0
        self.sent = []
        self.late = None
        self.start()

    def send(self, stamp):
        message = Odometry()
        message.header.stamp = rospy.Time.from_sec(stamp)
        message.header.frame_id, message.child_frame_id = 'odom', 'base_footprint'
        message.pose.pose.orientation.w = 1.0
        self.publisher.publish(message)

    def run(self):
        while not rospy.is_shutdown():
            self.now += PERIOD
            self.sent.append(self.now)
            self.send(self.now)
            if self.late is not None:
                self.send(self.now - self.late)
            time.sleep(PERIOD)


class Contract(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.transforms, cls.states = [], []
        cls.subscribers = [
            rospy.Subscriber('/tf', TFMessage, lambda m: cls.transforms.extend(m.transforms), queue_size=1000),
            rospy.Subscriber('state', State, cls.states.append, queue_size=1000)]
        cls.wheels = Wheels()
        wait_for(lambda: cls.transforms, 'map -> odom before there is a map')

    def stamps(self, since=0):
        return [t.header.stamp.to_sec() for t in list(self.transforms)[since:]]

    def more(self, count):
        """Stamps of the next transforms."""
        since = len(self.transforms)
        wait_for(lambda: len(self.transforms) >= since + count, 'transforms')
        return self.stamps(since)

    def test_1_one_parent_one_child_growing_stamps_at_a_rate(self):
        stamps = self.more(60)
        for transform in list(self.transforms):
            self.assertEqual((transform.header.frame_id, transform.child_frame_id), ('map', 'odom'))
            self.assertEqual(transform.transform.rotation.w, 1.0)
        steps = [b - a for a, b in zip(stamps, stamps[1:])]
        self.assertGreater(min(steps), 0.0)
        # 30 Hz, at odometry of 50 Hz: a stamp each 20 or 40 ms.
        self.assertLess(sorted(steps)[len(steps) // 2], 0.05)

    def test_2_never_from_the_past(self):
        for stamp in self.more(30):
            dated = stamp - TOLERANCE
            self.assertLess(min(abs(dated - sent) for sent in self.wheels.sent), 1e-6, 'odometry, and the tolerance')

    def test_3_late_odometry_takes_nothing_back(self):
        self.wheels.late = 0.5
        stamps = self.more(30)
        self.wheels.late = None
        self.assertEqual(stamps, sorted(set(stamps)))

    def test_4_a_recording_that_begins_again(self):
        for _ in range(3):
            self.wheels.now -= 500.0
            wait_for(lambda: self.stamps()[-1] < self.wheels.now + 1.0, 'transforms of the new time')
            stamps = self.more(10)
            self.assertEqual(stamps, sorted(set(stamps)))

    def test_5_commands_in_any_order_many_times(self):
        mode, load = rospy.ServiceProxy('set_mode', SetMode), rospy.ServiceProxy('load_map', LoadMap)
        reset, adjust = rospy.ServiceProxy('reset', Trigger), rospy.ServiceProxy('global_bundle_adjustment', Trigger)
        since = len(self.transforms)
        for number in range(50):
            self.assertTrue(reset().success)
            for answer in (mode('localization' if number % 2 else 'mapping'), load('nothing'), load('../nothing'), adjust()):
                self.assertFalse(answer.success, answer.message)
                self.assertTrue(answer.message)
                self.assertNotIn('\n', answer.message)
        self.more(5)
        stamps = self.stamps(since)
        self.assertEqual(stamps, sorted(set(stamps)), 'a reset is no reason to go back')
        self.assertRaises(rospy.ServiceException, rospy.ServiceProxy('global_localization', Empty))

    def test_6_starts_that_are_no_place_do_no_harm(self):
        publisher = rospy.Publisher('initialpose', PoseWithCovarianceStamped, queue_size=20)
        wait_for(publisher.get_num_connections, 'a subscriber of initialpose')
        for frame, x, w in (('map', 0.0, 1.0), ('', 0.0, 0.0), ('odom', 1e300, 1.0), ('map', float('nan'), float('inf'))):
            pose = PoseWithCovarianceStamped()
            pose.header.frame_id = frame
            pose.pose.pose.position.x, pose.pose.pose.orientation.w = x, w
            publisher.publish(pose)
        self.more(10)

    def test_7_state_says_what_is_missing_and_whether_it_pauses(self):
        self.assertTrue(rospy.ServiceProxy('pause', Trigger)().success)
        wait_for(lambda: self.states and self.states[-1].paused, 'the pause')
        self.assertEqual(self.states[-1].waiting_for, 'resume')
        self.assertTrue(rospy.ServiceProxy('resume', Trigger)().success)
        wait_for(lambda: not self.states[-1].paused and self.states[-1].waiting_for == 'images', 'the end of the pause')
        state = self.states[-1]
        self.assertEqual((state.state, state.localised_by, state.quality, state.time_since_fix), ('initializing', 'nothing', 0.0, -1.0))

    def test_8_rates_change_while_it_runs(self):
        client = dynamic_reconfigure.client.Client('slam', timeout=30.0)
        before = client.get_configuration()
        self.assertEqual((before['tf_rate'], before['obstacle_band_max']), (30.0, 1.3))
        client.update_configuration({'tf_rate': 5.0, 'transform_tolerance': 0.3})

        def far_apart():
            latest = self.stamps()[-4:]
            return min(b - a for a, b in zip(latest, latest[1:])) > 0.15
        wait_for(far_apart, 'transforms at 5 Hz')
        stamps = self.stamps()
        self.assertLess(min(abs(stamps[-1] - 0.3 - sent) for sent in self.wheels.sent), 1e-6)
        kept = client.update_configuration({'obstacle_band_min': 2.0, 'tf_rate': 20.0})
        self.assertEqual((kept['obstacle_band_min'], kept['tf_rate']), (0.1, 5.0), 'no band: nothing is changed')
        client.update_configuration({name: before[name] for name in ('tf_rate', 'transform_tolerance')})
        self.assertEqual(rospy.get_param('/slam/tf_rate'), 30.0, 'as a restart finds it')


if __name__ == '__main__':
    rospy.init_node('contract_test')
    rostest.rosrun('planar_vslam', 'contract', Contract, sys.argv)
